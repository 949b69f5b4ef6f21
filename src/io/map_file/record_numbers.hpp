#pragma once

#include "geometry/voxel_key.hpp"
#include "io/map_file/map_rows.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <google/protobuf/repeated_field.h>
#include <limits>
#include <optional>
#include <utility>

namespace octosurf::io {

/// The largest magnitude in a list of numbers, which are finite, and the message for others.
struct NumberRule {
  double largest;
  const char* otherwise;
};
inline constexpr NumberRule finite_numbers{std::numeric_limits<double>::max(),
                                           "has a number that is not finite"};

/// A record's list of numbers, visited in order: read from it, or, without `damage`, appended to it. One list
/// of fields serves both ways.
template <class Real>
class RecordNumbers {
 public:
  RecordNumbers(google::protobuf::RepeatedField<Real>& list, const Damage* damage, NumberRule rule)
      : list_(list), damage_(damage), rule_(rule) {}

  void operator()(Real& value) {
    if (!damage_) return list_.Add(value), void();
    damage_->require(at_ < list_.size(), "lacks numbers");
    value = list_[at_++];
    damage_->require(std::abs(value) <= rule_.largest, rule_.otherwise);  // NaN fails
  }
  void operator()(bool& flag) {
    Real value = flag ? 1 : 0;
    (*this)(value);
    if (damage_) damage_->require(value == 0 || value == 1, "has a number that makes no sense");
    flag = value != 0;
  }
  template <class Derived>
  void operator()(Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row)
      for (Eigen::Index column = 0; column < matrix.cols(); ++column) (*this)(matrix(row, column));
  }
  void operator()(Eigen::Isometry3d& T) {
    for (int i = 0; i < 12; ++i) (*this)(T(i / 4, i % 4));
  }
  template <class First, class... More>
  void operator()(First& first, More&... more) requires(sizeof...(more) > 0) {
    (*this)(first);
    (*this)(more...);
  }

  bool at_end() const { return at_ == list_.size(); }

 private:
  google::protobuf::RepeatedField<Real>& list_;
  const Damage* damage_;
  NumberRule rule_;
  int at_ = 0;
};

/// Visits a whole list, which has exactly these values.
template <class Real, class... Values>
void visit_numbers(google::protobuf::RepeatedField<Real>* list, const Damage* damage, NumberRule rule,
                   Values&... values) {
  RecordNumbers<Real> numbers(*list, damage, rule);
  numbers(values...);
  if (damage) damage->require(numbers.at_end(), "lacks numbers, or has too many");
}

/// Key of a row: of the cube of 64³ voxels that holds this one.
inline std::int64_t cube_of(const geometry::VoxelKey& key) {
  return static_cast<std::int64_t>(key.packed() >> 6 & 0x3ff03ff03ff);
}

/// Ascending voxel keys as differences of packed keys.
class KeySteps {
 public:
  std::uint64_t to(const geometry::VoxelKey& key) {
    return key.packed() - std::exchange(last_, key.packed());
  }
  /// Empty for a key outside the octree, or out of order.
  std::optional<geometry::VoxelKey> from(std::uint64_t step) {
    constexpr std::uint64_t keys = std::uint64_t{1} << 48;
    if ((step == 0 && !first_) || step >= keys || last_ + step >= keys) return {};
    first_ = false;
    return geometry::VoxelKey::unpack(last_ += step);
  }

 private:
  std::uint64_t last_ = 0;
  bool first_ = true;
};

}  // namespace octosurf::io
