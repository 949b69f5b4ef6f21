// octosurf/boundary.hpp, diagnosis.hpp and explain.hpp in Python: what edges are, what looks wrong, and why
// not.
#include "bind.hpp"
#include "casters.hpp"
#include "map_holder.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/diagnosis.hpp>
#include <octosurf/explain.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

void bind_edges(py::module_& module) {
  using E = PolygonEdges;
  py::class_<E>(module, "PolygonEdges",
                R"(Labels of a Polygon's edges; edge k of a ring runs from vertex k to k + 1.

"real": the surface ends; "occluded"; "sensor_limit"; "frontier": nobody has looked.)")
      .def(py::init([](std::vector<EdgeKind> outer, std::vector<std::vector<EdgeKind>> holes) {
             return E{std::move(outer), std::move(holes)};
           }),
           py::arg("outer"), py::arg("holes"), "Labels by ring.")
      .def_readonly("outer", &E::outer, "List of labels.")
      .def_readonly("holes", &E::holes, "List of lists of labels.");
  module.def(
      "label_edges",
      [](const MapHolder& map, const std::shared_ptr<Surface>& surface) {
        return map.read([&surface](const Map& whole) { return label_edges(whole, *surface); });
      },
      py::arg("map"), py::arg("surface"),
      "List of PolygonEdges, one for each polygon of a Surface of the map's present snapshot.");
}

void bind_double_layers(py::module_& module) {
  using D = DoubleLayer;
  py::class_<D>(module, "DoubleLayer", "Two surfaces where the world most likely has one.")
      .def_readonly("first", &D::first, "Id.")
      .def_readonly("second", &D::second, "Id.")
      .def_readonly("overlap_m2", &D::overlap_m2, "m2, of their polygons where they are near each other.")
      .def_readonly("distance_m", &D::distance_m, "m, mean over the overlap.")
      .def_readonly("angle_rad", &D::angle_rad, "rad, between the planes.");
  constexpr DoubleLayerOptions options;
  module.def(
      "double_layers",
      [](const std::shared_ptr<Snapshot>& snapshot, double max_angle_rad, double max_distance_m,
         double min_overlap) {
        const py::gil_scoped_release others_run;
        return double_layers(*snapshot, {max_angle_rad, max_distance_m, min_overlap});
      },
      py::arg("snapshot"), py::kw_only(), py::arg("max_angle_rad") = options.max_angle_rad,
      py::arg("max_distance_m") = options.max_distance_m, py::arg("min_overlap") = options.min_overlap,
      "List of DoubleLayer: pairs that overlap, by that share of the smaller, though nearly parallel and "
      "near.");
}

std::map<std::string, std::size_t> around_of(const Explanation& explanation) {
  std::map<std::string, std::size_t> counts;
  for (const auto& [reason, count] : explanation.around) counts[std::string(reason_name(reason))] = count;
  return counts;
}

void bind_explain(py::module_& module) {
  using E = Explanation;
  py::class_<Figure>(module, "Figure", "A number behind an explanation, and the bound it was held against.")
      .def_readonly("name", &Figure::name, R"(Such as "width".)")
      .def_readonly("value", &Figure::value, "In `unit`.")
      .def_readonly("unit", &Figure::unit, "Empty for counts and shares.")
      .def_readonly("at_least", &Figure::at_least, "Lower bound, or None.");
  py::class_<E>(module, "Explanation", "Why there is no surface at a place, or that there is one.")
      .def_property_readonly(
          "reason", [](const E& self) { return reason_name(self.reason); },
          R"(Such as "on_surface", "too_narrow".)")
      .def_readonly("sentence", &E::sentence, "Plain English, one line.")
      .def_readonly("asked", &E::asked, "(3,) float64, map frame, m; a view.")
      .def_readonly("looked_at", &E::looked_at, "(3,) float64, the nearest point within h, a copy; or None.")
      .def_readonly("surface", &E::surface, "Id of the surface the reason is about; 0: none.")
      .def_readonly("cylinder", &E::cylinder, "Id of the cylinder that the point supports; 0: none.")
      .def_readonly("nearest", &E::nearest, "Id of the surface with the nearest inlier; 0: no surfaces.")
      .def_readonly("nearest_distance", &E::nearest_distance, "m, to that inlier.")
      .def_readonly("figures", &E::figures, "List of Figure.")
      .def_property_readonly("around", &around_of,
                             "dict of counts by reason, of the pending points within h.");
  module.def(
      "explain",
      [](const MapHolder& map, const Eigen::Vector3d& point) {
        return map.read([&point](const Map& whole) { return explain(whole, point); });
      },
      py::arg("map"), py::arg("point"),
      "Explanation: why is there no surface at `point`, (3,), map frame, m? Throws Error(usage) if it is not "
      "finite.");
}

}  // namespace

void bind_diagnosis(py::module_& module) {
  bind_edges(module);
  bind_double_layers(module);
  bind_explain(module);
}

}  // namespace octosurf::python
