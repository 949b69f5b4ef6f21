#pragma once

#include "contact_query.hpp"

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
#include <octosurf/up.hpp>

namespace octosurf {

/// Made when it is first asked for, by one thread, while others that ask wait for it.
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

/// A map as questions are asked about it, from any thread; never changes.
class ServedMap {
 public:
  /// `name` for its readers and errors; `up`: of --up.
  ServedMap(LoadedMap map, std::string name, const std::string& up, double max_page_mb);
  /// A map that goes on growing, which has no kinds of edges yet. The snapshot has its octree.
  /// `run`: the name of the run that it grows in, for who follows it.
  ServedMap(std::shared_ptr<const Snapshot> snapshot, std::string name, const Eigen::Vector3d& up,
            double max_page_mb, std::string run);

  using Text = std::shared_ptr<const std::string>;

  const AskedMap asked;
  const SurfaceIndex index;
  const std::string info;  ///< JSON
  /// label_edges() of all surfaces; none of a map that goes on growing.
  const Lazy<std::map<SurfaceId, std::vector<PolygonEdges>>> all_edges;
  const Lazy<Text> page, surfaces;  ///< HTML; the export as JSON

  /// What became of it since an earlier revision. Throws Error(usage) for one to come.
  std::string changes_json(std::uint64_t since) const;

 private:
  std::map<SurfaceId, std::vector<PolygonEdges>> make_edges() const;
  Text make_page_text(double max_mb) const;
  Text make_surfaces() const;

  const std::optional<Up> suggested_up_;  ///< in the place of the map's own
  const std::optional<LoadedMap> map_;
  const std::string run_;
};

}  // namespace octosurf
