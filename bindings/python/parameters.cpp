// octosurf/parameters.hpp in Python.
#include "bind.hpp"

#include <octosurf/parameters.hpp>

namespace octosurf::python {
namespace {

constexpr const char* parameters_doc =
    R"(Everything that decides what comes out; equal Parameters and scans give equal maps.

SI units, angles in radians. A field that is None is derived from the others; an explicit value wins. The constructor takes
the fields of its settings by their own names, too: Parameters(resolution=0.01, up=None) is
Parameters(occupancy={"resolution": 0.01}, up=None). Fields can be set afterwards, too.)";

constexpr const char* paper_doc =
    R"(The paper's detector and values (section V), which follow d and the noise. The detector takes PCL, see
pyproject.toml; without, set detection.detector to 'likelihood' to map with the values.)";

std::vector<std::string> parameter_names() {
  std::vector<std::string> names;
  for (const ParameterInfo& info : parameter_infos()) names.push_back(info.name);
  return names;
}

}  // namespace

void bind_parameters(Module& module) {
  Settings<OccupancyParameters> occupancy(module, "OccupancyParameters");
  occupancy.fields(OCTOSURF_FIELDS(OccupancyParameters, resolution, max_range, min_range, hit, miss,
                                   clamp_min, clamp_max, occupied, preserve_surfaces));
  Settings<SurfaceParameters> surfaces(module, "SurfaceParameters");
  surfaces.fields(OCTOSURF_FIELDS(SurfaceParameters, surface_tolerance, sensor_noise, range_noise,
                                  max_hole_size, min_surface_width));
  Settings<DetectionParameters> detection(module, "DetectionParameters");
  detection.fields(OCTOSURF_FIELDS(DetectionParameters, detector, search_radius, min_surface_points,
                                   detection_budget, detect_cylinders));

  using P = Parameters;
  Settings<P>(module, "Parameters", parameters_doc)
      .fields(OCTOSURF_FIELDS(P, align))
      .group("occupancy", &P::occupancy, occupancy)
      .group("surfaces", &P::surfaces, surfaces)
      .group("detection", &P::detection, detection)
      .fields(OCTOSURF_FIELDS(P, up))
      .def_static("paper", &P::paper, "resolution"_a = 0.02, "sensor_noise"_a = 0.005, paper_doc)
      .def("validate", &P::validate)
      .def("surface_tolerance", &P::surface_tolerance)
      .def("max_hole_size", &P::max_hole_size)
      .def("search_radius", &P::search_radius)
      .def("min_surface_points", &P::min_surface_points)
      .def("get", &get_parameter, "name"_a,
           "The value in force as text, as a config file has it: angles in degrees.")
      .def(
          "set", &set_parameter, "name"_a, "text"_a,
          R"(Sets from text, as an option of `octosurf map` does: angles in degrees, "auto" for what is derived.
Throws Error(usage) naming name, text and rule.)")
      .def_static("names", &parameter_names, "Of get() and set(); docs/parameters.md says what each does.");
}

}  // namespace octosurf::python
