// octosurf/surface.hpp and cylinder.hpp in Python: one surface, one cylinder.
#include "arrays.hpp"
#include "bind.hpp"
#include "casters.hpp"

#include <memory>
#include <string>
#include <vector>

#include <octosurf/planning.hpp>
#include <octosurf/surface.hpp>
#include <octosurf/up.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// Its holes, each a view; the object `polygon` is a Polygon.
std::vector<py::array_t<double>> holes_of(const py::object& polygon) {
  std::vector<py::array_t<double>> holes;
  for (const Ring2& ring : polygon.cast<const Polygon&>().holes) holes.push_back(rows_view(ring, polygon));
  return holes;
}

void bind_plain_parts(py::module_& module) {
  py::class_<Plane>(module, "Plane",
                    "normal . x = offset, the normal toward the side it was seen from; map frame, m.")
      .def(py::init([](const Eigen::Vector3d& normal, double offset) {
             return Plane{normal, offset};
           }),
           py::arg("normal"), py::arg("offset"), "A plane of a unit normal, (3,).")
      .def_readonly("normal", &Plane::normal, "(3,) float64, unit; a read-only view.")
      .def_readonly("offset", &Plane::offset, "m.")
      .def("signed_distance", &Plane::signed_distance, py::arg("point"), "Of a point, (3,), m.");

  py::class_<Polygon>(module, "Polygon", R"(In a surface's frame, m; rings are simple and not closed.

The last vertex of a ring differs from its first.)")
      .def_property_readonly(
          "outer", [](const py::object& self) { return rows_view(self.cast<const Polygon&>().outer, self); },
          "(N, 2) float64, counter-clockwise seen from the normal's tip; a read-only view.")
      .def_property_readonly("holes", &holes_of, "List of (M, 2) float64, clockwise; read-only views.");

  using Triangles = py::array_t<std::uint32_t>;
  py::class_<Mesh>(module, "Mesh", "Closed triangle mesh, map frame, m; counter-clockwise seen from outside.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) { return rows_view(self.cast<const Mesh&>().vertices, self); },
          "(N, 3) float64; a read-only view.")
      .def_property_readonly(
          "triangles",
          [](const Mesh& self) {
            return Triangles({static_cast<py::ssize_t>(self.triangles.size()), py::ssize_t{3}},
                             self.triangles.empty() ? nullptr : self.triangles.front().data());
          },
          "(M, 3) uint32, rows of `vertices`; a copy.");

  py::class_<ConvexPiece>(module, "ConvexPiece", "A convex part of a surface.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) { return rows_view(self.cast<const ConvexPiece&>().vertices, self); },
          "(N, 3) float64, map frame, m, counter-clockwise seen from the normal's tip; a read-only view.")
      .def_readonly(
          "A", &ConvexPiece::A,
          "(N, 2) float64: the piece is A (u, v) <= b in the surface's frame, rows of unit length; a view.")
      .def_readonly("b", &ConvexPiece::b, "(N,) float64, m; a view.");

  py::class_<Circle>(module, "Circle", "A disc on a surface.")
      .def_readonly("center", &Circle::center, "(3,) float64, map frame, m, on the plane; a view.")
      .def_readonly("radius", &Circle::radius, "m.");
}

void bind_cylinder(py::module_& module) {
  py::class_<Cylinder, std::shared_ptr<Cylinder>>(
      module, "Cylinder",
      "A pillar, rail or rung: the part of its mantle that was seen. Map frame, m. Immutable.")
      .def_readonly("id", &Cylinder::id, "Never reused; numbered apart from surfaces.")
      .def_readonly("axis_point", &Cylinder::axis_point, "(3,) float64, on the axis, in the middle; a view.")
      .def_readonly("axis", &Cylinder::axis, "(3,) float64, unit; a view.")
      .def_readonly("radius_m", &Cylinder::radius_m, "m.")
      .def_readonly("length_m", &Cylinder::length_m, "m along the axis, from axis_point half to either side.")
      .def_readonly(
          "start", &Cylinder::start,
          "(3,) float64, unit, square to the axis: what was seen lies within `span_rad` from here; a view.")
      .def_readonly("span_rad", &Cylinder::span_rad, "rad, counter-clockwise seen from the axis' tip.")
      .def_readonly("inliers", &Cylinder::inliers, "Voxels.")
      .def_readonly("rms_m", &Cylinder::rms_m, "m, of the inliers' distances to the mantle.")
      .def_readonly("born", &Cylinder::born, "Map revision in which it appeared.")
      .def_readonly("revision", &Cylinder::revision, "Map revision of the last change.");
}

std::string described(const Surface& surface) {
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
  py::class_<Surface, std::shared_ptr<Surface>>(
      module, "Surface",
      R"(One contact surface as a planner sees it. Immutable; lives as long as anything of it is held.)")
      .def_readonly("id", &Surface::id, "1 to 2**24 - 1, never reused.")
      .def_readonly("resolution", &Surface::resolution, "d of the map, m.")
      .def_readonly("color", &Surface::color, "(r, g, b) in [0, 1], distinct by construction.")
      .def_readonly("plane", &Surface::plane, "Plane, map frame.")
      .def_readonly(
          "T_map_surface", &Surface::T_map_surface,
          "(4, 4) float64, surface frame to map frame: z is the normal, the origin on the plane; a copy.")
      .def_readonly("polygons", &Surface::polygons,
                    "List of Polygon: alpha shape of the inliers, in the surface's frame (u, v), m.")
      .def_property_readonly(
          "boundary",
          [](const py::object& self) { return rows_view(self.cast<const Surface&>().boundary, self); },
          "(N, 3) float64, map frame, m: the rings' vertices, neighbours at most h apart; a read-only view.")
      .def_readonly("area_m2", &Surface::area_m2, "m2, of `polygons`.")
      .def_readonly("inliers", &Surface::inliers, "Voxels.")
      .def_readonly("rms_m", &Surface::rms_m, "m, of the inliers' distances to the plane.")
      .def_readonly(
          "covariance", &Surface::covariance,
          R"((3, 3) float64, a read-only view: how sure the plane is, in the surface's frame at its origin.

The true plane is off = c + a u + b v there; this is the covariance of (a [rad], b [rad], c [m]). It does not know the
poses' errors, nor what readings have in common.)")
      .def_readonly("born", &Surface::born, "Map revision in which it appeared; 0: before maps noted that.")
      .def_readonly("revision", &Surface::revision, "Map revision of the last change.")
      .def_readonly("parents", &Surface::parents, "Ids merged into this one, or the one it was split from.")
      .def("normal_std_rad", &Surface::normal_std_rad, "Of the normal's tilt where it is least sure, rad.")
      .def("offset_std_m", &Surface::offset_std_m, "Of the plane's height at the frame's origin, m.")
      .def("to_map", &Surface::to_map, py::arg("uv"),
           "(3,) float64, map frame, of a point (u, v) of its own, m.")
      .def(
          "slope_rad", [](const Surface& self, const Eigen::Vector3d& up) { return slope_rad(self, up); },
          py::arg("up") = Eigen::Vector3d(0, 0, 1),
          "Angle between normal and up, rad: 0 a floor, pi/2 a wall.")
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
      .def("circles", &circles, py::arg("min_radius"), py::call_guard<py::gil_scoped_release>(),
           "Overlapping circles of at least `min_radius` m that fill the simplified polygons, largest first.")
      .def("__repr__", &described);
}

}  // namespace octosurf::python
