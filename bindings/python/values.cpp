// What Python makes of the fields of results and settings.
#include "values.hpp"

#include "header_docs.hpp"

#include <algorithm>
#include <cmath>
#include <regex>
#include <stdexcept>

namespace octosurf::python {
namespace {

bool is_plain(const py::handle& value) {
  return value.is_none() || py::isinstance<py::bool_>(value) || py::isinstance<py::int_>(value) ||
         py::isinstance<py::float_>(value) || py::isinstance<py::str>(value);
}

py::object as_json(const py::object& value) {
  if (is_plain(value)) return value;
  if (py::hasattr(value, "to_dict")) return value.attr("to_dict")();
  if (py::hasattr(value, "tolist")) return value.attr("tolist")();
  if (py::isinstance<py::dict>(value)) {
    py::dict all;
    for (const auto& [key, one] : value.cast<py::dict>())
      all[key] = as_json(py::reinterpret_borrow<py::object>(one));
    return all;
  }
  py::list all;
  for (const py::handle one : value) all.append(as_json(py::reinterpret_borrow<py::object>(one)));
  return all;
}

std::string type_name(const py::handle& value) { return py::str(py::type::of(value).attr("__name__")); }

std::string short_text(const py::handle& value);

/// "[0, 0, 1]" of few plain ones, else how many.
std::string text_of_all(const py::sequence& all) {
  constexpr std::size_t few = 4;
  bool plain = all.size() <= few;
  for (std::size_t i = 0; plain && i < all.size(); ++i) plain = is_plain(all[i]);
  if (!plain) {
    const py::object first = all[0];
    return "[" + std::to_string(all.size()) + (is_plain(first) ? " items]" : " " + type_name(first) + "]");
  }
  std::string text = "[";
  for (std::size_t i = 0; i < all.size(); ++i) text += (i == 0 ? "" : ", ") + short_text(all[i]);
  return text + "]";
}

std::string short_text(const py::handle& value) {
  constexpr std::size_t longest = 80;
  if (py::isinstance<py::float_>(value))
    return py::str(py::module_::import("builtins").attr("format")(value, ".4g"));
  if (is_plain(value)) return py::repr(value);
  if (py::isinstance<py::array>(value)) {
    const auto array = py::reinterpret_borrow<py::array>(value);
    if (array.ndim() == 1) return text_of_all(array.attr("tolist")());
    return "array" + std::string(py::str(array.attr("shape")));
  }
  if (py::isinstance<py::dict>(value)) return "{" + std::to_string(py::len(value)) + " items}";
  if (py::isinstance<py::sequence>(value)) return text_of_all(py::reinterpret_borrow<py::sequence>(value));
  const std::string text = py::repr(value);
  return text.size() <= longest ? text : type_name(value) + "(…)";
}

/// "; did you mean 'resolution'?"; empty if no known word is like this one.
std::string suggestion(const std::string& word, const FieldNames& known) {
  const py::list like = py::module_::import("difflib").attr("get_close_matches")(word, known, 1);
  return like.empty() ? std::string() : "; did you mean '" + like[0].cast<std::string>() + "'?";
}

bool has(const FieldNames& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

void set(const py::object& settings, const std::string& name, const py::handle& value) {
  const py::object now = settings.attr(name.c_str());
  const bool inner = py::isinstance<py::dict>(value) && py::hasattr(now, "from_dict");
  settings.attr(name.c_str()) =
      inner ? py::object(now.attr("from_dict")(value)) : py::reinterpret_borrow<py::object>(value);
}

}  // namespace

py::dict dict_of(const FieldNames& names, const py::object& object) {
  py::dict values;
  for (const std::string& name : names) values[name.c_str()] = as_json(object.attr(name.c_str()));
  return values;
}

std::string described(const FieldNames& names, const py::object& object) {
  std::string text = type_name(object) + "(";
  for (const std::string& name : names)
    text += (text.back() == '(' ? "" : ", ") + name + "=" + short_text(object.attr(name.c_str()));
  return text + ")";
}

const char* doc_of(const std::string& name, bool may_lack) {
  const auto* const row =
      std::lower_bound(std::begin(header_docs), std::end(header_docs), name,
                       [](const auto& one, const std::string& wanted) { return one.first < wanted; });
  if (row != std::end(header_docs) && row->first == name) return row->second;
  if (!may_lack) throw std::logic_error("no comment of '" + name + "' in the public headers");
  return "";
}

std::string field_doc(const std::string& name, const std::string& form, bool optional) {
  std::string doc = doc_of(name);
  if (optional) doc = std::regex_replace(doc, std::regex("\\b[Ee]mpty\\b"), "None");
  return form.empty() ? doc : doc + " " + form + ".";
}

py::object reduced(const py::object& self, int protocol) {
  if (!py::hasattr(self, "__setstate__")) throw py::type_error("cannot pickle a " + type_name(self));
  if (protocol < 2) throw py::type_error("cannot pickle a " + type_name(self) + " by protocols below 2");
  return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(py::type::of(self)),
                        self.attr("__getstate__")());
}

void set_fields(const SettingsWords& words, const py::object& settings, const py::dict& given) {
  for (const auto& [key, value] : given)  // groups first, as their fields by name are more particular
    if (const auto name = key.cast<std::string>(); has(words.fields, name)) set(settings, name, value);
  for (const auto& [key, value] : given) {
    const auto name = key.cast<std::string>();
    if (has(words.fields, name)) continue;
    const auto at =
        std::ranges::find_if(words.inner, [&](const SettingsWords::Inner& one) { return one.word == name; });
    if (at == words.inner.end()) {
      FieldNames known = words.fields;
      for (const SettingsWords::Inner& one : words.inner) known.push_back(one.word);
      throw py::type_error("there is no field '" + name + "'" + suggestion(name, known));
    }
    set(settings.attr(at->group.c_str()), name, value);
  }
}

void set_field(const py::object& settings, const py::str& name, const py::object& value) {
  const double number = PyFloat_AsDouble(value.ptr());  // -1 if it is none
  if (PyErr_Occurred() != nullptr) PyErr_Clear();
  if (!std::isfinite(number)) throw Error(Error::Kind::usage, name, "is not finite", "give a number");
  if (PyObject_GenericSetAttr(settings.ptr(), name.ptr(), value.ptr()) == 0) return;
  if (PyErr_ExceptionMatches(PyExc_TypeError) == 0) throw py::error_already_set();
  PyErr_Clear();
  const py::object type = py::type::of(settings);
  throw py::type_error(py::str("{}.{} cannot be {!r}: {}")
                           .format(type.attr("__name__"), name, value, type.attr(name).attr("__doc__")));
}

void require_names(const SettingsWords& words, const py::args& unnamed) {
  if (!unnamed.empty())
    throw py::type_error(
        py::str("fields are given by name: {}").format(py::str(", ").attr("join")(words.fields)));
}

void require_fields(const SettingsWords& words, const py::dict& values) {
  for (const auto& [key, value] : values)
    if (!py::isinstance<py::str>(key) || !has(words.fields, key.cast<std::string>()))
      throw Error(Error::Kind::usage, py::str(key), "is no field",
                  "to_dict() names them" + suggestion(py::str(key), words.fields));
}

}  // namespace octosurf::python
