#pragma once

#include "arrays.hpp"
#include "casters.hpp"

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::python {

/// Of a class, in order.
using FieldNames = std::vector<std::string>;

/// The fields of `object` by name for JSON: arrays become lists, objects with fields dicts.
pybind11::dict dict_of(const FieldNames& names, const pybind11::object& object);

/// "Circle(center=[0, 0, 1], radius=0.2)", one line however large the fields are.
std::string described(const FieldNames& names, const pybind11::object& object);

/// "; did you mean 'resolution'?"; empty if no known word is like this one.
std::string suggestion(const std::string& word, const FieldNames& known);

/// A result of the library: its fields are readable, and define its text, its dict and its pickle.
template <class T, class... Options>
class Value : public pybind11::class_<T, Options...> {
 public:
  using Base = pybind11::class_<T, Options...>;

  Value(pybind11::handle scope, const char* name, const char* doc) : Base(scope, name, doc) {
    this->def(
        "to_dict", [names = names_](const pybind11::object& self) { return dict_of(*names, self); },
        "The fields by name, as JSON can hold them.");
    this->def("__repr__",
              [names = names_](const pybind11::object& self) { return python::described(*names, self); });
    this->def(pybind11::pickle(
        [names = names_](const pybind11::object& self) {
          pybind11::tuple state(names->size());
          for (std::size_t i = 0; i < names->size(); ++i) state[i] = self.attr((*names)[i].c_str());
          return state;
        },
        [setters = setters_](const pybind11::tuple& state) {
          T value{};
          for (std::size_t i = 0; i < setters->size(); ++i) (*setters)[i](value, state[i]);
          return value;
        }));
  }

  template <class Owner, class Field>
  Value& field(const char* name, Field Owner::*member, const char* doc) {
    this->def_readonly(name, member, doc);
    return add(name,
               [member](T& value, const pybind11::handle& given) { value.*member = given.cast<Field>(); });
  }

  /// Of what Python has in another form: `set(T&, Given)` takes back what `get` gives.
  template <class Given, class Get, class Set>
  Value& field(const char* name, Get get, Set set, const char* doc) {
    this->def_property_readonly(name, get, doc);
    return add(name, [set](T& value, const pybind11::handle& given) { set(value, given.cast<Given>()); });
  }

  /// One row per element; a read-only view.
  template <class Scalar, int Columns>
  Value& rows(const char* name, std::vector<Eigen::Matrix<Scalar, Columns, 1>> T::*member, const char* doc) {
    this->def_property_readonly(
        name,
        [member](const pybind11::object& self) { return rows_view(self.cast<const T&>().*member, self); },
        doc);
    return add(name, [member](T& value, const pybind11::handle& given) {
      value.*member = rows_of<Scalar, Columns>(given);
    });
  }

  /// A list of such views.
  Value& rings(const char* name, std::vector<Ring2> T::*member, const char* doc) {
    this->def_property_readonly(
        name,
        [member](const pybind11::object& self) {
          std::vector<pybind11::array_t<double>> views;
          for (const Ring2& ring : self.cast<const T&>().*member) views.push_back(rows_view(ring, self));
          return views;
        },
        doc);
    return add(name, [member](T& value, const pybind11::handle& given) {
      (value.*member).clear();
      for (const pybind11::handle ring : given) (value.*member).push_back(rows_of<double, 2>(ring));
    });
  }

  /// Another text than that of the fields.
  template <class Make>
  Value& text(Make make) {
    this->attr("__repr__") =
        pybind11::cpp_function(make, pybind11::name("__repr__"), pybind11::is_method(*this));
    return *this;
  }

 private:
  using Setter = std::function<void(T&, const pybind11::handle&)>;

  Value& add(const char* name, Setter setter) {
    names_->emplace_back(name);
    setters_->push_back(std::move(setter));
    return *this;
  }

  std::shared_ptr<FieldNames> names_ = std::make_shared<FieldNames>();
  std::shared_ptr<std::vector<Setter>> setters_ = std::make_shared<std::vector<Setter>>();
};

}  // namespace octosurf::python
