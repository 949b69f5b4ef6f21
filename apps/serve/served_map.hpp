#pragma once

#include "planning/questions.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/export.hpp>
#include <octosurf/map.hpp>
#include <octosurf/queries.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/up.hpp>

namespace octosurf {

/// Made at the first get(), by one thread; other threads wait for it.
template <typename Value>
class Lazy {
 public:
  explicit Lazy(std::function<Value()> make) : make_(std::move(make)) {}
  const Value& get() const {
    std::call_once(once_, [this] { value_ = make_(); });
    return *value_;
  }

 private:
  std::function<Value()> make_;
  mutable std::once_flag once_;
  mutable std::optional<Value> value_;
};

/// Surfaces as they are shown, without voids, of a map that goes on growing. A later ray may change such an
/// outline though nothing changed of the surface: each then has the revision at which that was found, so that
/// who knows an earlier one is told.
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
  ServedMap(LoadedMap map, std::string name, const std::string& up, double max_page_mb);
  /// What a map that goes on growing has beside it: of its run, for all its moments.
  struct Run {
    std::string name;
    std::shared_ptr<ShownSurfaces> shown = std::make_shared<ShownSurfaces>();
  };
  /// A map that goes on growing, which has no kinds of edges yet. The snapshot has its octree. `previous`:
  /// the same earlier, null: none.
  ServedMap(std::shared_ptr<const Snapshot> snapshot, std::string name, const Eigen::Vector3d& up,
            double max_page_mb, Run run, const ServedMap* previous);

  using Text = std::shared_ptr<const std::string>;
  struct Export {
    std::shared_ptr<const Snapshot> snapshot;
    ExportExtras extras;
  };

  const planning::AskedMap asked;
  const Run run;  ///< without a name: of a finished map
  /// Surfaces without their voids.
  const Lazy<std::shared_ptr<const Snapshot>> shown{[this] { return make_shown(); }};
  /// label_edges() of all shown surfaces; none of a map that goes on growing.
  const Lazy<std::map<SurfaceId, std::vector<PolygonEdges>>> all_edges{[this] { return make_edges(); }};
  const Lazy<Stairs> stairs{[this] { return asked.bare_ground().stairs(); }};
  const Lazy<Text> page{[this] { return make_page_text(); }};  ///< HTML
  const Lazy<Text> info{[this] { return make_info(); }};       ///< JSON
  const Lazy<Export> exported{[this] { return make_export(); }};
  const Lazy<Text> surfaces{[this] { return make_surfaces(); }};  ///< the export as JSON
  const Lazy<Text> voxels{[this] { return make_voxels(); }};

  /// One of `surfaces`. Throws Error(data) if there is none of this id, which says what became of it.
  std::string surface_json(SurfaceId id) const;
  /// Changes since an earlier revision. Throws Error(usage) for a later one. With a box only of surfaces and
  /// cylinders that touch it: whose own box, along the map's axes, meets it. What changed elsewhere, and may
  /// have touched it before, is listed as "outside". What is gone or merged is all told: its extent is not
  /// kept.
  std::string changes_json(std::uint64_t since, const std::optional<Eigen::AlignedBox3d>& box) const;
  /// io::surfaces_message() as a server-sent event: since an earlier revision, or everything.
  Text changes_event(std::optional<std::uint64_t> since) const;

 private:
  std::map<SurfaceId, std::vector<PolygonEdges>> make_edges() const;
  std::shared_ptr<const Snapshot> make_shown() const;
  Text make_page_text() const;
  Text make_info() const;
  Export make_export() const;
  Text make_surfaces() const;
  Text make_voxels() const;

  const double max_page_mb_;
  const std::string up_;
  const std::optional<Up> suggested_up_;  ///< in the place of the map's own
  const std::optional<LoadedMap> map_;
  mutable std::mutex making_;  ///< of the events
  mutable std::map<std::optional<std::uint64_t>, Text> events_;
};

}  // namespace octosurf
