// The module octosurf._octosurf; what the package octosurf hands on.
#include "bind.hpp"

PYBIND11_MODULE(_octosurf, extension) {
  namespace python = octosurf::python;
  python::Module module(extension);
  module.attr("__version__") = OCTOSURF_VERSION;
  for (const auto bind : {python::bind_error, python::bind_parameters, python::bind_occupancy,
                          python::bind_surfaces, python::bind_scans, python::bind_maps, python::bind_mapper,
                          python::bind_queries, python::bind_changes, python::bind_contact,
                          python::bind_footsteps, python::bind_ground, python::bind_exports})
    bind(module);
}
