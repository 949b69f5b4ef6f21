// octosurf/queries.hpp in Python.
#include "map_holder.hpp"

#include <limits>
#include <numbers>

#include <octosurf/queries.hpp>

namespace octosurf::python {
namespace {

constexpr double anywhere = std::numeric_limits<double>::infinity();
constexpr double any_slope = std::numbers::pi;
using GivenUp = std::optional<Eigen::Vector3d>;

/// With its map's up, found once.
struct PythonIndex : SurfaceIndex {
  PythonIndex(const SnapshotPtr& snapshot, const PythonIndex* previous)
      : SurfaceIndex(snapshot, previous), own_up(up_in(snapshot)) {}

  SlopeLimit limit(const GivenUp& up, double max_slope_rad) const {
    return {up.value_or(own_up), max_slope_rad};
  }

  Eigen::Vector3d own_up;
};

}  // namespace

void bind_queries(Module& module) {
  Value<Nearest>(module, "Nearest").fields(OCTOSURF_FIELDS(Nearest, id, point, distance));
  Value<RayHit>(module, "RayHit").fields(OCTOSURF_FIELDS(RayHit, id, point, distance, front));
  Value<ConvexSpace>(module, "ConvexSpace")
      .fields(OCTOSURF_FIELDS(ConvexSpace, planes))
      .def(py::init<std::vector<Plane>>(), "planes"_a, "Of a list of Plane.")
      .def_static(
          "box",
          [](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
            return ConvexSpace::box(Eigen::AlignedBox3d(low, high));
          },
          "low"_a, "high"_a, "A box by its corners, (3,) each, m.");
  Class<PythonIndex>(module, "SurfaceIndex",
                     R"(A snapshot's surfaces, indexed by place for repeated queries.

Immutable: any thread may query it. All in the map frame, m; of surfaces that are as near the lower id wins. up: (3,), map
frame; None: Snapshot.up(). Throws Error(usage) for points that are not finite.)")
      .def(py::init([](const SnapshotPtr& snapshot, const PythonIndex* previous) {
             const py::gil_scoped_release others_run;
             return std::make_unique<PythonIndex>(snapshot, previous);
           }),
           "snapshot"_a, "previous"_a = py::none(),
           "previous: of an earlier snapshot, from which what has not changed is taken over.")
      .def("inside", &PythonIndex::in, "space"_a, doc_of("SurfaceIndex.in"))
      .def("in_sphere", &PythonIndex::in_sphere, "center"_a, "radius"_a)
      .def(
          "nearest",
          [](const PythonIndex& self, const Eigen::Vector3d& point, const GivenUp& up, double max_slope_rad,
             double within) { return self.nearest(point, self.limit(up, max_slope_rad), within); },
          "point"_a, py::kw_only(), "up"_a = py::none(), "max_slope_rad"_a = any_slope, "within"_a = anywhere,
          "Nearest to `point`, (3,), or None; among surfaces that slope to `up` by max_slope_rad at most, "
          "within m.")
      .def(
          "below",
          [](const PythonIndex& self, const Eigen::Vector3d& point, const GivenUp& up, double max_slope_rad) {
            return self.below(point, self.limit(up, max_slope_rad));
          },
          "point"_a, py::kw_only(), "up"_a = py::none(), "max_slope_rad"_a = any_slope)
      .def("first_on_ray", &PythonIndex::first_on_ray, "from_"_a, "direction"_a, py::kw_only(),
           "within"_a = anywhere);
}

}  // namespace octosurf::python
