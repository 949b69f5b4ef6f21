#pragma once

#include "arrays.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/changes.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/explain.hpp>
#include <octosurf/export.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/map.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/pose_forms.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/storeys.hpp>
#include <octosurf/up.hpp>

// How octosurf's types are said in Python where they are no classes of their own: enumerations are strings,
// poses are 4×4 arrays, successors are pairs (before, now).

namespace octosurf::python {

/// The names of an enumeration's values, in order; `what` names the enumeration in errors.
template <class E>
struct Names;  // specialised below

#define OCTOSURF_NAMES(Enumeration, What, List) \
  template <>                                   \
  struct Names<Enumeration> {                   \
    static constexpr const char* what = What;   \
    static constexpr auto& list = List;         \
  }

inline constexpr std::array<std::string_view, 4> error_kind_names{"usage", "data", "output", "incomplete"};
inline constexpr std::array<std::string_view, 2> sensor_names{"depth_camera", "lidar"};
inline constexpr std::array<std::string_view, 3> state_names{"unknown", "free", "occupied"};
inline constexpr std::array<std::string_view, 3> up_source_names{"given", "surfaces", "assumed"};
inline constexpr std::array<std::string_view, 2> detector_names{"likelihood", "paper"};
inline constexpr std::array<std::string_view, 2> removed_names{"surface", "cylinder"};
inline constexpr std::array<std::string_view, 4> no_plan_names{"start", "goal", "unreachable", "budget"};

OCTOSURF_NAMES(Error::Kind, "kind of error", error_kind_names);
OCTOSURF_NAMES(SensorKind, "sensor", sensor_names);
OCTOSURF_NAMES(PoseForm, "form of poses", pose_form_names);
OCTOSURF_NAMES(OccupancyView::State, "state", state_names);
OCTOSURF_NAMES(Up::Source, "source", up_source_names);
OCTOSURF_NAMES(DetectorKind, "detector", detector_names);
OCTOSURF_NAMES(Removal::Of, "kind", removed_names);
OCTOSURF_NAMES(AlignmentOutcome, "outcome", alignment_outcome_names);
OCTOSURF_NAMES(Finding, "finding", finding_names);
OCTOSURF_NAMES(ContactRefusal, "refusal", contact_refusal_names);
OCTOSURF_NAMES(FootName, "foot", foot_names);
OCTOSURF_NAMES(RoutePlace, "place", route_place_names);
OCTOSURF_NAMES(StepRefusal, "refusal", step_refusal_names);
OCTOSURF_NAMES(NoPlan::Why, "reason", no_plan_names);
OCTOSURF_NAMES(ExportPart, "part", export_part_names);
OCTOSURF_NAMES(ViewFrom, "view", view_names);
OCTOSURF_NAMES(StairKind, "course", stair_kind_names);
OCTOSURF_NAMES(Ground, "kind of ground", ground_names);
OCTOSURF_NAMES(Reason, "reason", reason_names);

#undef OCTOSURF_NAMES

template <class E>
E named(std::string_view name) {
  std::string all;
  for (std::size_t i = 0; i < Names<E>::list.size(); ++i) {
    if (Names<E>::list[i] == name) return static_cast<E>(i);
    all += (i == 0 ? "" : ", ") + std::string(Names<E>::list[i]);
  }
  throw Error(Error::Kind::usage, "'" + std::string(name) + "'", std::string("is no ") + Names<E>::what,
              "give one of " + all);
}

template <class Field>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;

/// What types alone do not say of a field: "(3,) float64, a view"; "\"left\", \"right\""; empty: nothing.
template <class Field>
std::string form_of() {
  if constexpr (std::is_same_v<Field, Eigen::Isometry3d>) {
    return "(4, 4) float64; a copy";
  } else if constexpr (std::is_same_v<Field, std::vector<Ring2>>) {
    return "List of (N, 2) float64; read-only views";
  } else if constexpr (is_optional<Field>) {
    return form_of<typename Field::value_type>();
  } else if constexpr (is_viewed<Field>) {
    using Element = Row<typename Field::value_type>;
    return "(N, " + std::to_string(Element::columns) + ") " +
           std::string(pybind11::str(pybind11::dtype::of<typename Element::Number>())) + "; a read-only view";
  } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<Field>, Field>) {
    constexpr int rows = Field::RowsAtCompileTime, columns = Field::ColsAtCompileTime;
    const auto size = [](int count) { return count == Eigen::Dynamic ? "N" : std::to_string(count); };
    return "(" + size(rows) + "," + (columns == 1 ? "" : " " + size(columns)) + ") " +
           std::string(pybind11::str(pybind11::dtype::of<typename Field::Scalar>()));
  } else if constexpr (requires { Names<Field>::what; }) {
    std::string all;
    for (const std::string_view name : Names<Field>::list)
      all += (all.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    return all;
  } else if constexpr (requires { Names<typename Field::value_type>::what; }) {
    return form_of<typename Field::value_type>();
  } else {
    return "";
  }
}

}  // namespace octosurf::python

namespace pybind11::detail {

using octosurf::MapChanges;
template <>
struct type_caster<MapChanges::Successor> {
  using Ids = std::pair<octosurf::SurfaceId, octosurf::SurfaceId>;
  PYBIND11_TYPE_CASTER(MapChanges::Successor, make_caster<Ids>::name);

  bool load(handle source, bool) {
    const auto [before, now] = source.cast<Ids>();
    value.before = before;
    value.now = now;
    return true;
  }
  static handle cast(const MapChanges::Successor& successor, return_value_policy policy, handle parent) {
    return make_caster<Ids>::cast(Ids(successor.before, successor.now), policy, parent);
  }
};

/// Enumerations that have Names.
template <class E>
struct type_caster<E, std::void_t<decltype(octosurf::python::Names<E>::what)>> {
  PYBIND11_TYPE_CASTER(E, const_name("str"));

  bool load(handle source, bool) {
    if (!isinstance<str>(source)) return false;
    value = octosurf::python::named<E>(source.cast<std::string>());
    return true;
  }
  static handle cast(E value, return_value_policy, handle) {
    const std::string_view name = octosurf::python::Names<E>::list[static_cast<std::size_t>(value)];
    return str(name.data(), name.size()).release();
  }
};

/// Pointers that are given are never null: pybind11 would make None one.
template <class T>
struct held_caster : copyable_holder_caster<T, std::shared_ptr<T>> {
  bool load(handle source, bool convert) {
    return !source.is_none() && copyable_holder_caster<T, std::shared_ptr<T>>::load(source, convert);
  }
};
template <>
struct type_caster<std::shared_ptr<octosurf::Snapshot>> : held_caster<octosurf::Snapshot> {};
template <>
struct type_caster<std::shared_ptr<octosurf::Surface>> : held_caster<octosurf::Surface> {};

/// Arrays that are given: dense().
template <class Number>
struct pyobject_caster<octosurf::python::Dense<Number>> {
  using Array = octosurf::python::Dense<Number>;
  PYBIND11_TYPE_CASTER(Array, handle_type_name<Array>::name);

  bool load(handle source, bool) {
    value = octosurf::python::dense<Number>(source);
    return true;
  }
};

/// Rigid motions: 4×4 float64 whose last row is 0 0 0 1, copied; checked where they are used.
template <>
struct type_caster<Eigen::Isometry3d> {
  PYBIND11_TYPE_CASTER(Eigen::Isometry3d, const_name("numpy.ndarray[numpy.float64[4, 4]]"));

  bool load(handle source, bool) {
    const auto numbers = octosurf::python::dense<double>(source);
    const bool square = numbers.ndim() == 2 && numbers.shape(0) == 4 && numbers.shape(1) == 4;
    if (!square)
      throw octosurf::Error(octosurf::Error::Kind::data, "pose", "is not 4x4", "give a rigid motion");
    value.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
    if (!(value.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1)))
      throw octosurf::Error(octosurf::Error::Kind::data, "pose", "has another last row than 0 0 0 1",
                            "give a rigid motion");
    return true;
  }
  static handle cast(const Eigen::Isometry3d& pose, return_value_policy, handle) {
    return type_caster<Eigen::Matrix4d>::cast(pose.matrix(), return_value_policy::copy, {});
  }
};

}  // namespace pybind11::detail
