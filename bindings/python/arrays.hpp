#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <pybind11/numpy.h>
#include <type_traits>
#include <utility>
#include <vector>

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

/// An array of its own that takes the numbers over without copying them.
template <class Element>
pybind11::array_t<Element> moved_array(std::vector<Element> elements) {
  auto* const kept = new std::vector<Element>(std::move(elements));
  const pybind11::capsule owner(kept,
                                [](void* vector) { delete static_cast<std::vector<Element>*>(vector); });
  return pybind11::array_t<Element>(static_cast<pybind11::ssize_t>(kept->size()), kept->data(), owner);
}

}  // namespace octosurf::python
