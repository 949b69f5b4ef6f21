// octosurf/alignment.hpp in Python: localisation of scans by a map's surfaces.
#include "bind.hpp"
#include "values.hpp"

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <octosurf/alignment.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// A Localizer with a lock, for several threads.
class SharedLocalizer {
 public:
  SharedLocalizer(std::shared_ptr<Snapshot> map, const AlignmentReach& reach)
      : map_(map), localizer_(std::move(map), reach) {}

  Alignment localize(const Scan& scan) {
    const py::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return localizer_(scan);
  }

  std::string described() const {
    return "<Localizer in " + std::to_string(map_->surfaces.size()) + " surfaces>";
  }

 private:
  std::mutex busy_;
  std::shared_ptr<const Snapshot> map_;
  Localizer localizer_;
};

void bind_result(py::module_& module) {
  using A = Alignment;
  Value<A>(module, "Alignment", R"(A scan's pose against the surfaces of a map.

Twists are (6,): three rotations (rad), then three translations (m), map axes, about the sensor's position.)")
      .field("outcome", &A::outcome,
             R"("off", "nothing_known", "agrees", "corrected", "recovered", "set_aside" or "unexplained".)")
      .field("T_map_sensor", &A::T_map_sensor, "(4, 4) float64, sensor frame to map frame; a copy.")
      .field("covariance", &A::covariance,
             "(6, 6) float64, of the pose's error as a twist, as far as scan and map tell; a view.")
      .field("directions", &A::directions,
             "(6, 6) float64, orthonormal columns; surfaces fix the first `determined` of them; a view.")
      .field("determined", &A::determined, "Directions that surfaces fix to within half a voxel.")
      .field("lever_m", &A::lever_m, "m: rotations count by it in `directions`.")
      .field("samples", &A::samples, "Of the scan's points that were looked at.")
      .field("known", &A::known, "Of them, near surfaces that the map has.")
      .field("explained", &A::explained, "Of those, on the surface at this pose.")
      .field("disagreement", &A::disagreement,
             "(6,) float64, twist by which given pose and map disagree; a view.")
      .field(
          "innovation_m", &A::innovation_m,
          "m: how far the scan lies from where those before it let expect it; over a voxel: a loop closes.")
      .def("explained_share", &A::explained_share, "In [0, 1].")
      .def("determined_length_m", &A::determined_length_m, py::arg("twist"),
           "m: how long a motion's part along the determined directions is.");
}

}  // namespace

void bind_alignment(py::module_& module) {
  bind_result(module);
  constexpr AlignmentReach reach;
  py::class_<SharedLocalizer>(module, "Localizer",
                              "Finds scans in a finished map; keeps what it builds from scan to scan.")
      .def(py::init([](std::shared_ptr<Snapshot> map, double translation_m, double rotation_rad) {
             const py::gil_scoped_release others_run;
             return std::make_unique<SharedLocalizer>(std::move(map),
                                                      AlignmentReach{translation_m, rotation_rad});
           }),
           py::arg("map"), py::kw_only(), py::arg("translation_m") = reach.translation_m,
           py::arg("rotation_rad") = reach.rotation_rad,
           "map: a Snapshot. Looks so far about a scan's pose: m, rad.")
      .def("__repr__", &SharedLocalizer::described)
      .def("localize", &SharedLocalizer::localize, py::arg("scan"),
           R"(Alignment of a Scan, whose T_map_sensor is a first guess.

Outcome "unexplained": it fits nowhere or at several places alike. Throws Error(data) if the pose is not rigid.)");
  module.def(
      "align",
      [](const std::shared_ptr<Snapshot>& map, const Scan& scan, double translation_m, double rotation_rad) {
        const py::gil_scoped_release others_run;
        return align(map, scan, {translation_m, rotation_rad});
      },
      py::arg("map"), py::arg("scan"), py::kw_only(), py::arg("translation_m") = reach.translation_m,
      py::arg("rotation_rad") = reach.rotation_rad, "Localizer(map, …).localize(scan), for a single scan.");
}

}  // namespace octosurf::python
