// octosurf/planner_formats.hpp and height_grid.hpp in Python.
#include "arrays.hpp"
#include "bind.hpp"
#include "casters.hpp"

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

HeightGrid grid_of(const std::shared_ptr<Snapshot>& snapshot, double cell, const Eigen::Vector3d& up,
                   double max_slope_rad, std::optional<double> below) {
  const py::gil_scoped_release others_run;
  return height_grid(*snapshot, {cell, upright(up), max_slope_rad, below});
}

void bind_height_grid(py::module_& module) {
  using G = HeightGrid;
  py::class_<G>(module, "HeightGrid", R"(Heights of what can be stepped on over a grid of square cells.

As grid_map has it: element (0, 0) is the cell in the +x, +y corner, rows go against x and columns against y.)")
      .def_readonly("cell", &G::cell, "m, edge of a cell.")
      .def_readonly("center", &G::center, "(2,) float64, of the whole grid, m; a view.")
      .def_readonly("elevation", &G::elevation,
                    "(rows, columns) float32, m; NaN where there is nothing; a view.")
      .def_property_readonly(
          "normal",
          [](const py::object& self) {
            const auto& normal = self.cast<const G&>().normal;
            const auto view = [&](std::size_t axis) {
              return py::cast(normal[axis], py::return_value_policy::reference_internal, self);
            };
            return py::make_tuple(view(0), view(1), view(2));
          },
          "(x, y, z) of the surface's normal there, (rows, columns) float32 each; views.")
      .def_readonly("surface", &G::surface, "(rows, columns) float32, its id; a view.")
      .def("center_of", &G::center_of, py::arg("row"), py::arg("column"), "(2,) float64, m.");
  module.def("height_grid", &grid_of, py::arg("snapshot"), py::kw_only(), py::arg("cell") = 0.0,
             py::arg("up") = Eigen::Vector3d(0, 0, 1), py::arg("max_slope_rad") = std::numbers::pi / 6,
             py::arg("below") = py::none(),
             R"(HeightGrid: the highest surface at each cell's centre, in the map turned so that `up` is +z.

cell: m; 0: the map's resolution. Surfaces steeper than max_slope_rad and what is higher than `below` m are left out.)");
}

void bind_planner_surface(py::module_& module) {
  using P = PlannerSurface;
  py::class_<P>(module, "PlannerSurface", "One surface, and where on it a contact's reference point may be.")
      .def(
          py::init([](const std::shared_ptr<Surface>& surface, const std::optional<ContactRegion>& region,
                      std::vector<ConvexPiece> pieces, const Eigen::Vector3d& up) {
            P one{surface->id, surface->T_map_surface, surface->polygons, {}, std::move(pieces)};
            if (region) one.insets = region->polygons;
            return turned(std::move(one), upright(up));
          }),
          py::arg("surface"), py::arg("region") = py::none(), py::arg("pieces") = std::vector<ConvexPiece>{},
          py::arg("up") = Eigen::Vector3d(0, 0, 1),
          R"(Of a Surface, its ContactRegion (the insets) and convex_pieces(), in the world: the map with `up` turned to +z.)")
      .def_readonly("id", &P::id, "Of the surface.")
      .def_readonly("T_world_surface", &P::T_world_surface, "(4, 4) float64; a copy.")
      .def_readonly("polygons", &P::polygons, "List of Polygon, surface frame, m.")
      .def_readonly("insets", &P::insets, "List of Polygon, surface frame, m.")
      .def_readonly("pieces", &P::pieces, "List of ConvexPiece, vertices in the world frame, m.");
  using I = IhmcRegion;
  py::class_<I>(module, "IhmcRegion", "A planar region as IHMC's planners know it.")
      .def_readonly("id", &I::id, "Of the surface.")
      .def_readonly("T_world_region", &I::T_world_region, "(4, 4) float64; a copy.")
      .def_property_readonly(
          "hull", [](const py::object& self) { return rows_view(self.cast<const I&>().hull, self); },
          "(N, 2) float64, counter-clockwise, region frame, m; a read-only view.")
      .def_property_readonly(
          "polygons",
          [](const py::object& self) {
            std::vector<py::array_t<double>> views;
            for (const Ring2& ring : self.cast<const I&>().polygons) views.push_back(rows_view(ring, self));
            return views;
          },
          "List of (M, 2) float64, convex, counter-clockwise, region frame, m; read-only views.");
}

void bind_terrain(py::module_& module) {
  using C = PlanarTerrainCount;
  py::class_<C>(module, "PlanarTerrainCount", "What a planar terrain has and what it left out.")
      .def_readonly("regions", &C::regions, "Written.")
      .def_readonly("without_inset", &C::without_inset, "Polygons on which no contact finds room.")
      .def_readonly("too_steep", &C::too_steep, "Polygons steeper than 80 degrees.");
  using Guard = py::call_guard<py::gil_scoped_release>;
  module.def("export_planar_terrain", &export_planar_terrain, py::arg("surfaces"), py::arg("grid"),
             py::arg("frame"), py::arg("file"), py::arg("force") = false, Guard(),
             "convex_plane_decomposition_msgs/PlanarTerrain as .json or .cdr: a PlanarTerrainCount.");
  module.def("export_grid_map", &export_grid_map, py::arg("grid"), py::arg("frame"), py::arg("file"),
             py::arg("force") = false, Guard(), "grid_map_msgs/GridMap of a HeightGrid as .json or .cdr.");
  module.def("export_height_image", &export_height_image, py::arg("grid"), py::arg("file"),
             py::arg("force") = false, Guard(),
             "A HeightGrid as 16-bit grey PNG, and beside it a .json that says what its values mean.");
}

}  // namespace

void bind_planner_formats(py::module_& module) {
  using Guard = py::call_guard<py::gil_scoped_release>;
  bind_height_grid(module);
  bind_planner_surface(module);
  bind_terrain(module);
  module.def(
      "export_sl1m", &export_sl1m, py::arg("surfaces"), py::arg("file"), py::arg("force") = false, Guard(),
      R"(Writes the pieces of a list of PlannerSurface as SL1M and its kin take them: docs/formats.md, section 7.

As all of these: throws Error(usage) for a file that exists unless `force`, Error(data) if there is nothing to write,
Error(output).)");
  module.def("export_hpp", &export_hpp, py::arg("surfaces"), py::arg("folder"), py::arg("force") = false,
             Guard(), "A folder of binary STL, one for each piece, for hpp-affordance; returns how many.");
  module.def("ihmc_regions", &ihmc_regions, py::arg("surface"),
             "List of IhmcRegion: one for each polygon of a PlannerSurface, with those of its pieces that "
             "lie in it.");
  module.def("export_ihmc", &export_ihmc, py::arg("regions"), py::arg("folder"), py::arg("force") = false,
             Guard(), "A folder of IHMC's PlanarRegionFileTools, version 2.");
  module.def("read_ihmc", &read_ihmc, py::arg("folder"), Guard(),
             "List of IhmcRegion of such a folder, version 1 or 2. Throws Error(data).");
}

}  // namespace octosurf::python
