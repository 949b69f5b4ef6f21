// What Python makes of the fields of results and settings.
#include "values.hpp"

namespace py = pybind11;

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

std::string suggestion(const std::string& word, const FieldNames& known) {
  const py::list like = py::module_::import("difflib").attr("get_close_matches")(word, known, 1);
  return like.empty() ? std::string() : "; did you mean '" + like[0].cast<std::string>() + "'?";
}

}  // namespace octosurf::python
