// octosurf/map.hpp and up.hpp in Python: maps, and how they are saved and loaded.
#include "arrays.hpp"
#include "bind.hpp"
#include "map_holder.hpp"
#include "values.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/map.hpp>
#include <octosurf/up.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;

/// A row of Map.points().
struct PointRow {
  std::array<double, 3> point, view;
  float log_odds;
  SurfaceId surface;
};

std::array<double, 3> numbers_of(const std::optional<Eigen::Vector3d>& vector) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  if (!vector) return {none, none, none};
  return {vector->x(), vector->y(), vector->z()};
}

py::array_t<PointRow> points_of(const MapHolder& map) {
  return moved_array(map.read([](const Map& whole) {
    std::vector<PointRow> rows;
    whole.for_each_point([&rows](const Map::Voxel& voxel) {
      rows.push_back({numbers_of(voxel.point), numbers_of(voxel.view), voxel.log_odds, voxel.surface});
    });
    return rows;
  }));
}

/// Problems that did not prevent loading become Python warnings.
MapPtr load(const fs::path& stem) {
  LoadedMap loaded = [&stem] {
    const py::gil_scoped_release others_run;
    return load_map(stem);
  }();
  if (!loaded.warning.empty() && PyErr_WarnEx(PyExc_UserWarning, loaded.warning.c_str(), 1) != 0)
    throw py::error_already_set();
  return std::make_shared<MapHolder>(std::move(loaded.map));
}

MapPtr from_octomap(const fs::path& file, Parameters parameters) {
  const py::gil_scoped_release others_run;
  return std::make_shared<MapHolder>(map_from_octomap(file, std::move(parameters)));
}

MapPtr from_leaves(const py::array_t<OccupancyView::Leaf, py::array::c_style>& leaves,
                   const Parameters& parameters) {
  const std::span<const OccupancyView::Leaf> all(leaves.data(), static_cast<std::size_t>(leaves.size()));
  return std::make_shared<MapHolder>(map_from_leaves(all, parameters));
}

void bind_voxel_and_size(py::module_& module) {
  using Voxel = Map::Voxel;
  Value<Voxel>(module, "MapVoxel", "A voxel of a Map with what it keeps of the scans.")
      .field("occupancy", &Voxel::occupancy, R"("unknown", "free" or "occupied".)")
      .field("log_odds", &Voxel::log_odds, "Of being occupied.")
      .field("surface", &Voxel::surface, "Id; 0: pending, or not occupied.")
      .field("point", &Voxel::point, "(3,) float64, map frame, m: its representative point, a copy; or None.")
      .field("view", &Voxel::view, "(3,) float64, unit, toward where it was seen from, a copy; or None.");
  using Size = Map::Size;
  Value<Size>(module, "MapSize", "What is in a Map.")
      .field("nodes", &Size::nodes, "Of the octree.")
      .field("leaves", &Size::leaves, "Of the octree.")
      .field("bytes", &Size::bytes, "Of the octree.")
      .field("points", &Size::points, "Occupied voxels that have a point.")
      .field("pending", &Size::pending, "Points that no surface has.")
      .field("surfaces", &Size::surfaces, "Number of them.")
      .field("inliers", &Size::inliers, "Points that surfaces have.")
      .field("scans", &Size::scans, "Inserted.")
      .field("revision", &Size::revision, "Of the map.");
}

void bind_up(py::module_& module) {
  Value<Up>(module, "Up", "Which way is up in a map, and how that is known.")
      .field("direction", &Up::direction, "(3,) float64, unit, map frame; a view.")
      .field("source", &Up::source,
             R"("given" (Parameters.up), "surfaces" (an estimate) or "assumed" (+z, there is no surface).)")
      .field("level_m2", &Up::level_m2, "m2, of an estimate: area of the surfaces level to it.")
      .field(
          "rival", &Up::rival,
          "Of an estimate: the score of the best other direction over this one's; at 1 give the direction.");
  module.def(
      "up_of", [](const MapHolder& map) { return map.read([](const Map& whole) { return up_of(whole); }); },
      py::arg("map"),
      "The Up that the map's parameters give or, where they leave it open, that its surfaces tell.");
}

}  // namespace

void bind_maps(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PointRow, point, view, log_odds, surface);
  bind_voxel_and_size(module);
  py::class_<MapHolder, MapPtr>(module, "Map",
                                R"(The persistent thing: octree, surfaces, pending points, parameters.

Given to a Mapper it goes on being readable; what one thread asks of it then waits for the scan that another one
inserts, but for snapshot(), which never waits.)")
      .def(py::init([](const std::optional<Parameters>& parameters, const py::kwargs& given) {
             return std::make_shared<MapHolder>(Map(parameters_of(parameters, given)));
           }),
           py::arg("parameters") = py::none(),
           "An empty map, Map(resolution=0.02); what is given by name wins over `parameters`. Throws "
           "Error(usage) for what is out of range.")
      .def(
          "holds",
          [](const MapHolder& map, const Scan& scan) {
            return map.read([&scan](const Map& whole) { return whole.holds(scan); });
          },
          py::arg("scan"),
          R"(Whether a Mapper has put this Scan into it after Mapper.remember_scans(), also before the map was saved.

Compares its pose as it was given, its number of points and up to 4096 of them.)")
      .def("__repr__",
           [](const MapHolder& map) {
             const Map::Size size = map.read([](const Map& whole) { return whole.size(); });
             return "<Map: " + std::to_string(size.scans) + " scans, " + std::to_string(size.points) +
                    " points, " + std::to_string(size.surfaces) + " surfaces>";
           })
      .def(
          "parameters",
          [](const MapHolder& map) { return map.read([](const Map& whole) { return whole.parameters(); }); },
          "A copy of its Parameters.")
      .def_property_readonly(
          "origin",
          [](const MapHolder& map) { return map.read([](const Map& whole) { return whole.origin(); }); },
          "Where its 0 lies in the frame of the scans' poses, (3), m.")
      .def("snapshot", &MapHolder::snapshot, "Snapshot of the last whole scan; shared, nothing is copied.")
      .def(
          "at",
          [](const MapHolder& map, const Eigen::Vector3d& point) {
            return map.read([&point](const Map& whole) { return whole.at(point); });
          },
          py::arg("point"), "The MapVoxel that holds `point`, (3,), map frame.")
      .def(
          "octree",
          [](const MapHolder& map) { return map.read([](const Map& whole) { return whole.octree(); }); },
          "OccupancyView as it is now.")
      .def("points", &points_of,
           R"(The points of all occupied voxels, in key order; a structured array of its own.

Columns: "point" (3 float64, map frame, m), "view" (3 float64, unit, toward where it was seen from; NaN: not known),
"log_odds" (float32), "surface" (uint32; 0: pending).)")
      .def(
          "size",
          [](const MapHolder& map) { return map.read([](const Map& whole) { return whole.size(); }); },
          "MapSize.")
      .def(
          "check_invariants",
          [](const MapHolder& map) {
            return map.read([](const Map& whole) { return check_invariants(whole); });
          },
          "A line for each violation; none if all is well. One pass over octree and surfaces.");
  bind_up(module);

  module.def("load", &load, py::arg("stem"),
             R"(The Map of `stem`.surfaces, such as octosurf.load("maps/office").

Throws Error(data) for damaged or foreign files; warns (UserWarning) where, say, the .bt beside it does not match.)");
  module.def(
      "save",
      [](const MapHolder& map, const fs::path& stem) {
        map.read([&stem](const Map& whole) { save_map(whole, stem); });
      },
      py::arg("map"), py::arg("stem"),
      R"(Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap) over what is there.

Whenever that fails, the files of before or the new ones are there. A folder of scans (`octosurf map --keep-scans`) that
the map had is not told in them: it has not got what Python inserted. Throws Error(output), Error(incomplete).)");
  module.def("read_octomap_resolution", &read_octomap_resolution, py::arg("file"),
             "Resolution of an OctoMap file (.bt, .ot), m. Throws Error(data).");
  module.def(
      "map_from_octomap", &from_octomap, py::arg("file"), py::arg("parameters") = Parameters{},
      R"(Map of the octree of an OctoMap file (.bt, .ot), as yet without points: see Mapper.detect_in_occupancy().

The file's resolution replaces the parameters'. Throws Error(data, usage).)");
  module.def("map_from_leaves", &from_leaves, py::arg("leaves"), py::arg("parameters") = Parameters{},
             "The same from leaves as OccupancyView.leaves() gives them, on the grid of the parameters' "
             "resolution.");
}

}  // namespace octosurf::python
