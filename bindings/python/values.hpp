#pragma once

#include "arrays.hpp"
#include "casters.hpp"

#include <boost/preprocessor/seq/enum.hpp>
#include <boost/preprocessor/seq/transform.hpp>
#include <boost/preprocessor/variadic/to_seq.hpp>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

/// Fields of a struct with their names, for fields(): OCTOSURF_FIELDS(Nearest, id, point).
#define OCTOSURF_FIELDS(Class, ...) \
  BOOST_PP_SEQ_ENUM(BOOST_PP_SEQ_TRANSFORM(OCTOSURF_FIELD, Class, BOOST_PP_VARIADIC_TO_SEQ(__VA_ARGS__)))
#define OCTOSURF_FIELD(r, Class, name) std::pair(#name, &Class::name)

namespace octosurf::python {

namespace py = pybind11;
using py::literals::operator""_a;

/// Of a class, in order.
using FieldNames = std::vector<std::string>;

/// The fields of `object` by name for JSON: arrays become lists, objects with fields dicts.
py::dict dict_of(const FieldNames& names, const py::object& object);

/// "Nearest(id=7, point=[0, 0, 1], distance=0.2)", one line however large the fields are.
std::string described(const FieldNames& names, const py::object& object);

/// What the public headers say of a function or of "Class.member", see header_docs.py. Where they say
/// nothing, it is empty, or throws std::logic_error unless `may_lack`.
const char* doc_of(const std::string& name, bool may_lack = false);

/// The same of a field in another form: `form`, that of an array, or the words of an enumeration; of an
/// optional one what is empty is None.
std::string field_doc(const std::string& name, const std::string& form, bool optional);

/// The numbers as a dict.
template <class Number, std::size_t Size>
std::map<std::string, Number> by_name(const std::array<Number, Size>& numbers,
                                      const std::array<std::string_view, Size>& names) {
  std::map<std::string, Number> dict;
  for (std::size_t i = 0; i < Size; ++i) dict[std::string(names[i])] = numbers[i];
  return dict;
}

template <class... Extra>
inline constexpr bool has_doc = (std::is_convertible_v<const Extra&, const char*> || ...);

/// Functions have the headers' docstrings unless they are given one.
class Module : public py::module_ {
 public:
  explicit Module(const py::module_& module) : py::module_(module) {}

  template <class Function, class... Extra>
  Module& def(const char* name, Function&& function, const Extra&... extra) {
    py::module_::def(name, std::forward<Function>(function), doc_of(name, has_doc<Extra...>), extra...);
    return *this;
  }
};

/// object.__reduce_ex__(). Throws TypeError for protocols below 2, and for what has no state to give.
py::object reduced(const py::object& self, int protocol);

/// Likewise a class and its methods. `header`: what the headers call it, if not as Python does.
template <class T, class... Options>
class Class : public py::class_<T, Options...> {
 public:
  using Base = py::class_<T, Options...>;

  Class(py::handle scope, const char* name, const char* doc = nullptr, const char* header = nullptr)
      : Base(scope, name, doc != nullptr ? doc : doc_of(header != nullptr ? header : name)),
        header_(header != nullptr ? header : name) {
    text([type = "<" + std::string(name) + ">"](const T&) { return type; });
    // By object's own, protocols 0 and 1 end the interpreter: pybind11 throws where Python makes the base.
    this->attr("__reduce_ex__") =
        py::cpp_function(&reduced, py::name("__reduce_ex__"), py::is_method(*this), py::arg("protocol"));
    this->attr("__reduce__") = py::cpp_function([](const py::object& self) { return reduced(self, 0); },
                                                py::name("__reduce__"), py::is_method(*this));
  }

  /// What repr() says.
  template <class Make>
  Class& text(Make make) {
    this->attr("__repr__") = py::cpp_function(make, py::name("__repr__"), py::is_method(*this));
    return *this;
  }

  template <class Method, class... Extra>
  Class& def(const char* name, Method&& method, const Extra&... extra) {
    Base::def(name, std::forward<Method>(method), method_doc(name, has_doc<Extra...>), extra...);
    return *this;
  }

  template <class Init, class... Extra>
  requires(!std::is_convertible_v<Init, const char*>) Class& def(Init&& init, const Extra&... extra) {
    Base::def(std::forward<Init>(init), extra...);
    return *this;
  }

  template <class Function, class... Extra>
  Class& def_static(const char* name, Function&& function, const Extra&... extra) {
    Base::def_static(name, std::forward<Function>(function), method_doc(name, has_doc<Extra...>), extra...);
    return *this;
  }

 protected:
  const char* method_doc(const std::string& name, bool given) const {
    return doc_of(header_ + "." + name, given || name.starts_with("__"));
  }

  template <class Field>
  std::string doc_of_field(const char* name) const {
    return field_doc(header_ + "." + name, form_of<Field>(), is_optional<Field>);
  }

 private:
  std::string header_;
};

/// A result of the library: its fields are readable, and define its text and its dict.
template <class T, class... Options>
class Value : public Class<T, Options...> {
 public:
  Value(py::handle scope, const char* name, const char* doc = nullptr, const char* header = nullptr)
      : Class<T, Options...>(scope, name, doc, header) {
    this->def(
        "to_dict", [names = names_](const py::object& self) { return dict_of(*names, self); },
        "The fields by name, as JSON can hold them.");
    this->text([names = names_](const py::object& self) { return described(*names, self); });
  }

  /// OCTOSURF_FIELDS(T, …).
  template <class... Members>
  Value& fields(std::pair<const char*, Members>... all) {
    (field(all.first, all.second), ...);
    return *this;
  }

  /// Of what Python has in another form.
  template <class Get>
  Value& field(const char* name, Get get, const char* doc) {
    this->def_property_readonly(name, get, doc);
    names_->emplace_back(name);
    return *this;
  }

  /// An array whose elements have the names: a dict.
  template <class Number, std::size_t Size>
  Value& field(const char* name, std::array<Number, Size> T::*member,
               const std::array<std::string_view, Size>& names) {
    return field(
        name, [member, &names](const T& self) { return by_name(self.*member, names); },
        this->template doc_of_field<std::map<std::string, Number>>(name).c_str());
  }

 private:
  template <class Owner, class Field>
  void field(const char* name, Field Owner::*member) {
    const std::string doc = this->template doc_of_field<Field>(name);
    if constexpr (is_viewed<Field>)
      this->def_property_readonly(
          name, [member](const py::object& self) { return view_of(self.cast<const T&>().*member, self); },
          doc.c_str());
    else
      this->def_readonly(name, member, doc.c_str());
    names_->emplace_back(name);
  }

  std::shared_ptr<FieldNames> names_ = std::make_shared<FieldNames>();
};

/// What the constructor of settings takes by name: their fields, and fields of those that are settings.
struct SettingsWords {
  struct Inner {
    std::string word, group;
  };

  FieldNames fields;
  std::vector<Inner> inner;
};

/// Throws TypeError for a name that is none of the words.
void set_fields(const SettingsWords& words, const py::object& settings, const py::dict& given);

/// Throws TypeError for values without names, which names the fields.
void require_names(const SettingsWords& words, const py::args& unnamed);

/// Throws Error(usage) for a name that is no field.
void require_fields(const SettingsWords& words, const py::dict& values);

/// Throws Error(usage) for a number that is not finite, TypeError with the field's name for another type.
void set_field(const py::object& settings, const py::str& name, const py::object& value);

/// A struct of settings: fields can be set, given by name to the constructor, compared, and put into a dict.
template <class T>
class Settings : public Class<T> {
 public:
  Settings(py::handle scope, const char* name, const char* doc = nullptr) : Class<T>(scope, name, doc) {
    const auto read = [words = words_](const py::dict& values) {
      require_fields(*words, values);
      return with(*words, T{}, values);
    };
    const auto dict = [words = words_](const py::object& settings) {
      return dict_of(words->fields, settings);
    };
    this->def(py::init([words = words_](const py::args& unnamed, const py::kwargs& given) {
      require_names(*words, unnamed);
      return with(*words, T{}, given);
    }));
    this->def("to_dict", dict,
              "The fields by name, nested where they are settings themselves; as JSON can hold them.");
    this->def_static("from_dict", read, "values"_a,
                     "Back from to_dict(); missing ones keep their default. Throws Error(usage) for a name "
                     "that is no field.");
    this->def(
        "replaced",
        [words = words_](const T& settings, const py::kwargs& given) {
          return with(*words, settings, given);
        },
        "A copy with the fields set that are given, by name as to the constructor.");
    this->def("__eq__", [dict](const py::object& settings, const py::object& other) {
      return py::isinstance<T>(other) && dict(settings).equal(dict(other));
    });
    this->text([dict](const py::object& settings) {
      return py::str("{}.from_dict({!r})").format(py::type::of(settings).attr("__name__"), dict(settings));
    });
    this->def(py::pickle(dict, read));
    this->attr("__hash__") = py::none();
    this->def("__setattr__", &set_field);
  }

  /// OCTOSURF_FIELDS(T, …).
  template <class... Members>
  Settings& fields(std::pair<const char*, Members>... all) {
    (field(all.first, all.second), ...);
    return *this;
  }

  /// A field that is settings: the constructor takes their fields by name, too.
  template <class Field>
  Settings& group(const char* name, Field T::*member, const Settings<Field>& inner) {
    for (const std::string& one : inner.names()) words_->inner.push_back({one, name});
    field(name, member);
    return *this;
  }

  const FieldNames& names() const { return words_->fields; }

 private:
  template <class Field>
  void field(const char* name, Field T::*member) {
    words_->fields.emplace_back(name);
    this->def_readwrite(name, member, this->template doc_of_field<Field>(name).c_str());
  }

  static T with(const SettingsWords& words, T settings, const py::dict& given) {
    set_fields(words, py::cast(&settings, py::return_value_policy::reference), given);
    return settings;
  }

  std::shared_ptr<SettingsWords> words_ = std::make_shared<SettingsWords>();
};

}  // namespace octosurf::python
