// Where a surface is no longer one plane, by sums over its tiles, beside segmenting its readings.
#include "detection/tiles.hpp"

#include "detection/neighbourhood.hpp"
#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"
#include "support/pending_points.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <set>

namespace octosurf::detection {
namespace {

/// All readings of a scene, held to be one level surface.
class OneSurface {
 public:
  explicit OneSurface(const test::Scene& scene) : rng_(test::rng()), points_({scan_of(scene, rng_)}) {
    surfaces::SurfaceModel& floor = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {1, 1, 0});
    for (const PointId i : points_.all) points_.ledger.give(i, floor);
    floor.set_plane(
        geometry::fitted_plane(floor.moments(nullptr), floor.reference(), Eigen::Vector3d::UnitZ()));
    floor_ = &floor;
  }

  std::vector<geometry::VoxelKey> disagree() const {
    return where_tiles_disagree(*floor_, sensing::ReadingModel(points_.state.noise, 0.02));
  }
  std::size_t size() const { return floor_->size(); }
  Eigen::Vector3d position(geometry::VoxelKey key) const {
    return points_.position(points_.ledger.window.find(key));
  }
  /// The twin: how many planes with a tenth of the readings each there are if none has a label.
  std::size_t planes() const {
    const std::vector<SurfaceId> all{floor_->id()};
    const Readings readings(points_.ledger, neighbourhood_of(points_.ledger, {}, all));
    const Segmentation found =
        segment(readings, limits_of(points_.ledger.parameters),
                with_seed_patches(readings, known_about(readings, points_.ledger.surfaces, all)));
    std::vector<std::size_t> counts(found.patches.size(), 0);
    for (Readings::Index i = 0; i < readings.size(); ++i) ++counts[found.labels[i]];
    return static_cast<std::size_t>(
        std::count_if(counts.begin() + 1, counts.end(), [&](std::size_t n) { return 10 * n > size(); }));
  }

 private:
  static Scan scan_of(const test::Scene& scene, std::mt19937_64& rng) {
    return test::camera_scan(scene, test::look_at({1, 1, 2.2}, {1, 1.01, 0}), rng);
  }

  std::mt19937_64 rng_;
  test::PendingPoints points_;
  surfaces::SurfaceModel* floor_ = nullptr;
};

TEST(Tiles, OfAFloorAgree) {
  const OneSurface floor(test::Scene().rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0}));
  ASSERT_GT(floor.size(), 3000U);
  EXPECT_EQ(floor.planes(), 1U);
  EXPECT_LT(floor.disagree().size(), floor.size() / 50) << "some tiles by chance";
}

TEST(Tiles, DisagreeWhereAPlateLiesOnTheFloor) {
  const OneSurface floor(test::Scene()
                             .rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0})
                             .rectangle({0.6, 0.6, 0.03}, {0.4, 0, 0}, {0, 0.4, 0}));
  const auto on_plate = [&](const Eigen::Vector3d& p) {
    return p.x() > 0.62 && p.x() < 0.98 && p.y() > 0.62 && p.y() < 0.98;
  };
  const std::vector<geometry::VoxelKey> disagree = floor.disagree();
  std::size_t of_plate = 0;
  for (const geometry::VoxelKey key : disagree) of_plate += on_plate(floor.position(key));
  EXPECT_GT(of_plate, 18U * 18U * 3 / 4) << "of 18 × 18 voxels";
  EXPECT_LT(disagree.size(), floor.size() / 3);
}

/// The twin finds two planes, or one; the tiles disagree, or do not.
TEST(Tiles, OfAFoldedPlateDisagreeWhereSegmentingFindsTwoPlanes) {
  std::set<std::size_t> seen;
  for (const double degrees : {0.0, 4.0, 8.0, 12.0}) {
    const double rise = std::tan(degrees * std::numbers::pi / 180);
    const OneSurface fold(test::Scene()
                              .rectangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0})
                              .rectangle({1, 0, 0}, {1, 0, rise}, {0, 2, 0}));
    const std::size_t planes = fold.planes();
    seen.insert(planes);
    EXPECT_EQ(10 * fold.disagree().size() > fold.size(), planes > 1) << degrees;
  }
  EXPECT_EQ(seen, (std::set<std::size_t>{1, 2}));
}

}  // namespace
}  // namespace octosurf::detection
