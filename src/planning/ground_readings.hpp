#pragma once

#include "occupancy/cubes.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/ground_patch.hpp>

namespace octosurf::planning {

inline constexpr float no_height = std::numeric_limits<float>::quiet_NaN();

/// Content of a place, seen from ground nearby.
struct Look {
  PatchCell cell = PatchCell::unseen;
  float height = no_height, slope_rad = no_height;
  SurfaceId surface = 0;                  ///< of what is supported, with
  bool sparse = false, lopsided = false;  ///< readings not so near, or to one side
};

/// The readings around a robot, in the patch's frame, by cells of a grid. They are read again for each patch:
/// a quarter of the octree's cubes around a walking robot change with each scan, at times nearly all.
class GroundReadings {
 public:
  static constexpr float cell_m = 0.05F;  ///< of the flood's grid: half a narrow foot
  /// For ground up to `highest_ground`. `view` and `layout` must outlive it.
  GroundReadings(const GroundView& view, const Eigen::Isometry3d& T_map_patch, const PatchLayout& layout,
                 float highest_ground);

  std::size_t cells() const { return first_.size() - 1; }
  Eigen::Vector2f middle(std::size_t cell) const {
    const auto columns = static_cast<std::size_t>(size_.y());
    return low_ + cell_m * Eigen::Vector2f(static_cast<float>(cell / columns) + 0.5F,
                                           static_cast<float>(cell % columns) + 0.5F);
  }
  std::size_t cell_at(const Eigen::Vector2f& place) const { return index(array_at(place)); }
  /// Calls `visit` with the cells of a square of `reach` cells to each side.
  template <class Visit>
  void for_each_near(std::size_t cell, int reach, const Visit& visit) const {
    const Eigen::Array2i at(static_cast<int>(cell) / size_.y(), static_cast<int>(cell) % size_.y());
    const Eigen::Array2i from = (at - reach).max(0), to = (at + reach).min(size_ - 1);
    for (int x = from.x(); x <= to.x(); ++x)
      for (int y = from.y(); y <= to.y(); ++y) visit(index({x, y}));
  }
  /// Of the highest surface below the base, or reading without one.
  float highest_below_base(std::size_t cell) const;
  /// `depth`: voxels that must be free where the ground is open; by default as in GroundPlane::depth().
  Look look(const Eigen::Vector2f& place, float ground, std::optional<float> depth = {}) const;
  /// A supported place becomes unsupported if the ground is open a voxel farther: edges are known to a voxel.
  Look without_edge(Look look, const Eigen::Vector2f& place) const;

 private:
  /// A surface's plane over the patch.
  struct PlaneOver {
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< patch's frame
    float offset = 0;                                  ///< normal · p = offset
    float slope_rad = no_height;                       ///< of the surface
    bool level = false;                                ///< one can stand on it
    SurfaceId id = 0;
    float depth = 0;                                   ///< voxels that must be free where it is open
    Eigen::Vector3f height = Eigen::Vector3f::Zero();  ///< of a level plane: height · (x, y, 1)
  };

  /// The reading of an occupied voxel, in the patch's frame.
  struct Reading {
    Eigen::Vector2f place = Eigen::Vector2f::Zero();
    float height = 0;
    std::uint32_t plane = 0;  ///< index; 0: pending
  };

  std::size_t index(const Eigen::Array2i& at) const {
    return static_cast<std::size_t>(at.x() * size_.y() + at.y());
  }
  Eigen::Array2i array_at(const Eigen::Vector2f& place) const {
    return ((place - low_) * (1 / cell_m)).array().cast<int>();  // toward zero
  }
  void add(const occupancy::Cube& cube);
  void sort_by_cell();
  /// Index; 0 of none.
  std::uint32_t plane_of(SurfaceId id) {
    std::pair<SurfaceId, std::uint32_t>& at_hand = at_hand_[id % at_hand_.size()];
    if (at_hand.first != id) at_hand = {id, find_plane(id)};
    return at_hand.second;
  }
  std::uint32_t find_plane(SurfaceId id);
  struct LevelPlane;
  struct Around;
  Around around(const Eigen::Vector2f& place, float ground) const;
  const LevelPlane* ground_of(const Around& found) const;
  bool is_free(const Eigen::Vector2f& place, float height, bool or_occupied = false) const;
  bool is_open(const Eigen::Vector2f& place, float height, float depth) const;

  const GroundView& view_;
  const PatchLayout& layout_;
  Eigen::Isometry3d T_map_patch_;
  Eigen::Isometry3f T_patch_map_;
  float d_, covered_, bridged_, reach_;
  int aside_of_;                                  // GroundPlane::aside()
  std::array<std::array<float, 64>, 3> in_cube_;  // corners of a cube's voxels, in 256 parts of an edge
  Eigen::Matrix3f per_part_;                      // of 256 parts of a voxel's edge
  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  Eigen::Array2i size_ = Eigen::Array2i::Zero();
  std::vector<PlaneOver> planes_{{}};
  std::vector<std::pair<SurfaceId, std::uint32_t>> known_;         // ascending
  std::array<std::pair<SurfaceId, std::uint32_t>, 64> at_hand_{};  // of known_, by id
  std::vector<Reading> readings_;                                  // by cell
  std::vector<std::uint32_t> cell_of_;                             // of each, while they are read
  std::vector<std::uint32_t> first_;                               // of each cell, and the end
};

}  // namespace octosurf::planning
