// octosurf/occupancy.hpp in Python: the octree of a map at one moment.
#include "bind.hpp"
#include "geometry/voxel_grid.hpp"

#include <span>
#include <tuple>

#include <octosurf/occupancy.hpp>

namespace octosurf::python {
namespace {

using View = OccupancyView;
using Leaf = View::Leaf;

/// A row of OccupancyView.occupied().
struct OccupiedRow {
  std::array<double, 3> center;
  float log_odds;
  SurfaceId surface;
};

/// Corner, level, leaves: as OccupancyView::VisitChange.
using ChangedCube = std::tuple<std::array<std::uint16_t, 3>, std::uint8_t, py::array_t<Leaf>>;

Eigen::AlignedBox3d box_of(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  if (!((low.array() <= high.array()).all()))
    throw Error(Error::Kind::usage, "box", "has a corner `low` that is not below `high`", "swap them");
  return {low, high};
}

py::array_t<OccupiedRow> occupied(const View& view, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::vector<OccupiedRow> rows;
  {
    const py::gil_scoped_release others_run;
    view.for_each_occupied(box_of(low, high), [&rows](const View::Voxel& voxel) {
      rows.push_back({{voxel.center.x(), voxel.center.y(), voxel.center.z()}, voxel.log_odds, voxel.surface});
      return true;
    });
  }
  return moved_array(std::move(rows));
}

py::array_t<Leaf> leaves(const View& view) {
  std::vector<Leaf> all;
  {
    const py::gil_scoped_release others_run;
    view.for_each_leaf(
        [&all](std::span<const Leaf> some) { all.insert(all.end(), some.begin(), some.end()); });
  }
  return moved_array(std::move(all));
}

std::vector<ChangedCube> changes(const View& view, const View& before) {
  std::vector<ChangedCube> all;
  view.for_each_change(before, [&all](const auto& corner, std::uint8_t level, std::span<const Leaf> some) {
    all.push_back(ChangedCube(corner, level, moved_array(std::vector<Leaf>(some.begin(), some.end()))));
  });
  return all;
}

py::array_t<std::uint8_t> states(const View& view, const Dense<double>& points) {
  if (points.ndim() != 2 || points.shape(1) != 3)
    throw Error(Error::Kind::usage, "points", "are not of shape (N, 3)", "give one row per point");
  std::vector<std::uint8_t> all(static_cast<std::size_t>(points.shape(0)));
  const double* point = points.data();
  for (std::uint8_t& state : all) {
    state = static_cast<std::uint8_t>(view.at({point[0], point[1], point[2]}).state);
    point += 3;
  }
  return moved_array(std::move(all));
}

}  // namespace

void bind_occupancy(Module& module) {
  PYBIND11_NUMPY_DTYPE(OccupiedRow, center, log_odds, surface);
  PYBIND11_NUMPY_DTYPE(Leaf, corner, level, log_odds);

  Class<View> view(module, "OccupancyView",
                   R"(A map's octree at one moment: never changes, cheap to keep, readable from any thread.

Voxels are half-open cubes of edge `resolution`; what lies on a face belongs to the higher one. Points are in the map
frame, metres. Boxes are closed and given by their corners `low` and `high`, (3,) each.)");
  using Voxel = View::Voxel;
  Value<Voxel>(view, "Voxel", nullptr, "OccupancyView.Voxel")
      .fields(OCTOSURF_FIELDS(Voxel, state, log_odds, surface, center, point, view, range_m));
  Value<View::Count>(view, "Count", nullptr, "OccupancyView.Count")
      .fields(OCTOSURF_FIELDS(View::Count, unknown, free, occupied));
  view.def("at", &View::at, "point"_a)
      .def("states", &states, "points"_a,
           "(N,) uint8, one for each row of `points`, (N, 3): 0 unknown, 1 free, 2 occupied.")
      .def("first_on_way", &View::first_on_way, "from_"_a, "to"_a, "unknown_stops"_a = false)
      .def("occupied", &occupied, "low"_a, "high"_a,
           R"(Every occupied voxel with its centre in the box, in Morton order; a structured array of its own.

Columns: "center" (3 float64, m), "log_odds" (float32), "surface" (uint64; 0: pending).)")
      .def(
          "count",
          [](const View& self, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
            return self.count(box_of(low, high));
          },
          "low"_a, "high"_a)
      .def("nearest_occupied", &View::nearest_occupied, "point"_a, "limit"_a)
      .def(
          "leaves", &leaves,
          R"(All leaves as OctoMap's octree would have them, pruned, in Morton order; a structured array of its own.

Columns: "corner" (3 uint16, OctoMap's key of its lowest voxel; 32768 begins at 0 m), "level" (uint8: its edge is
2**level voxels), "log_odds" (float32).)")
      .def(
          "octomap_data",
          [](const View& self, const std::optional<Eigen::Vector3d>& low,
             const std::optional<Eigen::Vector3d>& high, bool full) {
            return py::bytes([&] {
              const py::gil_scoped_release others_run;
              return self.octomap_data(low && high ? box_of(*low, *high) : Eigen::AlignedBox3d(), full);
            }());
          },
          "low"_a = py::none(), "high"_a = py::none(), "full"_a = false)
      .def(
          "changed_in",
          [](const View& self, const View& before, const std::optional<Eigen::Vector3d>& low,
             const std::optional<Eigen::Vector3d>& high) {
            const double d = self.resolution();
            const Eigen::AlignedBox3d box = low && high ? box_of(*low, *high) : Eigen::AlignedBox3d();
            bool changed = d != before.resolution();
            if (d > 0 && !changed)
              self.for_each_changed_cube(before, [&](const std::array<std::uint16_t, 3>& corner, int level) {
                const Eigen::Vector3d at =
                    geometry::VoxelGrid(d).corner_of({corner[0], corner[1], corner[2]});
                const double edge = d * static_cast<double>(1 << level);
                changed |= box.isEmpty() || box.intersects({at, at + Eigen::Vector3d::Constant(edge)});
              });
            return changed;
          },
          "before"_a, "low"_a = py::none(), "high"_a = py::none(), Released(),
          "Whether a cube was replaced since `before` that meets a box, anywhere without one.")
      .def("changes", &changes, "before"_a,
           R"(What has changed since `before`, an earlier view: a list of (corner, level, leaves).

Each is a cube that was replaced: its lowest voxel's key, its edge as 2**level voxels, and the leaves that are in it
now, as leaves() has them; none if nothing is known there any longer.)")
      .def_property_readonly("resolution", &View::resolution, "d, m; 0 if nothing is known.");
}

}  // namespace octosurf::python
