// octosurf/export.hpp in Python: surfaces in files other programs read, and pictures.
#include "bind.hpp"
#include "casters.hpp"
#include "map_up.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/export.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;
using SurfaceEdges = std::map<SurfaceId, std::vector<PolygonEdges>>;
using SnapshotPtr = std::shared_ptr<Snapshot>;

/// Rows of Map.points(): only "point" and "surface" are read.
std::vector<SurfacePoint> rows_as_points(const py::object& rows) {
  if (rows.is_none()) return {};
  constexpr auto dense = py::array::c_style | py::array::forcecast;
  const py::array_t<double, dense> points(rows["point"]);
  const py::array_t<SurfaceId, dense> surfaces(rows["surface"]);
  std::vector<SurfacePoint> all;
  all.reserve(static_cast<std::size_t>(surfaces.size()));
  for (py::ssize_t i = 0; i < surfaces.size(); ++i)
    all.push_back({surfaces.at(i), {points.at(i, 0), points.at(i, 1), points.at(i, 2)}});
  return all;
}

void export_file(const SnapshotPtr& snapshot, const fs::path& file, std::vector<ExportPart> parts,
                 double mesh_thickness, const std::optional<Eigen::Vector3d>& up, bool force,
                 std::map<SurfaceId, std::vector<ConvexPiece>> convex,
                 std::map<SurfaceId, std::vector<Circle>> circles, const py::object& points,
                 SurfaceEdges edges) {
  ExportExtras extras{
      std::move(convex), std::move(circles), rows_as_points(points), std::move(edges), {}, {}, {}};
  const py::gil_scoped_release others_run;
  ExportOptions options;
  options.parts = std::move(parts);
  options.mesh_thickness = mesh_thickness;
  options.up = up_in(snapshot, up);
  options.force = force;
  export_surfaces(*snapshot, file, options, extras);
}

void picture(const SnapshotPtr& snapshot, const fs::path& file, int width, int height, ViewFrom from,
             const std::optional<Eigen::Vector3d>& up, std::optional<Eigen::Vector3d> eye,
             std::optional<Eigen::Vector3d> target, bool cut, SurfaceEdges edges, bool force) {
  PictureOptions options;
  options.width = width;
  options.height = height;
  options.from = from;
  options.up = up_in(snapshot, up);
  options.eye = eye;
  options.target = target;
  options.cut = cut;
  options.edges = std::move(edges);
  options.force = force;
  const py::gil_scoped_release others_run;
  render_png(*snapshot, file, options);
}

}  // namespace

void bind_exports(py::module_& module) {
  module.def(
      "export_surfaces", &export_file, py::arg("snapshot"), py::arg("file"), py::kw_only(),
      py::arg("parts") = std::vector<ExportPart>{ExportPart::polygons}, py::arg("mesh_thickness") = 0.02,
      py::arg("up") = py::none(), py::arg("force") = false,
      py::arg("convex") = std::map<SurfaceId, std::vector<ConvexPiece>>{},
      py::arg("circles") = std::map<SurfaceId, std::vector<Circle>>{}, py::arg("points") = py::none(),
      py::arg("edges") = SurfaceEdges{},
      R"(Writes the surfaces in the format the file's ending names: .json, .ply, .glb, .obj, .stl, .csv.

parts: "polygons", "meshes", "convex", "circles", "points"; .json takes any number, others exactly one.
convex, circles: by surface id, for those parts. points: an array as Map.points() gives it, likewise.
edges: label_edges() by surface id, go into .json. mesh_thickness: m. up: (3,), map frame; None: snapshot.up(). force: write over a file that exists.
Map frame, m. The file is complete or not there. Throws Error(usage, data, output).)");
  module.def("render_png", &picture, py::arg("snapshot"), py::arg("file"), py::kw_only(),
             py::arg("width") = 1280, py::arg("height") = 960, py::arg("view") = ViewFrom::iso,
             py::arg("up") = py::none(), py::arg("eye") = py::none(), py::arg("target") = py::none(),
             py::arg("cut") = true, py::arg("edges") = SurfaceEdges{}, py::arg("force") = false,
             R"(Renders the surfaces' polygons as a PNG of so many pixels.

view: "iso", "top", "front", "back", "left", "right"; or eye and target, (3,), map frame, m.
up: (3,), map frame; None: snapshot.up(). cut: leave out surfaces seen from behind. edges: drawn in their kind's colour. Throws Error(usage, data, output).)");
}

}  // namespace octosurf::python
