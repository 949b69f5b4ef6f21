// The module octosurf._octosurf; what the package octosurf hands on.
#include "bind.hpp"

PYBIND11_MODULE(_octosurf, module) {
  namespace python = octosurf::python;
  module.attr("__version__") = OCTOSURF_VERSION;
  python::bind_error(module);
  python::bind_parameters(module);
  python::bind_occupancy(module);
  python::bind_surfaces(module);
  python::bind_snapshot(module);
  python::bind_scans(module);
  python::bind_alignment(module);
  python::bind_maps(module);
  python::bind_mapper(module);
  python::bind_diagnosis(module);
  python::bind_queries(module);
  python::bind_stairs(module);
  python::bind_changes(module);
  python::bind_contact(module);
  python::bind_gaps(module);
  python::bind_footsteps(module);
  python::bind_exports(module);
  python::bind_planner_formats(module);
}
