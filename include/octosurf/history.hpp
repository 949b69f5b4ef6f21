#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// A surface as it was at some revision: what it takes to draw it.
struct PastSurface {
  SurfaceId id = 0;                                                 ///< as Surface::id
  std::uint64_t born = 0;                                           ///< as Surface::born
  std::uint64_t revision = 0;                                       ///< of its last change until then
  std::array<float, 3> color{};                                     ///< as Surface::color
  Eigen::Isometry3d T_map_surface = Eigen::Isometry3d::Identity();  ///< as Surface::T_map_surface
  double area_m2 = 0;       ///< of the polygons before they were simplified
  std::size_t inliers = 0;  ///< voxels
  /// To look at: simplified so that no vertex that was left out lies farther than d/2 from the outline, in
  /// whole steps of 0.1 mm; unlike a Surface's, their rings may meet.
  std::vector<Polygon> polygons;
};

/// Shared by all moments between two changes of the surface.
using PastSurfacePtr = std::shared_ptr<const PastSurface>;

/// All surfaces and cylinders of a map at one revision.
struct Moment {
  std::uint64_t revision = 0;            ///< of the map
  double stamp_s = 0;                    ///< time stamp of the last scan, s
  std::vector<PastSurfacePtr> surfaces;  ///< ascending id
  std::vector<CylinderPtr> cylinders;    ///< ascending id
};

/// What one moment has that the one before it has not.
struct MomentChanges {
  std::vector<PastSurfacePtr> surfaces;    ///< appeared or changed
  std::vector<SurfaceId> gone;             ///< were there, and are no more
  std::vector<CylinderPtr> cylinders;      ///< likewise
  std::vector<CylinderId> cylinders_gone;  ///< likewise
};

/// `before`: nullptr for a map without surfaces.
MomentChanges changes_of(const Moment* before, const Moment& now);

/// How a map's surfaces came, changed and went, in at most `most_moments` moments, however long the run: when
/// there are more, every other one is dropped, and from then on twice as many revisions lie between two.
///
/// 1. Same snapshots, same moments. Those that remain are as they were when they were added.
/// 2. It takes some 40 MB at most, unless one moment alone takes more: moments are dropped, too, when there
///    are more than `most_entries` vertices, and surfaces in moments, altogether.
class History {
 public:
  static constexpr std::size_t most_moments = 256;        ///< that are kept
  static constexpr std::size_t most_entries = 2'000'000;  ///< see 2

  /// Takes note of the snapshot, if enough revisions have passed and a surface or cylinder is not what it
  /// was. O(surfaces), and O(n log n) in vertices of those that have changed: some 0.03 ms for 1000.
  void add(const Snapshot& snapshot, double stamp_s);

  const std::vector<Moment>& moments() const { return moments_; }  ///< ascending revision
  std::uint64_t stride() const { return stride_; }                 ///< least revisions between two moments

  /// Drops every other moment, the first one stays.
  void thin();
  /// Drops what is later than this revision.
  void forget_after(std::uint64_t revision);
  /// Whether this can be the map's: all that it has until the map's revision, the map has or has had, by id
  /// and revision of birth.
  bool belongs_to(const Snapshot& snapshot) const;

  /// Of moments with ascending revisions; thinned until the bounds are kept.
  static History of(std::vector<Moment> moments, std::uint64_t stride);

 private:
  void keep_bounds();
  void count_entries();

  std::vector<Moment> moments_;
  std::uint64_t stride_ = 1;
  std::size_t entries_ = 0;
};

/// Writes it (src/io/map_file/history_file.hpp describes the file), complete or not at all. Same history,
/// same bytes. Throws Error(usage) if the file exists and not `force`, Error(output).
void save_history(const History& history, const std::filesystem::path& file, bool force);

/// Throws Error(data) for whatever is not a whole history, never anything worse.
History load_history(const std::filesystem::path& file);

}  // namespace octosurf
