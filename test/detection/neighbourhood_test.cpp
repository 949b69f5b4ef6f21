// What of the map is labelled anew around a change, and what only stands beside it.
#include "detection/neighbourhood.hpp"

#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"
#include "sensing/reading_code.hpp"
#include "support/pending_points.hpp"
#include "support/scene.hpp"

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

/// A floor that is a surface but for a tenth of its points, and a board that stands on it and is pending.
class FloorAndBoard {
 public:
  FloorAndBoard() : rng_(test::rng()), points_({scan(rng_)}) {
    surfaces::SurfaceModel& floor = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {1, 1, 0});
    id_ = floor.id();
    for (const PointId i : points_.all) {
      if (on_board(i))
        board_.push_back(i);
      else if (rng_() % 10 != 0)
        points_.ledger.give(i, floor);
    }
  }

  static Scan scan(std::mt19937_64& rng) {
    test::Scene scene;
    scene.rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
    scene.rectangle({0.5, 0.5, 0}, {0.4, 0, 0}, {0, 0, 0.3});
    return test::camera_scan(scene, test::look_at({1.2, 1.2, 1.8}, {0.8, 0.8, 0}), rng);
  }
  bool on_board(PointId i) const { return points_.position(i).z() > 0.03; }

  Neighbourhood around() const { return neighbourhood_of(points_.ledger, board_); }
  Readings readings_of(const Neighbourhood& around) const { return {points_.ledger, around}; }

  std::mt19937_64 rng_;
  test::PendingPoints points_;
  SurfaceId id_ = 0;
  std::vector<PointId> board_;
};

TEST(Neighbourhood, ContextAreTheInliersAround) {
  const FloorAndBoard scene;
  const Neighbourhood around = scene.around();
  EXPECT_FALSE(around.context.empty());
  EXPECT_FALSE(around.boundary.empty());
  const std::set<PointId> looked_at(around.points.begin(), around.points.end());
  std::set<PointId> beside;
  for (const auto& part : {around.context, around.boundary})
    for (const PointId i : part) {
      EXPECT_EQ(scene.points_.ledger.window[i].surface, scene.id_);
      beside.insert(i);
    }
  EXPECT_EQ(looked_at.size() + beside.size(),
            around.points.size() + around.context.size() + around.boundary.size());
  for (const PointId i : scene.board_) EXPECT_TRUE(looked_at.contains(i));
  for (const PointId i : beside) EXPECT_FALSE(looked_at.contains(i));
}

TEST(Neighbourhood, WhatWasPendingAroundJoinsAndSeedsNoPlane) {
  const FloorAndBoard scene;
  const surfaces::Ledger& ledger = scene.points_.ledger;
  const auto is_pending = [&](PointId i) { return ledger.window[i].surface == 0; };
  Neighbourhood around = scene.around();
  EXPECT_FALSE(around.may_join.empty());
  EXPECT_TRUE(std::all_of(around.may_join.begin(), around.may_join.end(), is_pending));
  // Were the board's points there only to join, nothing would seed it; the floor takes in what is its own.
  const auto planes_of = [&](const Neighbourhood& looked_at) {
    const Readings readings = scene.readings_of(looked_at);
    return segment(readings, limits_of(ledger.parameters),
                   with_seed_patches(readings, known_about(readings, ledger.surfaces, {})))
        .patches.size();
  };
  const std::size_t planes = planes_of(around);
  const auto first_pending = std::stable_partition(around.points.begin(), around.points.end(),
                                                   [&](PointId i) { return !is_pending(i); });
  around.may_join.insert(around.may_join.end(), first_pending, around.points.end());
  around.points.erase(first_pending, around.points.end());
  EXPECT_EQ(planes_of(around) + 1, planes);
}

TEST(Neighbourhood, WhatIsKnownOfASurfaceIsAllOfIt) {
  const FloorAndBoard scene;
  const Readings readings = scene.readings_of(scene.around());
  const Segmentation known = known_about(readings, scene.points_.ledger.surfaces, {});
  const surfaces::SurfaceModel& floor = *scene.points_.ledger.surfaces.find(scene.id_);
  ASSERT_EQ(known.outside.size(), 1U);
  std::size_t inside = 0;
  for (Index i = 0; i < readings.size(); ++i) inside += readings[i].surface == scene.id_;
  EXPECT_EQ(static_cast<double>(inside) + known.outside.front().sums.readings,
            static_cast<double>(floor.size()));
  const auto sums_of = [&](const Readings& some, Patch sums) {
    for (Index i = 0; i < some.size(); ++i)
      if (some[i].surface == scene.id_) some.add_to(sums, i);
    return sums;
  };
  Patch nothing;
  nothing.plane = floor.plane();
  const Patch whole = sums_of(readings, known.outside.front().sums);
  const Patch expected = sums_of(Readings(scene.points_.ledger), nothing);
  // What is not among the readings weighs as those of its class of distance do, on the mean.
  EXPECT_NEAR(whole.moments.count / expected.moments.count, 1, 0.05);
  const Eigen::Vector3d off = whole.centroid() - expected.centroid();
  EXPECT_NEAR(off.z(), 0, 1e-3);
  EXPECT_LT(off.norm(), 0.1);  // a twentieth of the floor's edge
}

/// Readings of the plane x = 0 at y from `from` to `to` and z within a metre, with `sigma` of noise along the
/// rays.
Scan wall_scan(const Eigen::Vector3d& eye, double from, double to, double sigma, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, sigma);
  Scan scan;
  scan.T_map_sensor.translation() = eye;
  for (double y = from; y < to; y += 0.018)
    for (double z = -1; z < 1; z += 0.018) {
      const Eigen::Vector3d ray = Eigen::Vector3d(0, y, z) - eye;
      scan.points.push_back((ray * (1 + gauss(rng) / ray.norm())).cast<float>());
    }
  return scan;
}

// A wall seen head-on from 4 m, and its end along the wall: the noise of all the wall was taken to be as
// small as that of its end, off the plane, and the wall for none.
TEST(Neighbourhood, WhatIsKnownElsewhereMayHaveBeenSeenMoreHeadOn) {
  std::mt19937_64 rng = test::rng();
  constexpr double sigma = 0.015;
  Parameters parameters;
  parameters.surfaces.sensor_noise = 0.003;
  parameters.surfaces.range_noise = (sigma - 0.003) / 16;
  test::PendingPoints points(
      {wall_scan({4, 0, 0}, -1, 1, sigma, rng), wall_scan({0.25, 5, 0}, 1.02, 1.5, sigma, rng)}, parameters);
  surfaces::Ledger& ledger = points.ledger;
  surfaces::SurfaceModel& wall = ledger.create({Eigen::Vector3d::UnitX(), 0}, {0, 0, 0});
  for (const PointId i : points.all) ledger.give(i, wall);
  std::vector<PointId> end;
  for (const PointId i : points.all)
    if (points.position(i).y() > 1.3) end.push_back(i);
  const Readings readings(ledger, neighbourhood_of(ledger, end));
  const Segmentation known = known_about(readings, ledger.surfaces, {});
  ASSERT_EQ(known.outside.size(), 1U);
  const Patch& elsewhere = known.outside.front().sums;
  EXPECT_GT(elsewhere.readings, 0.75 * static_cast<double>(wall.size()));
  // Each explains the logarithm of its density over clutter's, less the mean of half a squared deviation.
  const double head_on = readings.model().log_peak(sensing::range_class_of(4), 1) - 0.5;
  EXPECT_NEAR(elsewhere.explained_by(wall.plane()) / elsewhere.readings, head_on, 0.5);
}

TEST(Neighbourhood, ContextKeepsItsLabelAndIsThereToBeMet) {
  const FloorAndBoard scene;
  const Neighbourhood around = scene.around();
  const Readings readings = scene.readings_of(around);
  ASSERT_LT(readings.size(), readings.size_with_context());
  const Segmentation found =
      segment(readings, limits_of(scene.points_.ledger.parameters),
              with_seed_patches(readings, known_about(readings, scene.points_.ledger.surfaces, {})));
  ASSERT_EQ(found.labels.size(), readings.size_with_context());
  ASSERT_EQ(found.outside.size(), 1U);
  const Label floor = found.outside.front().label;
  ASSERT_NE(floor, clutter);
  std::set<Label> of_board;
  std::size_t were_pending = 0;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const Eigen::Vector3f& at = readings[i].position;
    if (readings.is_context(i)) {
      EXPECT_EQ(found.labels[i], floor);
    } else if (at.z() > 0.1F) {
      of_board.insert(found.labels[i]);
    } else if (!readings.at_border(i) && std::fabs(at.y() - 0.5F) > 0.04F) {  // nor along the edge of the two
      EXPECT_EQ(found.labels[i], floor) << at.transpose();
      were_pending += readings[i].surface == 0;
    }
  }
  EXPECT_GT(were_pending, 0U);
  of_board.erase(clutter);  // rays that its edge parted
  EXPECT_EQ(of_board.size(), 1U);
  EXPECT_FALSE(of_board.contains(floor));
}

}  // namespace
}  // namespace octosurf::detection
