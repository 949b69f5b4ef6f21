// octosurf/boundary.hpp, diagnosis.hpp and explain.hpp in Python: what edges are, what looks wrong, and why
// not.
#include "bind.hpp"
#include "map_holder.hpp"
#include "values.hpp"

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
  Value<E>(module, "PolygonEdges",
           R"(Labels of a Polygon's edges; edge k of a ring runs from vertex k to k + 1.

"real": the surface ends; "occluded"; "sensor_limit"; "frontier": nobody has looked.)")
      .field("outer", &E::outer, "List of labels.")
      .field("holes", &E::holes, "List of lists of labels.")
      .def(py::init([](std::vector<EdgeKind> outer, std::vector<std::vector<EdgeKind>> holes) {
             return E{std::move(outer), std::move(holes)};
           }),
           py::arg("outer"), py::arg("holes"), "Labels by ring.");
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
  Value<D>(module, "DoubleLayer", "Two surfaces where the world most likely has one.")
      .field("first", &D::first, "Id.")
      .field("second", &D::second, "Id.")
      .field("overlap_m2", &D::overlap_m2, "m2, of their polygons where they are near each other.")
      .field("distance_m", &D::distance_m, "m, mean over the overlap.")
      .field("angle_rad", &D::angle_rad, "rad, between the planes.");
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

/// The other way round than reason_name().
Reason reason_of(const std::string& name) {
  for (const ReasonText& text : reason_texts)
    if (text.name == name) return text.reason;
  throw Error(Error::Kind::data, "'" + name + "'", "is no reason");
}

std::map<std::string, std::size_t> around_of(const Explanation& explanation) {
  std::map<std::string, std::size_t> counts;
  for (const auto& [reason, count] : explanation.around) counts[std::string(reason_name(reason))] = count;
  return counts;
}

void bind_explain(py::module_& module) {
  using E = Explanation;
  Value<Figure>(module, "Figure", "A number behind an explanation, and the bound it was held against.")
      .field("name", &Figure::name, R"(Such as "width".)")
      .field("value", &Figure::value, "In `unit`.")
      .field("unit", &Figure::unit, "Empty for counts and shares.")
      .field("at_least", &Figure::at_least, "Lower bound, or None.");
  Value<E>(module, "Explanation", "Why there is no surface at a place, or that there is one.")
      .field<std::string>(
          "reason", [](const E& self) { return reason_name(self.reason); },
          [](E& self, const std::string& name) { self.reason = reason_of(name); },
          R"(Such as "on_surface", "too_narrow".)")
      .field("sentence", &E::sentence, "Plain English, one line.")
      .field("asked", &E::asked, "(3,) float64, map frame, m; a view.")
      .field("looked_at", &E::looked_at, "(3,) float64, the nearest point within h, a copy; or None.")
      .field("surface", &E::surface, "Id of the surface the reason is about; 0: none.")
      .field("cylinder", &E::cylinder, "Id of the cylinder that the point supports; 0: none.")
      .field("nearest", &E::nearest, "Id of the surface with the nearest inlier; 0: no surfaces.")
      .field("nearest_distance", &E::nearest_distance, "m, to that inlier.")
      .field("figures", &E::figures, "List of Figure.")
      .field<std::map<std::string, std::size_t>>(
          "around", &around_of,
          [](E& self, const std::map<std::string, std::size_t>& counts) {
            for (const auto& [name, count] : counts) self.around[reason_of(name)] = count;
          },
          "dict of counts by reason, of the pending points within h.");
  module.def(
      "explain",
      [](const MapHolder& map, const Eigen::Vector3d& point) {
        return map.read([&point](const Map& whole) { return explain(whole, point, papers_detector()); });
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
