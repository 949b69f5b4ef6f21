#pragma once

#include <pybind11/pybind11.h>

namespace octosurf::python {

// Each adds to the module what its file is called after. What another one names in a signature comes first,
// so that docstrings have Python's names: module.cpp has the order.
void bind_error(pybind11::module_& module);
void bind_parameters(pybind11::module_& module);
void bind_occupancy(pybind11::module_& module);
void bind_surfaces(pybind11::module_& module);
void bind_snapshot(pybind11::module_& module);
void bind_scans(pybind11::module_& module);
void bind_alignment(pybind11::module_& module);
void bind_maps(pybind11::module_& module);
void bind_mapper(pybind11::module_& module);
void bind_diagnosis(pybind11::module_& module);
void bind_queries(pybind11::module_& module);
void bind_stairs(pybind11::module_& module);
void bind_changes(pybind11::module_& module);
void bind_contact(pybind11::module_& module);
void bind_gaps(pybind11::module_& module);
void bind_footsteps(pybind11::module_& module);
void bind_exports(pybind11::module_& module);
void bind_planner_formats(pybind11::module_& module);

}  // namespace octosurf::python
