#pragma once

#include "contact_query.hpp"
#include "io/exporters/page_messages.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

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

/// A map to be queried from any thread; never changes. Derived data are made once, for all clients.
class ServedMap {
 public:
  /// `name` for its readers and errors; `up`: of --up.
  ServedMap(LoadedMap map, std::string name, const std::string& up, double max_page_mb);
  /// A map that goes on growing, which has no kinds of edges yet. The snapshot has its octree.
  /// `run`: the name of the run that it grows in; `track`: the sensor's until now.
  ServedMap(std::shared_ptr<const Snapshot> snapshot, std::string name, const Eigen::Vector3d& up,
            double max_page_mb, std::string run, std::function<io::SensorTrack()> track);

  using Text = std::shared_ptr<const std::string>;

  const AskedMap asked;
  const std::string run;  ///< empty: of a finished map
  const Lazy<SurfaceIndex> index{[this] { return SurfaceIndex(asked.snapshot); }};
  /// Surfaces as find_gaps() tells, with the gaps; of a map that goes on growing as they were mapped.
  struct Shown {
    std::shared_ptr<const Snapshot> snapshot;
    std::map<SurfaceId, std::vector<Gap>> gaps{};
  };
  const Lazy<Shown> shown{[this] { return make_shown(); }};
  /// label_edges() of all shown surfaces; none of a map that goes on growing.
  const Lazy<std::map<SurfaceId, std::vector<PolygonEdges>>> all_edges{[this] { return make_edges(); }};
  const Lazy<Stairs> stairs{[this] { return find_stairs(*shown.get().snapshot, asked.up); }};
  const Lazy<Text> page{[this] { return make_page_text(); }};     ///< HTML
  const Lazy<Text> info{[this] { return make_info(); }};          ///< JSON
  const Lazy<Text> surfaces{[this] { return make_surfaces(); }};  ///< the export as JSON
  const Lazy<Text> voxels{[this] { return make_voxels(false); }},
      slices{[this] { return make_voxels(true); }};

  /// Changes since an earlier revision. Throws Error(usage) for a later one.
  std::string changes_json(std::uint64_t since) const;
  /// io::surfaces_message() as a server-sent event: since an earlier revision, or everything.
  Text changes_event(std::optional<std::uint64_t> since) const;

 private:
  std::map<SurfaceId, std::vector<PolygonEdges>> make_edges() const;
  Shown make_shown() const;
  Text make_page_text() const;
  Text make_info() const;
  Text make_surfaces() const;
  Text make_voxels(bool with_slices) const;

  const double max_page_mb_;
  const std::string up_;
  const std::optional<Up> suggested_up_;  ///< in the place of the map's own
  const std::optional<LoadedMap> map_;
  const std::function<io::SensorTrack()> track_;
  mutable std::mutex making_;  ///< of the events
  mutable std::map<std::optional<std::uint64_t>, Text> events_;
};

}  // namespace octosurf
