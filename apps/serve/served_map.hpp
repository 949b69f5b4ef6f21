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

/// What a map that goes on growing has beside it: of its run, for all its moments.
struct ServedRun {
  std::string name;  ///< empty: a finished map
  std::shared_ptr<ShownSurfaces> shown = std::make_shared<ShownSurfaces>();
};

/// A map to be queried from any thread; never changes. Derived data are made once, for all clients.
class ServedMap {
 public:
  /// `previous`: the same map earlier in its run; null: none.
  explicit ServedMap(planning::AskedMap map, double max_page_mb = PageOptions{}.max_mb, ServedRun of = {},
                     const ServedMap* previous = nullptr);

  using Text = std::shared_ptr<const std::string>;

  const planning::AskedMap asked;
  const ServedRun run;

  std::string page() const;
  Text page_html() const;  ///< of a page that asks this server, if the map goes on growing
  Text voxels() const;     ///< io::voxels_message()
  /// What has changed since a revision of this `run`, which may be empty; everything, if there is none such.
  std::string changes_json(std::optional<std::uint64_t> since, const std::string& of_run) const;

 private:
  /// Surfaces without their voids, and their stairs.
  PageMap page_map() const;
  std::shared_ptr<const Snapshot> shown() const;

  const GroundView ground_;  ///< bare
  const double max_page_mb_;
  mutable planning::MadeOnce<std::string, Text> texts_;
  mutable planning::MadeOnce<int, std::shared_ptr<const Snapshot>> shown_;
};

}  // namespace octosurf
