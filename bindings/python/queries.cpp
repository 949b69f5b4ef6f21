// octosurf/planning.hpp and queries.hpp in Python.
#include "bind.hpp"
#include "casters.hpp"

#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/planning.hpp>
#include <octosurf/queries.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

constexpr double anywhere = std::numeric_limits<double>::infinity();
constexpr double any_slope = std::numbers::pi;
const Eigen::Vector3d z_up = Eigen::Vector3d::UnitZ();

void bind_results(py::module_& module) {
  py::class_<Nearest>(module, "Nearest", "The place on a surface that is nearest to a point.")
      .def_readonly("id", &Nearest::id, "Of the surface.")
      .def_readonly("point", &Nearest::point, "(3,) float64, map frame, m, on its polygons; a view.")
      .def_readonly("distance", &Nearest::distance, "m.");
  py::class_<RayHit>(module, "RayHit", "Where a ray meets a surface.")
      .def_readonly("id", &RayHit::id, "Of the surface.")
      .def_readonly("point", &RayHit::point, "(3,) float64, map frame, m, on its polygons; a view.")
      .def_readonly("distance", &RayHit::distance, "m.")
      .def_readonly("front", &RayHit::front, "From the side the surface was seen from.");
  py::class_<SnappedPose>(module, "SnappedPose", "A pose laid on a surface.")
      .def_readonly("id", &SnappedPose::id, "Of the surface.")
      .def_readonly("T_map_pose", &SnappedPose::T_map_pose, "(4, 4) float64, its z along the normal; a copy.")
      .def_readonly("moved_m", &SnappedPose::moved_m, "m, by which its origin moved.")
      .def_readonly("turned_rad", &SnappedPose::turned_rad, "rad, by which it turned.");
  py::class_<ConvexSpace>(module, "ConvexSpace",
                          "All points with normal . x <= offset for each of its planes; map frame.")
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

T_map_camera: (4, 4), x right, y down, z forward; tangents of the half angles to the right and down.)")
      .def_readonly("planes", &ConvexSpace::planes, "List of Plane.");
}

void bind_questions(py::class_<SurfaceIndex>& index) {
  index
      .def("inside", &SurfaceIndex::in, py::arg("space"),
           "Ids, ascending, of the surfaces of which any point lies in a ConvexSpace.")
      .def("in_sphere", &SurfaceIndex::in_sphere, py::arg("center"), py::arg("radius"),
           "Likewise of a sphere, m.")
      .def(
          "nearest",
          [](const SurfaceIndex& self, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
             double max_slope_rad, double within) {
            return self.nearest(point, {up, max_slope_rad}, within);
          },
          py::arg("point"), py::kw_only(), py::arg("up") = z_up, py::arg("max_slope_rad") = any_slope,
          py::arg("within") = anywhere,
          "Nearest to `point`, (3,), or None; among surfaces that slope to `up` by max_slope_rad at most, "
          "within m.")
      .def(
          "below",
          [](const SurfaceIndex& self, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
             double max_slope_rad) {
            return self.below(point, {up, max_slope_rad});
          },
          py::arg("point"), py::kw_only(), py::arg("up") = z_up, py::arg("max_slope_rad") = any_slope,
          "The place straight below a point, against `up`, where a surface is met first; or None.")
      .def("first_on_ray", &SurfaceIndex::first_on_ray, py::arg("from_"), py::arg("direction"), py::kw_only(),
           py::arg("within") = anywhere,
           "RayHit of the first surface along a ray, from either side, at most `within` m away; or None.")
      .def(
          "snap",
          [](const SurfaceIndex& self, const Eigen::Isometry3d& T_map_pose, const Eigen::Vector3d& up,
             double max_slope_rad, double within) {
            return self.snap(T_map_pose, {up, max_slope_rad}, within);
          },
          py::arg("T_map_pose"), py::kw_only(), py::arg("up") = z_up, py::arg("max_slope_rad") = any_slope,
          py::arg("within") = anywhere,
          "SnappedPose: the pose, (4, 4), moved to the nearest such surface, its z turned to the normal; or "
          "None.")
      .def("surface_of_voxel", &SurfaceIndex::surface_of_voxel, py::arg("point"),
           "Id of the surface that the voxel at `point` belongs to, by the snapshot's octree; 0: none, or no "
           "octree.");
}

}  // namespace

void bind_queries(py::module_& module) {
  bind_results(module);
  py::class_<SurfaceIndex> index(
      module, "SurfaceIndex",
      R"(A snapshot's surfaces, ordered by place for questions that are asked often.

Immutable: every thread may ask. All in the map frame, m; of surfaces that are as near the lower id wins. Throws
Error(usage) for points that are not finite.)");
  index.def(py::init([](const std::shared_ptr<Snapshot>& snapshot, const SurfaceIndex* previous) {
              const py::gil_scoped_release others_run;
              return std::make_unique<SurfaceIndex>(snapshot, previous);
            }),
            py::arg("snapshot"), py::arg("previous") = py::none(),
            "previous: of an earlier snapshot, from which what has not changed is taken over.");
  bind_questions(index);
  module.def(
      "nearest",
      [](const Snapshot& snapshot, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
         double max_slope_rad) {
        return nearest(snapshot, point, {up, max_slope_rad});
      },
      py::arg("snapshot"), py::arg("point"), py::kw_only(), py::arg("up") = z_up,
      py::arg("max_slope_rad") = any_slope,
      "SurfaceIndex.nearest() without an index: looks at every surface.");
  module.def(
      "below",
      [](const Snapshot& snapshot, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
         double max_slope_rad) {
        return below(snapshot, point, {up, max_slope_rad});
      },
      py::arg("snapshot"), py::arg("point"), py::kw_only(), py::arg("up") = z_up,
      py::arg("max_slope_rad") = any_slope, "SurfaceIndex.below() likewise.");
}

}  // namespace octosurf::python
