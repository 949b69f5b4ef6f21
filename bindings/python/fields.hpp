#pragma once

#include "casters.hpp"

#include <memory>
#include <string>
#include <vector>

namespace octosurf::python {

/// A struct of settings: its fields can be set, given by name to the constructor, compared and turned into a
/// dict and back.
template <class T>
class Settings : public pybind11::class_<T> {
 public:
  using Base = pybind11::class_<T>;

  Settings(pybind11::handle scope, const char* name, const char* doc) : Base(scope, name, doc) {
    this->def(
        pybind11::init([names = names_](const pybind11::kwargs& given) { return made(*names, given); }));
    this->def(
        "to_dict", [names = names_](const T& settings) { return dict_of(*names, settings); },
        "The fields by name, nested where they are settings themselves; as JSON can hold them.");
    this->def_static(
        "from_dict", [names = names_](const pybind11::dict& values) { return from_dict(*names, values); },
        pybind11::arg("values"),
        "Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no "
        "field.");
    this->def("__eq__", [names = names_](const T& settings, const pybind11::object& other) {
      return pybind11::isinstance<T>(other) &&
             dict_of(*names, settings).equal(dict_of(*names, other.template cast<const T&>()));
    });
    this->def("__repr__", [names = names_](const pybind11::object& settings) {
      return pybind11::str(pybind11::type::of(settings).attr("__name__")) + pybind11::str(".from_dict(") +
             pybind11::repr(dict_of(*names, settings.template cast<const T&>())) + pybind11::str(")");
    });
    this->def(pybind11::pickle(
        [names = names_](const T& settings) { return dict_of(*names, settings); },
        [names = names_](const pybind11::dict& values) { return from_dict(*names, values); }));
    this->attr("__hash__") = pybind11::none();
  }

  template <class Field>
  Settings& field(const char* name, Field T::*member, const char* doc) {
    names_->emplace_back(name);
    this->def_readwrite(name, member, doc);
    return *this;
  }

 private:
  using FieldNames = std::vector<std::string>;

  static void set(pybind11::object& settings, const std::string& name, const pybind11::handle& value) {
    pybind11::object now = settings.attr(name.c_str());
    if (pybind11::isinstance<pybind11::dict>(value) && pybind11::hasattr(now, "from_dict"))
      settings.attr(name.c_str()) = now.attr("from_dict")(value);
    else
      settings.attr(name.c_str()) = value;
  }

  static bool has(const FieldNames& names, const std::string& name) {
    for (const std::string& one : names)
      if (one == name) return true;
    return false;
  }

  static T made(const FieldNames& names, const pybind11::kwargs& given) {
    T settings{};
    pybind11::object object = pybind11::cast(&settings, pybind11::return_value_policy::reference);
    for (const auto& [key, value] : given) {
      const auto name = key.template cast<std::string>();
      if (!has(names, name)) throw pybind11::type_error("there is no field '" + name + "'");
      set(object, name, value);
    }
    return settings;
  }

  static T from_dict(const FieldNames& names, const pybind11::dict& values) {
    for (const auto& [key, value] : values)
      if (!pybind11::isinstance<pybind11::str>(key) || !has(names, key.template cast<std::string>()))
        throw Error(Error::Kind::usage, pybind11::str(key), "is no field", "to_dict() names them");
    return made(names, pybind11::kwargs(values));
  }

  static pybind11::dict dict_of(const FieldNames& names, const T& settings) {
    const pybind11::object object = pybind11::cast(&settings, pybind11::return_value_policy::reference);
    pybind11::dict values;
    for (const std::string& name : names) {
      pybind11::object value = object.attr(name.c_str());
      if (pybind11::hasattr(value, "to_dict")) value = value.attr("to_dict")();
      if (pybind11::hasattr(value, "tolist")) value = value.attr("tolist")();
      values[name.c_str()] = value;
    }
    return values;
  }

  std::shared_ptr<FieldNames> names_ = std::make_shared<FieldNames>();
};

}  // namespace octosurf::python
