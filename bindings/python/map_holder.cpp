#include "map_holder.hpp"

#include "casters.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>

#ifdef OCTOSURF_PCL
#include <octosurf/adapters/paper_detector.hpp>
#endif
#include <octosurf/up.hpp>

namespace octosurf::python {

const detection::Detector* papers_detector() {
#ifdef OCTOSURF_PCL
  return paper_detector();
#else
  return nullptr;
#endif
}

void MapHolder::note_up(const Map& map) {
  const surfaces::MapState& state = map.state();
  const double scans = std::max(1.0, static_cast<double>(state.scans));
  auto up = std::make_shared<const MapUp>(MapUp{map.parameters().up, state.sensors_up / scans});
  const std::lock_guard alone(up_busy_);
  up_ = std::move(up);
}

std::shared_ptr<Snapshot> MapHolder::snapshot() const {
  std::shared_ptr<const Snapshot> last = mapper_ ? mapper_->snapshot() : map_->snapshot();
  const std::lock_guard alone(up_busy_);
  return of_map(std::move(last), up_);
}

Parameters parameters_of(const std::optional<Parameters>& given, const pybind11::kwargs& fields) {
  const pybind11::object settings = pybind11::cast(given.value_or(Parameters{}));
  return settings.attr("replaced")(**fields).cast<Parameters>();
}

Eigen::Vector3d up_in(const std::shared_ptr<Snapshot>& snapshot,
                      const std::optional<Eigen::Vector3d>& wanted) {
  if (wanted) return *wanted;
  const std::shared_ptr<const MapUp> map = map_up(snapshot);
  if (map && map->given) return *map->given;
  return estimate_up(*snapshot, map ? map->sensors_up : Eigen::Vector3d::Zero()).direction;
}

Eigen::Vector3d up_in(const std::shared_ptr<Surface>& surface, const std::optional<Eigen::Vector3d>& wanted) {
  if (wanted) return *wanted;
  const std::shared_ptr<const MapUp> map = map_up(surface);
  if (map && map->given) return *map->given;
  throw Error(Error::Kind::usage, "up", "is not known of surface " + std::to_string(surface->id) + " alone",
              "give up=snapshot.up(), of its map's snapshot");
}

}  // namespace octosurf::python
