#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstring>
#include <optional>
#include <pybind11/numpy.h>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::python {

// Item sizes are stated, never asked for: pybind11 before 2.12 reads them where NumPy 1 has them.

/// Numbers in C order; arrays that are otherwise are copied so.
template <class Number>
using Dense = pybind11::array_t<Number, pybind11::array::c_style | pybind11::array::forcecast>;

/// Of an array or a list of real numbers. Throws Error(data) for booleans, complex numbers and text, which
/// NumPy would convert.
template <class Number>
Dense<Number> dense(pybind11::handle given) {
  const pybind11::array any(
      pybind11::reinterpret_borrow<pybind11::object>(given));  // throws what NumPy raises
  if (std::string_view("iuf").find(any.dtype().kind()) == std::string_view::npos)
    throw Error(Error::Kind::data, "array", "is of " + std::string(pybind11::str(any.dtype())),
                "give real numbers");
  return Dense<Number>(any);
}

/// Scalar and columns of a vector's elements that are the rows of an array.
template <class Element>
struct Row {};
template <class Scalar, int Columns>
struct Row<Eigen::Matrix<Scalar, Columns, 1>> {
  using Number = Scalar;
  static constexpr pybind11::ssize_t columns = Columns;
};
template <class Scalar, std::size_t Columns>
struct Row<std::array<Scalar, Columns>> {
  using Number = Scalar;
  static constexpr pybind11::ssize_t columns = Columns;
};

/// A read-only array, one row per element, of what lies in `owner`, which lives as long as the array does.
template <class Element>
auto view_of(const std::vector<Element>& rows, pybind11::handle owner) {
  using Number = typename Row<Element>::Number;
  static_assert(sizeof(Element) == Row<Element>::columns * sizeof(Number));
  pybind11::array_t<Number> view({static_cast<pybind11::ssize_t>(rows.size()), Row<Element>::columns},
                                 rows.empty() ? nullptr : rows.front().data(), owner);
  pybind11::detail::array_proxy(view.ptr())->flags &= ~pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

/// A list of such views.
inline std::vector<pybind11::array_t<double>> view_of(const std::vector<Ring2>& rings,
                                                      pybind11::handle owner) {
  std::vector<pybind11::array_t<double>> views;
  for (const Ring2& ring : rings) views.push_back(view_of(ring, owner));
  return views;
}

/// The rows of an array or of a list, copied. Throws Error(data) for another number of columns.
template <class Element>
void rows_from(const pybind11::handle& given, std::vector<Element>& rows) {
  constexpr pybind11::ssize_t columns = Row<Element>::columns;
  const auto array = dense<typename Row<Element>::Number>(given);
  rows.resize(static_cast<std::size_t>(array.size() / columns));
  if (array.size() == 0) return;
  if (array.ndim() != 2 || array.shape(1) != columns)
    throw Error(Error::Kind::data, "rows", "have shape " + std::string(pybind11::str(array.attr("shape"))),
                "give (N, " + std::to_string(columns) + "), a row for each");
  std::memcpy(rows.front().data(), array.data(), rows.size() * sizeof(Element));
}

/// Whether Python sees the field itself: view_of().
template <class Field>
inline constexpr bool is_viewed = std::is_same_v<Field, std::vector<Ring2>>;
template <class Element>
requires requires { Row<Element>::columns; }
inline constexpr bool is_viewed<std::vector<Element>> = true;

/// An array of its own that takes the numbers over without copying them.
template <class Element>
pybind11::array_t<Element> moved_array(std::vector<Element> elements) {
  auto* const kept = new std::vector<Element>(std::move(elements));
  const pybind11::capsule owner(kept,
                                [](void* vector) { delete static_cast<std::vector<Element>*>(vector); });
  return {{kept->size()}, {sizeof(Element)}, kept->data(), owner};
}

}  // namespace octosurf::python
