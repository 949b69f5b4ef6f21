// octosurf::Error as octosurf.Error.
#include "bind.hpp"
#include "casters.hpp"

#include <exception>
#include <string>

namespace octosurf::python {
namespace {

constexpr const char* doc =
    R"(What failed, where, and how to mend it; str() is one line "where: what; mend".

kind: "usage" (the caller asked for something that makes no sense), "data" (a file, an image, a cloud or a pose is
missing, damaged or foreign), "output" (a result could not be written) or "incomplete" (a scan that failed is
not taken back yet, for want of memory: the Mapper's next call does that).
where: a file, a parameter or a scan.
mend: what to do about it; may be empty.

When memory runs out, MemoryError is raised instead.)";

PyObject* error_type = nullptr;

/// Names of files may hold any bytes; as os.fsdecode() does it.
pybind11::str text(const std::string& bytes) {
  PyObject* const decoded =
      PyUnicode_DecodeFSDefaultAndSize(bytes.data(), static_cast<Py_ssize_t>(bytes.size()));
  if (decoded == nullptr) throw pybind11::error_already_set();
  return pybind11::reinterpret_steal<pybind11::str>(decoded);
}

void raise(const Error& error) {
  namespace py = pybind11;
  const py::object raised = py::handle(error_type)(text(error.what()));
  raised.attr("kind") = py::cast(error.kind());
  raised.attr("where") = text(error.where());
  raised.attr("mend") = text(error.mend());
  PyErr_SetObject(error_type, raised.ptr());
}

}  // namespace

void bind_error(pybind11::module_& module) {
  error_type = PyErr_NewExceptionWithDoc("octosurf.Error", doc, nullptr, nullptr);
  if (error_type == nullptr) throw pybind11::error_already_set();
  module.add_object("Error", error_type);
  pybind11::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      raise(error);
    }
  });
}

}  // namespace octosurf::python
