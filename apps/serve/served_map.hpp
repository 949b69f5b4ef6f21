#pragma once

#include "planning/made_once.hpp"
#include "planning/questions.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <octosurf/map.hpp>
#include <octosurf/page.hpp>

namespace octosurf {

/// Surfaces as they are shown, without voids, of a map that goes on growing. Where a later ray has changed
/// such an outline alone, it has the revision at which that was found, so that clients get it.
class ShownSurfaces {
 public:
  /// Of the revision that is `solid`'s; outlines found anew count from it on.
  std::shared_ptr<const Snapshot> of(const GroundView& ground);

 private:
  struct Outline {
    SurfacePtr surface;
    std::uint64_t revision = 0;  ///< 0: as the surface's
  };
  std::mutex mutex_;
  std::uint64_t latest_ = 0;
  std::map<SurfaceId, Outline> outlines_;
};

/// A map to be queried from any thread; never changes. Derived data are made once, for all clients.
class ServedMap {
 public:
  /// `name` for its readers and errors; `up`: of --up.
  ServedMap(LoadedMap map, std::string name, const std::string& up,
            double max_page_mb = PageOptions{}.max_mb);
  /// What a map that goes on growing has beside it: of its run, for all its moments.
  struct Run {
    std::string name;
    std::shared_ptr<ShownSurfaces> shown = std::make_shared<ShownSurfaces>();
  };
  /// A map that goes on growing. The snapshot has its octree. `previous`:
  /// the same earlier, null: none.
  ServedMap(std::shared_ptr<const Snapshot> snapshot, std::string name, const Eigen::Vector3d& up, Run run,
            const ServedMap* previous);

  using Text = std::shared_ptr<const std::string>;

  const planning::AskedMap asked;
  const Run run;  ///< without a name: of a finished map

  std::string page() const;
  Text page_html() const;  ///< of a page that asks this server, if the map goes on growing
  Text voxels() const;     ///< io::voxels_message()
  /// What has changed since a revision of this `run`, which may be empty; everything, if there is none such.
  std::string changes_json(std::optional<std::uint64_t> since, const std::string& of_run) const;

 private:
  template <class Make>
  Text text(const std::string& key, const Make& make) const;
  /// Surfaces without their voids, and their stairs.
  PageMap page_map() const;
  std::shared_ptr<const Snapshot> shown() const;

  const GroundView ground_;  ///< bare
  const double max_page_mb_;
  const std::optional<LoadedMap> map_;
  mutable planning::MadeOnce<std::string, Text> texts_;
  mutable planning::MadeOnce<int, std::shared_ptr<const Snapshot>> shown_;
};

}  // namespace octosurf
