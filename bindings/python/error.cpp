// octosurf::Error as octosurf.Error.
#include "bind.hpp"

#include <exception>
#include <regex>
#include <string_view>

namespace octosurf::python {
namespace {

constexpr const char* error_doc =
    R"(What failed, where, and how to fix it; str() is one line "where: what; hint".

kind: "usage" (the caller asked for something that makes no sense), "data" (a file, an image, a cloud or a pose is
missing, damaged or foreign), "output" (a result could not be written) or "incomplete" (a scan that failed is
not taken back yet, for want of memory: the Mapper's next call does that).
where: a file, a parameter or a scan.
hint: what to do about it; may be empty.

When memory runs out, MemoryError is raised instead.)";

PyObject* error_type = nullptr;

/// File names may contain any bytes; decoded as by os.fsdecode().
py::str text(const std::string& bytes) {
  PyObject* const decoded =
      PyUnicode_DecodeFSDefaultAndSize(bytes.data(), static_cast<Py_ssize_t>(bytes.size()));
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

/// Of the command's options, those whose keyword is not their name with `_`.
constexpr std::pair<const char*, const char*> keywords[] = {{"force", "force=True"},
                                                            {"skip-bad", "skip_bad=True"},
                                                            {"topic", "topics"},
                                                            {"resume", "octosurf.load_map()"},
                                                            {"up", "up="}};

std::string keyword_of(std::string option) {
  for (const auto& [name, keyword] : keywords)
    if (option == name) return keyword;
  for (char& letter : option)
    if (letter == '-') letter = '_';
  return option;
}

/// What the library says of the command's options and of C++ names, as Python has them. Command lines stay.
std::string in_python(const std::string& sentence) {
  // Words are bounded: std::regex calls itself for each letter, and a text may hold a message's megabytes.
  static const std::regex option(R"((^|[ (])--([a-z][a-z-]{0,30})( [A-Z]{1,30}\b)?)"),
      scope(R"((\w)::(?=\w))");
  if (sentence.find("octosurf map --help") != std::string::npos) return "Parameters.names() has them";
  if (std::regex_search(sentence, std::regex("(octosurf|zstd|npm) [a-z-]"))) return sentence;
  std::string said;
  auto rest = sentence.cbegin();
  for (std::smatch found; std::regex_search(rest, sentence.cend(), found, option); rest = found[0].second) {
    const std::string value = found[3];  // "--poses FILE" is poses=FILE
    said += found.prefix().str() + found[1].str() + keyword_of(found[2]) +
            (value.empty() ? value : "=" + value.substr(1));
  }
  said.append(rest, sentence.cend());
  return std::regex_replace(said, scope, "$1.");
}

/// A file's name stays as it is.
std::string place_of(const Error& error) {
  return error.where().starts_with("--") ? in_python(error.where()) : error.where();
}

/// The whole line; between place and hint is what happened.
std::string line_of(const Error& error) {
  const std::string place = error.where().empty() ? "" : error.where() + ": ";
  const std::string hint = error.hint().empty() ? "" : "; " + error.hint();
  std::string_view rest = error.what();
  if (rest.starts_with(place)) rest.remove_prefix(place.size());
  if (rest.ends_with(hint)) rest.remove_suffix(hint.size());
  return (place.empty() ? place : place_of(error) + ": ") + in_python(std::string(rest)) + in_python(hint);
}

void raise(const Error& error) {
  const py::object raised = py::handle(error_type)(text(line_of(error)));
  raised.attr("kind") = py::cast(error.kind());
  raised.attr("where") = text(place_of(error));
  raised.attr("hint") = text(in_python(error.hint()));
  PyErr_SetObject(error_type, raised.ptr());
}

}  // namespace

void bind_error(Module& module) {
  error_type = PyErr_NewExceptionWithDoc("octosurf.Error", error_doc, nullptr, nullptr);
  if (error_type == nullptr) throw py::error_already_set();
  module.add_object("Error", error_type);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      raise(error);
    }
  });
}

}  // namespace octosurf::python
