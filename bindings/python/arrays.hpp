#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstring>
#include <pybind11/numpy.h>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::python {

/// A read-only array, one row per element, of what lies in `owner`, which lives as long as the array does.
template <class Scalar, int Columns>
pybind11::array_t<Scalar> rows_view(const std::vector<Eigen::Matrix<Scalar, Columns, 1>>& rows,
                                    pybind11::handle owner) {
  using Row = Eigen::Matrix<Scalar, Columns, 1>;
  static_assert(sizeof(Row) == Columns * sizeof(Scalar));
  pybind11::array_t<Scalar> view({static_cast<pybind11::ssize_t>(rows.size()), pybind11::ssize_t{Columns}},
                                 rows.empty() ? nullptr : rows.front().data(), owner);
  pybind11::detail::array_proxy(view.ptr())->flags &= ~pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

/// The rows of an array or of a list, copied. Throws Error(data) for another number of columns.
template <class Scalar, int Columns>
std::vector<Eigen::Matrix<Scalar, Columns, 1>> rows_of(const pybind11::handle& given) {
  const auto array =
      pybind11::array_t<Scalar, pybind11::array::c_style | pybind11::array::forcecast>::ensure(given);
  if (!array) throw pybind11::error_already_set();
  std::vector<Eigen::Matrix<Scalar, Columns, 1>> rows(static_cast<std::size_t>(array.size()) / Columns);
  if (array.size() == 0) return rows;
  if (array.ndim() != 2 || array.shape(1) != Columns)
    throw Error(Error::Kind::data, "rows", "have shape " + std::string(pybind11::str(array.attr("shape"))),
                "give (N, " + std::to_string(Columns) + "), a row for each");
  std::memcpy(rows.front().data(), array.data(), static_cast<std::size_t>(array.nbytes()));
  return rows;
}

/// An array of its own that takes the numbers over without copying them.
template <class Element>
pybind11::array_t<Element> moved_array(std::vector<Element> elements) {
  auto* const kept = new std::vector<Element>(std::move(elements));
  const pybind11::capsule owner(kept,
                                [](void* vector) { delete static_cast<std::vector<Element>*>(vector); });
  return pybind11::array_t<Element>(static_cast<pybind11::ssize_t>(kept->size()), kept->data(), owner);
}

}  // namespace octosurf::python
