#pragma once

#include <boost/container/flat_map.hpp>
#include <cstdint>
#include <memory>

#include <octosurf/ids.hpp>

namespace octosurf::occupancy {

/// Which surface the number in a voxel stands for: a number is an id's low 24 bits, and no two surfaces of a
/// map have the same one at a time. O(1) until 2²⁴ ids have been given; from then on O(log n), and a copy of
/// the table whenever a surface comes or goes.
class SurfaceNumbers {
 public:
  static constexpr SurfaceId count = SurfaceId{1} << 24;
  static constexpr std::uint32_t of(SurfaceId id) { return id & (count - 1); }

  SurfaceId id(std::uint32_t number) const {
    if (late_ == nullptr) return number;
    const auto found = late_->find(number);
    return found == late_->end() ? number : found->second;
  }

  void add(SurfaceId id) {
    if (id < count) return;
    Late late = late_ == nullptr ? Late{} : *late_;
    late.insert_or_assign(of(id), id);
    late_ = std::make_shared<const Late>(std::move(late));
  }
  void remove(SurfaceId id) {
    if (id < count) return;
    Late late = *late_;
    late.erase(of(id));
    late_ = late.empty() ? nullptr : std::make_shared<const Late>(std::move(late));
  }

 private:
  using Late = boost::container::flat_map<std::uint32_t, SurfaceId>;
  std::shared_ptr<const Late> late_;  // ids from `count` on, by number; null: none
};

}  // namespace octosurf::occupancy
