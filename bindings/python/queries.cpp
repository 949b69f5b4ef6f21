// octosurf/planning.hpp and queries.hpp in Python.
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/planning.hpp>
#include <octosurf/queries.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

constexpr double anywhere = std::numeric_limits<double>::infinity();
constexpr double any_slope = std::numbers::pi;

/// Which way is up where surfaces of any slope will do: not worth an estimate.
Eigen::Vector3d up_for(const std::shared_ptr<Snapshot>& snapshot, const std::optional<Eigen::Vector3d>& up,
                       double max_slope_rad) {
  return !up && max_slope_rad >= any_slope ? Eigen::Vector3d(0, 0, 1) : up_in(snapshot, up);
}

/// With its map's up, found once.
struct PythonIndex : SurfaceIndex {
  PythonIndex(const std::shared_ptr<Snapshot>& snapshot, const PythonIndex* previous)
      : SurfaceIndex(snapshot, previous), own_up(up_in(snapshot)), surfaces(snapshot->surfaces.size()) {}

  Eigen::Vector3d own_up;
  std::size_t surfaces;
};

void bind_results(py::module_& module) {
  Value<Nearest>(module, "Nearest", "The place on a surface that is nearest to a point.")
      .field("id", &Nearest::id, "Of the surface.")
      .field("point", &Nearest::point, "(3,) float64, map frame, m, on its polygons; a view.")
      .field("distance", &Nearest::distance, "m.");
  Value<RayHit>(module, "RayHit", "Where a ray meets a surface.")
      .field("id", &RayHit::id, "Of the surface.")
      .field("point", &RayHit::point, "(3,) float64, map frame, m, on its polygons; a view.")
      .field("distance", &RayHit::distance, "m.")
      .field("front", &RayHit::front, "From the side the surface was seen from.");
  Value<SnappedPose>(module, "SnappedPose", "A pose laid on a surface.")
      .field("id", &SnappedPose::id, "Of the surface.")
      .field("T_map_pose", &SnappedPose::T_map_pose, "(4, 4) float64, its z along the normal; a copy.")
      .field("moved_m", &SnappedPose::moved_m, "m, by which its origin moved.")
      .field("turned_rad", &SnappedPose::turned_rad, "rad, by which it turned.");
  Value<ConvexSpace>(module, "ConvexSpace",
                     "All points with normal . x <= offset for each of its planes; map frame.")
      .field("planes", &ConvexSpace::planes, "List of Plane.")
      .def(py::init([](std::vector<Plane> planes) { return ConvexSpace{std::move(planes)}; }),
           py::arg("planes"), "Of a list of Plane.")
      .def_static(
          "box",
          [](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
            return ConvexSpace::box(Eigen::AlignedBox3d(low, high));
          },
          py::arg("low"), py::arg("high"), "A box by its corners, (3,) each, m.")
      .def_static("frustum", &ConvexSpace::frustum, py::arg("T_map_camera"), py::arg("tan_right"),
                  py::arg("tan_down"), py::arg("near"), py::arg("far"),
                  R"(What a camera sees between two distances along its z axis, m.

T_map_camera: (4, 4), x right, y down, z forward; tangents of the half angles to the right and down.)");
}

void bind_questions(py::class_<PythonIndex>& index) {
  index
      .def("inside", &PythonIndex::in, py::arg("space"),
           "Ids, ascending, of the surfaces of which any point lies in a ConvexSpace.")
      .def("in_sphere", &PythonIndex::in_sphere, py::arg("center"), py::arg("radius"),
           "Likewise of a sphere, m.")
      .def(
          "nearest",
          [](const PythonIndex& self, const Eigen::Vector3d& point, const std::optional<Eigen::Vector3d>& up,
             double max_slope_rad, double within) {
            return self.nearest(point, {up.value_or(self.own_up), max_slope_rad}, within);
          },
          py::arg("point"), py::kw_only(), py::arg("up") = py::none(), py::arg("max_slope_rad") = any_slope,
          py::arg("within") = anywhere,
          "Nearest to `point`, (3,), or None; among surfaces that slope to `up` by max_slope_rad at most, "
          "within m.")
      .def(
          "below",
          [](const PythonIndex& self, const Eigen::Vector3d& point, const std::optional<Eigen::Vector3d>& up,
             double max_slope_rad) {
            return self.below(point, {up.value_or(self.own_up), max_slope_rad});
          },
          py::arg("point"), py::kw_only(), py::arg("up") = py::none(), py::arg("max_slope_rad") = any_slope,
          "The place straight below a point, against `up`, where a surface is met first; or None.")
      .def("first_on_ray", &PythonIndex::first_on_ray, py::arg("from_"), py::arg("direction"), py::kw_only(),
           py::arg("within") = anywhere,
           "RayHit of the first surface along a ray, from either side, at most `within` m away; or None.")
      .def(
          "snap",
          [](const PythonIndex& self, const Eigen::Isometry3d& T_map_pose,
             const std::optional<Eigen::Vector3d>& up, double max_slope_rad, double within) {
            return self.snap(T_map_pose, {up.value_or(self.own_up), max_slope_rad}, within);
          },
          py::arg("T_map_pose"), py::kw_only(), py::arg("up") = py::none(),
          py::arg("max_slope_rad") = any_slope, py::arg("within") = anywhere,
          "SnappedPose: the pose, (4, 4), moved to the nearest such surface, its z turned to the normal; or "
          "None.")
      .def("surface_of_voxel", &PythonIndex::surface_of_voxel, py::arg("point"),
           "Id of the surface that the voxel at `point` belongs to, by the snapshot's octree; 0: none, or no "
           "octree.");
}

}  // namespace

void bind_queries(py::module_& module) {
  bind_results(module);
  py::class_<PythonIndex> index(module, "SurfaceIndex",
                                R"(A snapshot's surfaces, ordered by place for questions that are asked often.

Immutable: every thread may ask. All in the map frame, m; of surfaces that are as near the lower id wins. up: (3,), map
frame; None: Snapshot.up(). Throws Error(usage) for points that are not finite.)");
  index.def("__repr__", [](const PythonIndex& self) {
    return "<SurfaceIndex of " + std::to_string(self.surfaces) + " surfaces>";
  });
  index.def(py::init([](const std::shared_ptr<Snapshot>& snapshot, const PythonIndex* previous) {
              const py::gil_scoped_release others_run;
              return std::make_unique<PythonIndex>(snapshot, previous);
            }),
            py::arg("snapshot"), py::arg("previous") = py::none(),
            "previous: of an earlier snapshot, from which what has not changed is taken over.");
  bind_questions(index);
  module.def(
      "nearest",
      [](const std::shared_ptr<Snapshot>& snapshot, const Eigen::Vector3d& point,
         const std::optional<Eigen::Vector3d>& up, double max_slope_rad) {
        return nearest(*snapshot, point, {up_for(snapshot, up, max_slope_rad), max_slope_rad});
      },
      py::arg("snapshot"), py::arg("point"), py::kw_only(), py::arg("up") = py::none(),
      py::arg("max_slope_rad") = any_slope,
      "SurfaceIndex.nearest() without an index: looks at every surface.");
  module.def(
      "below",
      [](const std::shared_ptr<Snapshot>& snapshot, const Eigen::Vector3d& point,
         const std::optional<Eigen::Vector3d>& up, double max_slope_rad) {
        return below(*snapshot, point, {up_in(snapshot, up), max_slope_rad});
      },
      py::arg("snapshot"), py::arg("point"), py::kw_only(), py::arg("up") = py::none(),
      py::arg("max_slope_rad") = any_slope, "SurfaceIndex.below() likewise.");
}

}  // namespace octosurf::python
