// octosurf/parameters.hpp in Python.
#include "bind.hpp"
#include "fields.hpp"

#include <string>
#include <vector>

#include <octosurf/parameters.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

Settings<OccupancyParameters> bind_occupancy_parameters(py::module_& module) {
  using P = OccupancyParameters;
  return Settings<P>(module, "OccupancyParameters", "The octree and what a scan does to it.")
      .field("resolution", &P::resolution, "d, m: voxel edge; also of downsampling and change detection.")
      .field("max_range", &P::max_range,
             "m: beyond it points only free space; None: 4 for depth cameras, unlimited for lidar.")
      .field("min_range", &P::min_range, "m: nearer points are dropped.")
      .field("hit", &P::hit, "P(occupied | endpoint).")
      .field("miss", &P::miss, "P(occupied | ray passed through).")
      .field("clamp_min", &P::clamp_min, "Probability, lower clamp.")
      .field("clamp_max", &P::clamp_max, "Probability, upper clamp.")
      .field("occupied", &P::occupied, "Probability from which a voxel counts as occupied.")
      .field("preserve_surfaces", &P::preserve_surfaces,
             "A ray erodes a surface's voxel only if it crosses its plane beyond s; off: the tree equals "
             "OctoMap's.");
}

Settings<SurfaceParameters> bind_surface_parameters(py::module_& module) {
  using P = SurfaceParameters;
  return Settings<P>(module, "SurfaceParameters", "What belongs to a surface and what is derived from it.")
      .field("surface_tolerance", &P::surface_tolerance, "s, m: reach of a plane; None: derived.")
      .field("sensor_noise", &P::sensor_noise, "m: standard deviation near the sensor.")
      .field("range_noise", &P::range_noise,
             "1/m: sigma(z) = sensor_noise + range_noise z^2; None: estimated from the scans.")
      .field("max_hole_size", &P::max_hole_size,
             "h, m: alpha of the alpha shape, largest gap within a surface; None: derived.")
      .field("min_surface_width", &P::min_surface_width, "m: narrower clusters stay pending; 0: any.")
      .field("mesh_thickness", &P::mesh_thickness, "m: extrusion against the normal.");
}

Settings<DetectionParameters> bind_detection_parameters(py::module_& module) {
  using P = DetectionParameters;
  return Settings<P>(module, "DetectionParameters", "New surfaces and cylinders among pending points.")
      .field("detector", &P::detector, "How surfaces are found: likelihood, or paper (Parameters.paper()).")
      .field("search_radius", &P::search_radius,
             "r, m: the paper's detector: of outliers and normals; cylinders: largest neighbourhood; None: "
             "derived.")
      .field("normal_radius", &P::normal_radius,
             "m: cylinders: neighbourhood for normals where points are dense and exact; None: derived.")
      .field("min_surface_points", &P::min_surface_points, "n; None: derived.")
      .field("smoothness_angle", &P::smoothness_angle,
             "rad: region growing, normal difference: the paper's detector only.")
      .field("max_curvature", &P::max_curvature, "Region growing, surface variation: likewise.")
      .field("ransac_iterations", &P::ransac_iterations, "RANSAC of the paper's detector, and of cylinders.")
      .field(
          "detection_budget", &P::detection_budget,
          "Pending readings in which a scan looks for surfaces at most, or a quarter of those that wait, if "
          "that is more; Mapper.drain() looks at the rest. 0: no limit.")
      .field("detect_cylinders", &P::detect_cylinders,
             "Look for pillars, rails and rungs among what no plane took.");
}

}  // namespace

void bind_parameters(py::module_& module) {
  using P = Parameters;
  Settings<AlignmentParameters>(module, "AlignmentParameters",
                                "A scan's pose against the map, before it is inserted.")
      .field("enabled", &AlignmentParameters::enabled,
             "A pose is corrected where scan and map say significantly so; off: taken as given.");
  const Settings<OccupancyParameters> occupancy = bind_occupancy_parameters(module);
  const Settings<SurfaceParameters> surfaces = bind_surface_parameters(module);
  const Settings<DetectionParameters> detection = bind_detection_parameters(module);

  Settings<P> parameters(
      module, "Parameters",
      R"(Everything that decides what comes out; equal Parameters and scans give equal maps.

SI units, angles in radians. A field that is None is derived from the others; an explicit value wins. The constructor takes
the fields of its settings by their own names, too, and `align` for alignment.enabled: Parameters(resolution=0.01, up=None) is
Parameters(occupancy={"resolution": 0.01}, up=None). Fields can be set afterwards, too.)");
  parameters.field("alignment", &P::alignment, "AlignmentParameters.")
      .keyword("align", "alignment", "enabled")
      .group("occupancy", &P::occupancy, occupancy, "OccupancyParameters.")
      .group("surfaces", &P::surfaces, surfaces, "SurfaceParameters.")
      .group("detection", &P::detection, detection, "DetectionParameters.")
      .field("up", &P::up,
             "(3,) float64, unit vector in the map frame against gravity, a copy; None: found from the "
             "surfaces.");
  parameters.def_static("paper", &P::paper,
                        "The paper's detector and values (section V). The detector takes PCL, which the "
                        "wheel has where pip built "
                        "it with --config-settings pcl=on: without, set detection.detector to 'likelihood' "
                        "to map with the values.");
  parameters.def("validate", &P::validate, "Throws Error(usage) naming field, value and rule.");
  parameters.def("surface_tolerance", &P::surface_tolerance, "s in force, m.");
  parameters.def("max_hole_size", &P::max_hole_size, "h in force, m.");
  parameters.def("search_radius", &P::search_radius, "r in force, m.");
  parameters.def("normal_radius", &P::normal_radius, "In force, m.");
  parameters.def("min_surface_points", &P::min_surface_points, "n in force.");
  parameters.def(
      "get", &get_parameter, py::arg("name"),
      "The value in force as text, as `octosurf map --show-parameters` has it: angles in degrees.");
  parameters.def(
      "set", &set_parameter, py::arg("name"), py::arg("text"),
      R"(Sets from text, as an option of `octosurf map` does: angles in degrees, "auto" for what is derived.
Throws Error(usage) naming name, text and rule.)");
  parameters.def_static(
      "names",
      [] {
        std::vector<std::string> names;
        for (const ParameterInfo& info : parameter_infos()) names.push_back(info.name);
        return names;
      },
      "Of get() and set(); docs/parameters.md says what each does.");
}

}  // namespace octosurf::python
