// octosurf/export.hpp, planner_formats.hpp and height_grid.hpp in Python: surfaces in files other programs
// read, and pictures.
#include "map_holder.hpp"

#include <map>
#include <numbers>

#include <octosurf/export.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/up.hpp>

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;

/// Rows of Map.points(): only "point" and "surface" are read.
std::map<SurfaceId, std::vector<Eigen::Vector3d>> rows_as_points(const py::object& rows) {
  std::map<SurfaceId, std::vector<Eigen::Vector3d>> all;
  if (rows.is_none()) return all;
  const Dense<double> points(rows["point"]);
  const Dense<SurfaceId> surfaces(rows["surface"]);
  for (py::ssize_t i = 0; i < surfaces.size(); ++i)
    all[surfaces.at(i)].emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2));
  return all;
}

void export_file(const SnapshotPtr& snapshot, const fs::path& file, std::vector<ExportPart> parts,
                 double mesh_thickness, const std::optional<Eigen::Vector3d>& up, bool force,
                 std::map<SurfaceId, std::vector<ConvexPiece>> convex, const py::object& points) {
  ExportOptions options{std::move(parts),        mesh_thickness, up_in(snapshot, up),
                        Eigen::Vector3d::Zero(), force,          std::move(convex),
                        rows_as_points(points)};
  const py::gil_scoped_release others_run;
  export_surfaces(*snapshot, file, options);
}

void picture(const SnapshotPtr& snapshot, const fs::path& file, int width, int height, ViewFrom from,
             const std::optional<Eigen::Vector3d>& up, bool force) {
  const py::gil_scoped_release others_run;
  render_png(*snapshot, file, {width, height, from, up_in(snapshot, up), {}, force});
}

/// HeightGrid::normal, x, y and z: views.
py::tuple normals_of(const py::object& grid) {
  const auto view = [&grid](const Eigen::MatrixXf& one) {
    return py::cast(one, py::return_value_policy::reference_internal, grid);
  };
  const auto& [x, y, z] = grid.cast<const HeightGrid&>().normal;
  return py::make_tuple(view(x), view(y), view(z));
}

void bind_height_grid(Module& module) {
  using G = HeightGrid;
  Value<G>(module, "HeightGrid")
      .fields(OCTOSURF_FIELDS(G, cell, center, elevation))
      .field("normal", &normals_of,
             "(x, y, z) of the surface's normal there, (rows, columns) float32 each; views.")
      .fields(OCTOSURF_FIELDS(G, surface))
      .def("center_of", &G::center_of, "row"_a, "column"_a);
  module.def(
      "height_grid",
      [](const SnapshotPtr& snapshot, double cell, const std::optional<Eigen::Vector3d>& up,
         double max_slope_rad, std::optional<double> below,
         const std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& within) {
        const Eigen::AlignedBox2d box =
            within ? Eigen::AlignedBox2d(within->first, within->second) : Eigen::AlignedBox2d();
        return height_grid(*snapshot, {cell, upright(up_in(snapshot, up)), max_slope_rad, below, box});
      },
      "snapshot"_a, py::kw_only(), "cell"_a = 0.0, "up"_a = py::none(),
      "max_slope_rad"_a = std::numbers::pi / 6, "below"_a = py::none(), "within"_a = py::none(), Released(),
      R"(HeightGrid: the highest surface at each cell's centre, in the map turned so that `up` is +z.

up: (3,), map frame; None: snapshot.up().
cell: m; 0: the map's resolution. Surfaces steeper than max_slope_rad and what is higher than `below` m are left out.
within: two corners, (2,) each, beyond which there are no cells; None: everything.)");
}

void bind_planner_formats(Module& module) {
  using P = PlannerSurface;
  Value<P>(module, "PlannerSurface")
      .fields(OCTOSURF_FIELDS(P, id, T_world_surface, polygons, insets, pieces))
      .def(
          py::init([](const std::shared_ptr<Surface>& surface, const std::optional<ContactRegion>& region,
                      std::vector<ConvexPiece> pieces, const std::optional<Eigen::Vector3d>& up) {
            P one{surface->id, surface->T_map_surface, surface->polygons, {}, std::move(pieces)};
            if (region) one.insets = region->polygons;
            return turned(std::move(one), upright(up_in(surface, up)));
          }),
          "surface"_a, "region"_a = py::none(), "pieces"_a = std::vector<ConvexPiece>{}, "up"_a = py::none(),
          R"(Of a Surface, its ContactRegion (the insets) and convex_pieces(), in the world: the map with `up` turned to +z.

up: (3,), map frame; None: as Surface.slope_rad() has it.)");
  module.def(
      "planner_surfaces",
      [](const SnapshotPtr& snapshot, const ContactShape& shape, std::optional<double> yaw_rad,
         const ContactLimits& limits, std::size_t pieces, const std::optional<OccupancyView>& octree) {
        return planner_surfaces(*snapshot, {shape, yaw_rad, limits, pieces, upright(limits.up)},
                                octree ? &*octree : nullptr);
      },
      "snapshot"_a, "shape"_a, py::kw_only(), "yaw_rad"_a = py::none(), "limits"_a = ContactLimits{},
      "pieces"_a = 0, "octree"_a = py::none(), Released());
}

}  // namespace

void bind_exports(Module& module) {
  bind_height_grid(module);
  bind_planner_formats(module);
  module.def("export_surfaces", &export_file, "snapshot"_a, "file"_a, py::kw_only(),
             "parts"_a = std::vector<ExportPart>{ExportPart::polygons}, "mesh_thickness"_a = 0.02,
             "up"_a = py::none(), "force"_a = false,
             "convex"_a = std::map<SurfaceId, std::vector<ConvexPiece>>{}, "points"_a = py::none(),
             R"(Writes the surfaces in the format the file's ending names: .json, .ply, .glb.

parts: "polygons", "meshes", "convex", "points"; .json takes any number, others exactly one.
convex: by surface id, for that part. points: an array as Map.points() gives it, likewise.
mesh_thickness: m. up: (3,), map frame; None: snapshot.up(). force: write over a file that exists.
Map frame, m. The file is complete or not there. Throws Error(usage, data, output).)");
  module.def("render_png", &picture, "snapshot"_a, "file"_a, py::kw_only(), "width"_a = 1280,
             "height"_a = 960, "view"_a = ViewFrom::iso, "up"_a = py::none(), "force"_a = false,
             R"(Renders the surfaces' polygons as a PNG of so many pixels.

view: "iso" (obliquely from above) or "top". up: (3,), map frame; None: snapshot.up(). Throws Error(usage, output).)");
}

}  // namespace octosurf::python
