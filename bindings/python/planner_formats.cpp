// octosurf/planner_formats.hpp and height_grid.hpp in Python.
#include "arrays.hpp"
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/planner_formats.hpp>
#include <octosurf/up.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;

HeightGrid grid_of(const std::shared_ptr<Snapshot>& snapshot, double cell,
                   const std::optional<Eigen::Vector3d>& up, double max_slope_rad,
                   std::optional<double> below) {
  const py::gil_scoped_release others_run;
  return height_grid(*snapshot, {cell, upright(up_in(snapshot, up)), max_slope_rad, below});
}

void bind_height_grid(py::module_& module) {
  using G = HeightGrid;
  Value<G>(module, "HeightGrid", R"(Heights of what can be stepped on over a grid of square cells.

As grid_map has it: element (0, 0) is the cell in the +x, +y corner, rows go against x and columns against y.)")
      .field("cell", &G::cell, "m, edge of a cell.")
      .field("center", &G::center, "(2,) float64, of the whole grid, m; a view.")
      .field("elevation", &G::elevation, "(rows, columns) float32, m; NaN where there is nothing; a view.")
      .field<std::vector<Eigen::MatrixXf>>(
          "normal",
          [](const py::object& self) {
            const auto& normal = self.cast<const G&>().normal;
            const auto view = [&](std::size_t axis) {
              return py::cast(normal[axis], py::return_value_policy::reference_internal, self);
            };
            return py::make_tuple(view(0), view(1), view(2));
          },
          [](G& self, const std::vector<Eigen::MatrixXf>& normal) {
            for (std::size_t axis = 0; axis < 3; ++axis) self.normal[axis] = normal.at(axis);
          },
          "(x, y, z) of the surface's normal there, (rows, columns) float32 each; views.")
      .field("surface", &G::surface, "(rows, columns) float32, its id; a view.")
      .def("center_of", &G::center_of, py::arg("row"), py::arg("column"), "(2,) float64, m.");
  module.def("height_grid", &grid_of, py::arg("snapshot"), py::kw_only(), py::arg("cell") = 0.0,
             py::arg("up") = py::none(), py::arg("max_slope_rad") = std::numbers::pi / 6,
             py::arg("below") = py::none(),
             R"(HeightGrid: the highest surface at each cell's centre, in the map turned so that `up` is +z.

up: (3,), map frame; None: snapshot.up().
cell: m; 0: the map's resolution. Surfaces steeper than max_slope_rad and what is higher than `below` m are left out.)");
}

void bind_planner_surface(py::module_& module) {
  using P = PlannerSurface;
  Value<P>(module, "PlannerSurface", "One surface, and where on it a contact's reference point may be.")
      .field("id", &P::id, "Of the surface.")
      .field("T_world_surface", &P::T_world_surface, "(4, 4) float64; a copy.")
      .field("polygons", &P::polygons, "List of Polygon, surface frame, m.")
      .field("insets", &P::insets, "List of Polygon, surface frame, m.")
      .field("pieces", &P::pieces, "List of ConvexPiece, vertices in the world frame, m.")
      .def(
          py::init([](const std::shared_ptr<Surface>& surface, const std::optional<ContactRegion>& region,
                      std::vector<ConvexPiece> pieces, const std::optional<Eigen::Vector3d>& up) {
            P one{surface->id, surface->T_map_surface, surface->polygons, {}, std::move(pieces)};
            if (region) one.insets = region->polygons;
            return turned(std::move(one), upright(up_in(surface, up)));
          }),
          py::arg("surface"), py::arg("region") = py::none(), py::arg("pieces") = std::vector<ConvexPiece>{},
          py::arg("up") = py::none(),
          R"(Of a Surface, its ContactRegion (the insets) and convex_pieces(), in the world: the map with `up` turned to +z.

up: (3,), map frame; None: as Surface.slope_rad() has it.)");
}

void bind_terrain(py::module_& module) {
  using C = PlanarTerrainCount;
  Value<C>(module, "PlanarTerrainCount", "What a planar terrain has and what it left out.")
      .field("regions", &C::regions, "Written.")
      .field("without_inset", &C::without_inset, "Polygons on which no contact finds room.")
      .field("too_steep", &C::too_steep, "Polygons steeper than 80 degrees.");
  using Guard = py::call_guard<py::gil_scoped_release>;
  module.def("export_planar_terrain", &export_planar_terrain, py::arg("surfaces"), py::arg("grid"),
             py::arg("frame"), py::arg("file"), py::arg("force") = false, Guard(),
             "convex_plane_decomposition_msgs/PlanarTerrain as .json or .cdr: a PlanarTerrainCount.");
  module.def("export_grid_map", &export_grid_map, py::arg("grid"), py::arg("frame"), py::arg("file"),
             py::arg("force") = false, Guard(), "grid_map_msgs/GridMap of a HeightGrid as .json or .cdr.");
}

}  // namespace

void bind_planner_formats(py::module_& module) {
  bind_height_grid(module);
  bind_planner_surface(module);
  bind_terrain(module);
}

}  // namespace octosurf::python
