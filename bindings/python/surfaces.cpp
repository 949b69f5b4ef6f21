// octosurf/surface.hpp and cylinder.hpp in Python: one surface, one cylinder.
#include "arrays.hpp"
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/planning.hpp>
#include <octosurf/surface.hpp>
#include <octosurf/up.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

void bind_plain_parts(py::module_& module) {
  Value<Plane>(module, "Plane",
               "normal . x = offset, the normal toward the side it was seen from; map frame, m.")
      .field("normal", &Plane::normal, "(3,) float64, unit; a read-only view.")
      .field("offset", &Plane::offset, "m.")
      .def(py::init([](const Eigen::Vector3d& normal, double offset) {
             return Plane{normal, offset};
           }),
           py::arg("normal"), py::arg("offset"), "A plane of a unit normal, (3,).")
      .def("signed_distance", &Plane::signed_distance, py::arg("point"), "Of a point, (3,), m.");

  Value<Polygon>(module, "Polygon", R"(In a surface's frame, m; rings are simple and not closed.

The last vertex of a ring differs from its first.)")
      .rows("outer", &Polygon::outer,
            "(N, 2) float64, counter-clockwise seen from the normal's tip; a read-only view.")
      .rings("holes", &Polygon::holes, "List of (M, 2) float64, clockwise; read-only views.");

  using Triangles = py::array_t<std::uint32_t>;
  Value<Mesh>(module, "Mesh", "Closed triangle mesh, map frame, m; counter-clockwise seen from outside.")
      .rows("vertices", &Mesh::vertices, "(N, 3) float64; a read-only view.")
      .field<std::vector<std::array<std::uint32_t, 3>>>(
          "triangles",
          [](const Mesh& self) {
            return Triangles({static_cast<py::ssize_t>(self.triangles.size()), py::ssize_t{3}},
                             self.triangles.empty() ? nullptr : self.triangles.front().data());
          },
          [](Mesh& self, std::vector<std::array<std::uint32_t, 3>> triangles) {
            self.triangles = std::move(triangles);
          },
          "(M, 3) uint32, rows of `vertices`; a copy.");

  Value<ConvexPiece>(module, "ConvexPiece", "A convex part of a surface.")
      .rows("vertices", &ConvexPiece::vertices,
            "(N, 3) float64, map frame, m, counter-clockwise seen from the normal's tip; a read-only view.")
      .field(
          "A", &ConvexPiece::A,
          "(N, 2) float64: the piece is A (u, v) <= b in the surface's frame, rows of unit length; a view.")
      .field("b", &ConvexPiece::b, "(N,) float64, m; a view.");

  Value<Circle>(module, "Circle", "A disc on a surface.")
      .field("center", &Circle::center, "(3,) float64, map frame, m, on the plane; a view.")
      .field("radius", &Circle::radius, "m.");
}

void bind_cylinder(py::module_& module) {
  Value<Cylinder, std::shared_ptr<Cylinder>>(
      module, "Cylinder",
      "A pillar, rail or rung: the part of its mantle that was seen. Map frame, m. Immutable.")
      .field("id", &Cylinder::id, "Never reused; numbered apart from surfaces.")
      .field("axis_point", &Cylinder::axis_point, "(3,) float64, on the axis, in the middle; a view.")
      .field("axis", &Cylinder::axis, "(3,) float64, unit; a view.")
      .field("radius_m", &Cylinder::radius_m, "m.")
      .field("length_m", &Cylinder::length_m, "m along the axis, from axis_point half to either side.")
      .field(
          "start", &Cylinder::start,
          "(3,) float64, unit, square to the axis: what was seen lies within `span_rad` from here; a view.")
      .field("span_rad", &Cylinder::span_rad, "rad, counter-clockwise seen from the axis' tip.")
      .field("inliers", &Cylinder::inliers, "Voxels.")
      .field("rms_m", &Cylinder::rms_m, "m, of the inliers' distances to the mantle.")
      .field("born", &Cylinder::born, "Map revision in which it appeared.")
      .field("revision", &Cylinder::revision, "Map revision of the last change.");
}

py::array_t<double> to_map(const Surface& surface,
                           const py::array_t<double, py::array::c_style | py::array::forcecast>& uv) {
  if (uv.ndim() < 1 || uv.shape(uv.ndim() - 1) != 2)
    throw Error(Error::Kind::usage, "uv", "has shape " + std::string(py::str(uv.attr("shape"))),
                "give u, v in the last dimension");
  std::vector<py::ssize_t> shape(uv.shape(), uv.shape() + uv.ndim());
  shape.back() = 3;
  py::array_t<double> points(shape);
  double* to = points.mutable_data();
  for (const double* from = uv.data(); from != uv.data() + uv.size(); from += 2, to += 3)
    Eigen::Vector3d::Map(to) = surface.to_map({from[0], from[1]});
  return points;
}

std::string text_of(const Surface& surface) {
  char text[160];
  const Eigen::Vector3d& n = surface.plane.normal;
  std::snprintf(text, sizeof text, "<Surface %u: %.3f m², normal (%.3f, %.3f, %.3f), offset %.3f m>",
                surface.id, surface.area_m2, n.x(), n.y(), n.z(), surface.plane.offset);
  return text;
}

}  // namespace

void bind_surfaces(py::module_& module) {
  bind_plain_parts(module);
  bind_cylinder(module);
  Value<Surface, std::shared_ptr<Surface>>(
      module, "Surface",
      R"(One contact surface as a planner sees it. Immutable; lives as long as anything of it is held.)")
      .field("id", &Surface::id, "1 to 2**24 - 1, never reused.")
      .field("resolution", &Surface::resolution, "d of the map, m.")
      .field("color", &Surface::color, "(r, g, b) in [0, 1], distinct by construction.")
      .field("plane", &Surface::plane, "Plane, map frame.")
      .field("T_map_surface", &Surface::T_map_surface,
             "(4, 4) float64, surface frame to map frame: z is the normal, the origin on the plane; a copy.")
      .field("polygons", &Surface::polygons,
             "List of Polygon: alpha shape of the inliers, in the surface's frame (u, v), m.")
      .rows(
          "boundary", &Surface::boundary,
          "(N, 3) float64, map frame, m: the rings' vertices, neighbours at most h apart; a read-only view.")
      .field("area_m2", &Surface::area_m2, "m2, of `polygons`.")
      .field("inliers", &Surface::inliers, "Voxels.")
      .field("rms_m", &Surface::rms_m, "m, of the inliers' distances to the plane.")
      .field("covariance", &Surface::covariance,
             R"((3, 3) float64, a read-only view: how sure the plane is, in the surface's frame at its origin.

The true plane is off = c + a u + b v there; this is the covariance of (a [rad], b [rad], c [m]). It does not know the
poses' errors, nor what readings have in common.)")
      .field("born", &Surface::born, "Map revision in which it appeared; 0: before maps noted that.")
      .field("revision", &Surface::revision, "Map revision of the last change.")
      .field("parents", &Surface::parents, "Ids merged into this one, or the one it was split from.")
      .text(&text_of)
      .def("normal_std_rad", &Surface::normal_std_rad, "Of the normal's tilt where it is least sure, rad.")
      .def("offset_std_m", &Surface::offset_std_m, "Of the plane's height at the frame's origin, m.")
      .def("to_map", &to_map, py::arg("uv"),
           "(..., 3) float64, map frame, of points (u, v) of its own, (..., 2), m; a row for each.")
      .def(
          "slope_rad",
          [](const std::shared_ptr<Surface>& self, const std::optional<Eigen::Vector3d>& up) {
            return slope_rad(*self, up_in(self, up));
          },
          py::arg("up") = py::none(),
          R"(Angle between normal and up, rad: 0 a floor, pi/2 a wall.

up: (3,), map frame; None: what the map's parameters give. Throws Error(usage) where they leave it open, and for a surface
out of a pickle: give snapshot.up().)")
      .def("simplified", &simplified, py::call_guard<py::gil_scoped_release>(),
           "The polygons without near-collinear vertices: a list of Polygon whose outlines moved by d/2 at "
           "most.")
      .def("extrude", &extrude, py::arg("thickness"), py::call_guard<py::gil_scoped_release>(),
           "The polygons extruded by `thickness` m against the normal: a closed Mesh, map frame.")
      .def(
          "convex_pieces", [](const Surface& self) { return convex_pieces(self); },
          py::call_guard<py::gil_scoped_release>(),
          "The simplified polygons cut into convex pieces: a list of ConvexPiece that cover them, none "
          "overlapping.")
      .def(
          "circles", &circles, py::arg("min_radius"), py::call_guard<py::gil_scoped_release>(),
          "Overlapping circles of at least `min_radius` m that fill the simplified polygons, largest first.");
}

}  // namespace octosurf::python
