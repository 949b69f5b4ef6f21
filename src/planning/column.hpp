#pragma once

#include "occupancy/cubes.hpp"
#include "planning/cell_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The parts of a surface's plane that its ground depends on.
struct GroundPlane {
  SurfaceId id = 0;
  double d = 0;  ///< of the map, m
  double rms_m = 0;
  Eigen::Isometry3d T_map_plane = Eigen::Isometry3d::Identity();  ///< z along the normal

  /// m: to which depth a void must be free. Three voxels, because with poses off by a voxel, rays along a
  /// plane free two.
  double depth() const { return std::max(2.5 * d, 3 * rms_m + d / 2); }
  /// Cells of d by which a void is wider than what is open: along slanted rays, to its depth. Their least
  /// angle to the plane is 30°: others run along it.
  int aside() const { return static_cast<int>(std::floor(std::numbers::sqrt3 * depth() / d)); }
  bool operator==(const GroundPlane& other) const {
    return id == other.id && d == other.d && rms_m == other.rms_m &&
           T_map_plane.matrix() == other.T_map_plane.matrix();
  }
};

/// The voxels straight before and behind places of a plane, copied from the octree so that reading one takes
/// some ns.
class Columns {
 public:
  /// `part`: in the plane's frame. Places outside read as unknown.
  Columns(const OccupancyView& octree, const GroundPlane& plane, const Eigen::AlignedBox2d& part);

  /// State of a place. Without a reading of the surface within two voxels of its plane:
  struct Seen {
    bool reading = false;
    bool free = false;     ///< on the plane
    bool open = false;     ///< and behind it, to the depth or to another surface
    bool blocked = false;  ///< something else stands there
    bool passed = false;   ///< rays went by close before the plane: nothing hid it from them
  };
  Seen at(const Eigen::Vector2d& uv) const;
  /// Free on the plane and behind it, whatever lies beside.
  bool open_through(const Eigen::Vector2d& uv) const {
    const Eigen::Vector3d place = place_of(uv);
    return content(place) == Content::free && is_open(place);
  }

 private:
  enum class Content : std::uint8_t { unknown, free, own, other, pending };

  void copy(const occupancy::Cube& cube);
  bool is_open(const Eigen::Vector3d& place) const;
  /// In voxels, from the lowest one held.
  Eigen::Vector3d place_of(const Eigen::Vector2d& uv) const {
    return origin_ + uv.x() * along_u_ + uv.y() * along_v_;
  }
  Content content(const Eigen::Vector3d& place, double height = 0) const;

  GroundPlane plane_;
  Eigen::Vector3d origin_, along_u_, along_v_, along_normal_;
  Eigen::Array3i low_ = Eigen::Array3i::Zero();     // key of the lowest voxel, a multiple of 4
  Eigen::Array3i bricks_ = Eigen::Array3i::Zero();  // of 4³ voxels
  double thickness_ = 0;                            // voxels copied to either side
  std::vector<Content> contents_;                   // brick by brick, in each in Morton order
};

/// Marks where a surface's outline, which closes gaps narrower than h, spans a void.
///
/// 1. Evidence are places of the plane that a ray passed: where it crossed the plane on its way to a reading
///    behind it, of another surface or of none, within the stored view's error; and places that are open
///    (Columns::open_through()).
/// 2. The void is the union of the discs that hold such a place and no reading of the surface: how far it
///    extends between them is unknown. Discs from 1.5 voxels on count, about cells inside the outline.
///
/// The voids are marked in `cells`, a raster of edge d/2, half a cell larger, so that they end at their
/// readings. Cells more than void_reach from its border are as in any larger raster. Cost: the
/// occupied voxels close behind the plane; where there is evidence also its readings, some 50 ns each, and
/// 1 µs for each cell without readings about it.
void mark_voids(const GroundPlane& plane, const OccupancyView& octree, const Columns& columns,
                const CellRaster& cells, const Mask& inside, Mask& voids);

/// Voxels: reach along the plane of the voxels that a place depends on: of the surface or free ones; and of
/// those behind the plane, whose rays slant.
inline constexpr double void_reach = 18, slanted_reach = 11;
/// Voxels behind the plane: deeper readings are no evidence.
inline constexpr double deepest_evidence = 21.5;

}  // namespace octosurf::planning
