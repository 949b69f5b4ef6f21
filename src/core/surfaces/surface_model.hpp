#pragma once

#include "surfaces/plane_estimate.hpp"
#include "surfaces/surface_outline.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace octosurf::surfaces {

class SurfaceStore;

/// The working form of a surface: its inliers in a hash over its plane, the plane with the sums that it
/// follows from, and the outline.
class SurfaceModel : public PlaneEstimate, public SurfaceOutline {
 public:
  SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution);

  SurfaceId id() const { return id_; }
  /// Of more than a thousand, the first and the last ones stay: a floor takes in fragments for months, and
  /// removals say, too, what took them in.
  void add_parent(SurfaceId id);
  const std::vector<SurfaceId>& parents() const { return parents_; }

  void add(const Inlier& inlier);
  /// `position` must be the one it was added with. False if it is not an inlier.
  bool remove(geometry::VoxelKey key, const Eigen::Vector3f& position);
  /// Rebuilds the hash in the current pose if the normal differs from the hash frame's by over 1°.
  void rehash_if_tilted();

  /// Updates polygons() to inliers and pose: the alpha shape of the sites (SurfaceOutline), with `noise` also
  /// boundary points, and with `others` also intersections with these. Cost follows the inliers added and
  /// removed near the boundary, plus the length of the rings, and of the boundary where others are near, and
  /// some 0.2 µs for each 64 occupied cells. All sites are inserted anew after a load, a rehash, or a change
  /// of the noise by 1 mm.
  ///
  /// 1. The result does not depend on earlier calls.
  /// 2. A vertex lies within sin 1° of its inlier's distance from the plane beside its projection, its end
  ///    point or its intersection with another surface, and within half an Outline::quantum of a cell; sides
  ///    are at most `max_hole_size` long.
  void derive(double max_hole_size, const sensing::NoiseModel* noise = nullptr,
              const SurfaceStore* others = nullptr);
  /// What derive() does after update_raster(), but polygons_with(), which may be left to a reader; there are
  /// no polygons() then. It reads the raster of `others` and changes no shared data: after update_raster()
  /// has run for all, threads may run it in parallel.
  OutlineChange take_outline_change(double max_hole_size, const SurfaceStore* others);
  /// Outline points to (u, v) in the surface's frame, along the hash frame's normal.
  Eigen::Affine2d T_surface_outline() const;

  /// The immutable form for readers.
  SurfacePtr publish(std::uint64_t revision) const;

  /// For map files, with what add() and set_plane() cannot restore.
  struct State : PlaneEstimate::State {
    SurfaceId id = 0;
    Eigen::Isometry3d hash_frame = Eigen::Isometry3d::Identity();
    std::vector<Inlier> inliers;  ///< key order
    std::vector<Polygon> polygons;
    bool polygons_stale = false;
    std::vector<SurfaceId> parents;
    std::uint64_t born = 0, revision = 0, checked_size = 0;
  };
  /// `published`: the map's complete snapshot, which has the polygons; null: they are polygons().
  State state(const Snapshot* published = nullptr) const;
  /// The same without inliers and polygons, O(1): for callers that have those already.
  State head() const;
  SurfaceModel(const State& state, double resolution);

  /// Records that the whole surface was segmented.
  void set_checked() { checked_size = size(); }
  /// Whether it has doubled, or lost a third, since the whole surface was segmented. Temporary changes, as in
  /// the tails of the noise, do not count.
  bool size_has_changed() const {
    return 2 * (std::max(size(), checked_size) - std::min(size(), checked_size)) >= size();
  }

  std::uint64_t born = 0;          ///< map revision in which it was first published
  std::uint64_t revision = 0;      ///< map revision of the last published change
  std::uint64_t checked_size = 0;  ///< inliers when the whole surface was last segmented

 private:
  SurfaceId id_;
  std::vector<SurfaceId> parents_;
};

/// Distinct by construction: the hue advances by the golden ratio with the id.
std::array<float, 3> color_of(SurfaceId id);

}  // namespace octosurf::surfaces
