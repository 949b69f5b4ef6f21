#pragma once

#include "values.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::python {

/// A struct of settings: its fields can be set, given by name to the constructor, compared and turned into a
/// dict and back.
template <class T>
class Settings : public pybind11::class_<T> {
 public:
  using Base = pybind11::class_<T>;

  Settings(pybind11::handle scope, const char* name, const char* doc) : Base(scope, name, doc) {
    this->def(pybind11::init([shape = shape_](const pybind11::kwargs& given) {
      T settings{};
      set_all(*shape, settings, given);
      return settings;
    }));
    this->def(
        "to_dict",
        [shape = shape_](const pybind11::object& settings) { return dict_of(shape->names, settings); },
        "The fields by name, nested where they are settings themselves; as JSON can hold them.");
    this->def_static(
        "from_dict", [shape = shape_](const pybind11::dict& values) { return from_dict(*shape, values); },
        pybind11::arg("values"),
        "Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no "
        "field.");
    this->def(
        "replaced",
        [shape = shape_](const T& settings, const pybind11::kwargs& given) {
          T copy = settings;
          set_all(*shape, copy, given);
          return copy;
        },
        "A copy with the fields set that are given, by name as to the constructor.");
    this->def("__eq__", [shape = shape_](const pybind11::object& settings, const pybind11::object& other) {
      return pybind11::isinstance<T>(other) &&
             dict_of(shape->names, settings).equal(dict_of(shape->names, other));
    });
    this->def("__repr__", [shape = shape_](const pybind11::object& settings) {
      return pybind11::str(pybind11::type::of(settings).attr("__name__")) + pybind11::str(".from_dict(") +
             pybind11::repr(dict_of(shape->names, settings)) + pybind11::str(")");
    });
    this->def(pybind11::pickle(
        [shape = shape_](const pybind11::object& settings) { return dict_of(shape->names, settings); },
        [shape = shape_](const pybind11::dict& values) { return from_dict(*shape, values); }));
    this->attr("__hash__") = pybind11::none();
  }

  template <class Owner, class Field>
  Settings& field(const char* name, Field Owner::*member, const char* doc) {
    shape_->names.emplace_back(name);
    this->def_readwrite(name, member, doc);
    return *this;
  }

  /// A word by which the constructor takes a field of the settings that the field `group` is.
  Settings& keyword(const std::string& word, const char* group, const std::string& field) {
    shape_->keywords.push_back({word, group, field});
    return *this;
  }

  /// A field that is settings: the constructor takes their fields by name, too.
  template <class Field>
  Settings& group(const char* name, Field T::*member, const Settings<Field>& inner, const char* doc) {
    for (const std::string& one : inner.names()) keyword(one, name, one);
    return field(name, member, doc);
  }

  const FieldNames& names() const { return shape_->names; }

 private:
  struct Keyword {
    std::string word, group, field;
  };
  struct Shape {
    FieldNames names;
    std::vector<Keyword> keywords;
  };

  static void set(const pybind11::object& settings, const std::string& name, const pybind11::handle& value) {
    pybind11::object now = settings.attr(name.c_str());
    if (pybind11::isinstance<pybind11::dict>(value) && pybind11::hasattr(now, "from_dict"))
      settings.attr(name.c_str()) = now.attr("from_dict")(value);
    else
      settings.attr(name.c_str()) = value;
  }

  static bool has(const FieldNames& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  static void set_all(const Shape& shape, T& settings, const pybind11::kwargs& given) {
    const pybind11::object object = pybind11::cast(&settings, pybind11::return_value_policy::reference);
    for (const auto& [key, value] : given)  // groups first, as their fields by name are more particular
      if (const auto name = key.template cast<std::string>(); has(shape.names, name))
        set(object, name, value);
    for (const auto& [key, value] : given) {
      const auto name = key.template cast<std::string>();
      if (has(shape.names, name)) continue;
      const auto at = std::find_if(shape.keywords.begin(), shape.keywords.end(),
                                   [&](const Keyword& one) { return one.word == name; });
      if (at == shape.keywords.end()) throw pybind11::type_error(unknown(shape, name));
      set(object.attr(at->group.c_str()), at->field, value);
    }
  }

  static std::string unknown(const Shape& shape, const std::string& name) {
    FieldNames known = shape.names;
    for (const Keyword& one : shape.keywords) known.push_back(one.word);
    return "there is no field '" + name + "'" + suggestion(name, known);
  }

  static T from_dict(const Shape& shape, const pybind11::dict& values) {
    for (const auto& [key, value] : values)
      if (!pybind11::isinstance<pybind11::str>(key) || !has(shape.names, key.template cast<std::string>()))
        throw Error(Error::Kind::usage, pybind11::str(key), "is no field",
                    "to_dict() names them" + suggestion(pybind11::str(key), shape.names));
    T settings{};
    set_all(shape, settings, pybind11::kwargs(values));
    return settings;
  }

  std::shared_ptr<Shape> shape_ = std::make_shared<Shape>();
};

}  // namespace octosurf::python
