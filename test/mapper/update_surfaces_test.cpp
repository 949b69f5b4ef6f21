// Which points a change leaves to the next one.
#include "mapper/map_change.hpp"
#include "support/pending_points.hpp"

namespace octosurf::mapper {
namespace {

using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

const Eigen::Vector3d eye(0.5, 0.5, 2);

/// A floor with stray readings above it, all of them inliers of its surface.
class FloorWithStrays : public test::PendingPoints {
 public:
  FloorWithStrays()
      : PendingPoints({test::rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}), strays()}) {
    surfaces::SurfaceModel& floor = ledger.create({Eigen::Vector3d::UnitZ(), 0.01}, {0.5, 0.5, 0.01});
    for (const PointId i : all) {
      ledger.give(i, floor);
      if (position(i).z() > 0.1) above.push_back(ledger.window[i].key);
    }
  }

  void update(Effort effort) {
    ScanReport report;
    update_surfaces(ledger, detection::detector_of(state.parameters, nullptr), effort, 1, report);
    for (const PointId i : all) EXPECT_EQ(ledger.window[i].surface == 0, position(i).z() > 0.1);
    EXPECT_THAT(ledger.changes.unprocessed, IsEmpty());
  }

  std::vector<geometry::VoxelKey> above;  ///< voxels of stray readings, in key order

 private:
  static Scan strays() {
    Scan scan;
    scan.T_map_sensor.translation() = eye;
    for (int k = 0; k < 5; ++k)
      scan.points.emplace_back(0.15F * static_cast<float>(k) - 0.3F, 0.1F,
                               0.2F * static_cast<float>(k % 3) - 1.7F);
    return scan;
  }
};

TEST(UpdateSurfaces, PointsThatSegmentationTakesFromASurfaceWaitOnce) {
  for (const Effort effort : {Effort::turn, Effort::all}) {
    FloorWithStrays scene;
    ASSERT_EQ(scene.above.size(), 5U);
    scene.ledger.requeue(scene.ledger.window.find(scene.above.front()));  // this one was pending before, too
    scene.update(effort);
    EXPECT_THAT(scene.state.queue.fresh, ElementsAreArray(scene.above));
  }
}

TEST(UpdateSurfaces, RequeuedPointsThatASurfaceTakesDoNotWait) {
  FloorWithStrays scene;
  for (std::size_t k = 0; k < scene.all.size(); k += 50) scene.ledger.requeue(scene.all[k]);
  scene.update(Effort::turn);
  EXPECT_THAT(scene.state.queue.fresh, ElementsAreArray(scene.above));
}

TEST(UpdateSurfaces, NoPointWaitsAfterAllHaveBeenSegmentedAnew) {
  FloorWithStrays scene;
  scene.state.queue.fresh = scene.above;
  scene.state.queue.blocks = {scene.above.front()};
  scene.update(Effort::anew);
  EXPECT_EQ(scene.state.queue, surfaces::PendingQueue{});
}

}  // namespace
}  // namespace octosurf::mapper
