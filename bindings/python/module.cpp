// The module octosurf._octosurf; what the package octosurf hands on.
#include "bind.hpp"

PYBIND11_MODULE(_octosurf, extension) {
  namespace python = octosurf::python;
#if PYBIND11_VERSION_HEX < 0x020C0000
  // It knows NumPy 1; in NumPy 2 CopyInto is only at the place of its alias.
  const auto numpy = pybind11::module_::import("numpy.core.multiarray").attr("_ARRAY_API");
  auto& api = pybind11::detail::npy_api::get();
  api.PyArray_CopyInto_ = reinterpret_cast<decltype(api.PyArray_CopyInto_)>(
      static_cast<void**>(PyCapsule_GetPointer(numpy.ptr(), nullptr))[50]);
#endif
  python::Module module(extension);
  module.attr("__version__") = OCTOSURF_VERSION;
  for (const auto bind :
       {python::bind_error, python::bind_parameters, python::bind_occupancy, python::bind_surfaces,
        python::bind_scans, python::bind_maps, python::bind_mapper, python::bind_queries,
        python::bind_changes, python::bind_contact, python::bind_footsteps, python::bind_ground,
        python::bind_exports, python::bind_ros})
    bind(module);
}
