#include "law/segment.hpp"

#include "detection/pending_points.hpp"
#include "law/labelling.hpp"
#include "support/round_scene.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace octosurf::law {
namespace {

using test::PendingPoints;

/// What the law finds in scans.
struct Found {
  explicit Found(const std::vector<Scan>& scans)
      : points(scans, parameters()),
        readings((observe(points.state.noise, scans), points.state.occupancy), points.ledger.window,
                 points.state.noise),
        segmentation(segment(readings, {})) {}

  /// σ is 2 mm, told.
  static Parameters parameters() {
    Parameters told;
    told.surfaces.sensor_noise = 0.002;
    told.surfaces.range_noise = 0;
    return told;
  }
  static void observe(NoiseModel& noise, const std::vector<Scan>& scans) {
    for (const Scan& scan : scans) noise.observe(scan);
  }

  std::size_t planes() const { return segmentation.patches.size() - 1; }
  std::size_t readings_of(Label label) const {
    return static_cast<std::size_t>(
        std::count(segmentation.labels.begin(), segmentation.labels.end(), label));
  }
  /// The plane nearest to this one: normals within 2°, offset within 5 mm there; clutter if there is none.
  Label find(const Eigen::Vector3d& normal, const Eigen::Vector3d& at) const {
    for (Label label = 1; label <= planes(); ++label) {
      const Plane& plane = segmentation.patches[label].plane;
      if (plane.normal.dot(normal) > 0.9994 && std::fabs(plane.signed_distance(at)) < 0.005) return label;
    }
    return clutter;
  }

  PendingPoints points;
  Readings readings;
  Segmentation segmentation;
};

Scan look(const auto& scene, const Eigen::Vector3d& eye, const Eigen::Vector3d& at, std::mt19937_64& rng) {
  return test::camera_scan(scene, test::look_at(eye, at), rng);
}

TEST(Segment, FindsEachSideOfACornerOnce) {
  std::mt19937_64 rng = test::rng();
  test::Scene corner;
  corner.rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
  corner.rectangle({0, 0, 0}, {2, 0, 0}, {0, 0, 2});
  corner.rectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  const Found found({look(corner, {1.5, 1.5, 1.5}, {0.3, 0.3, 0.3}, rng)});
  EXPECT_EQ(found.planes(), 3U);
  std::size_t labelled = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Label label = found.find(Eigen::Vector3d::Unit(axis), Eigen::Vector3d::Zero());
    EXPECT_NE(label, clutter) << axis;
    labelled += found.readings_of(label);
  }
  EXPECT_GT(labelled, found.readings.size() * 98 / 100);
}

TEST(Segment, TellsAStepFromASlab) {
  std::mt19937_64 rng = test::rng();
  test::Scene step;
  step.rectangle({-1, -1, 0}, {1, 0, 0}, {0, 2, 0});
  step.rectangle({0, -1, 0.04}, {1, 0, 0}, {0, 2, 0});
  const Found found({look(step, {0.2, 0, 1.5}, {0, 0, 0}, rng)});
  EXPECT_NE(found.find(Eigen::Vector3d::UnitZ(), {-0.5, 0, 0}), clutter);
  EXPECT_NE(found.find(Eigen::Vector3d::UnitZ(), {0.5, 0, 0.04}), clutter);
  EXPECT_EQ(found.planes(), 2U);
}

TEST(Segment, APillarHasNoFacets) {
  std::mt19937_64 rng = test::rng();
  test::RoundScene scene;
  scene.flat.rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  scene.bars.push_back({{0, 0, 0}, {0, 0, 1.2}, 0.12});
  std::vector<Scan> scans;
  for (int k = 0; k < 4; ++k) {
    const double turn = 0.5 * k;
    scans.push_back(look(scene, {1.4 * std::cos(turn), 1.4 * std::sin(turn), 1}, {0, 0, 0.5}, rng));
  }
  const Found found(scans);
  EXPECT_NE(found.find(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero()), clutter);
  EXPECT_EQ(found.planes(), 1U);
}

TEST(Segment, ABallAndABushAreClutter) {
  std::mt19937_64 rng = test::rng();
  test::RoundScene scene;
  scene.balls.push_back({{0, 0, 0}, 0.3});
  const Found ball({look(scene, {1.2, 0, 0.2}, {0, 0, 0}, rng)});
  EXPECT_EQ(ball.planes(), 0U);

  std::uniform_real_distribution<double> anywhere(-0.3, 0.3);
  Scan bush;
  bush.T_map_sensor.translation() = Eigen::Vector3d(3, 0, 0);
  for (int k = 0; k < 4000; ++k) bush.points.emplace_back(anywhere(rng) - 3, anywhere(rng), anywhere(rng));
  EXPECT_EQ(Found({bush}).planes(), 0U);
}

TEST(Segment, JoinsAcrossWhatHidesAStripButNotAcrossABoard) {
  std::mt19937_64 rng = test::rng();
  test::Scene parted;  // a wall with a slit of 5 cm
  parted.rectangle({0, -1, 0}, {0, 0.975, 0}, {0, 0, 1.5});
  parted.rectangle({0, 0.025, 0}, {0, 0.975, 0}, {0, 0, 1.5});
  EXPECT_EQ(Found({look(parted, {1.6, 0, 0.7}, {0, 0, 0.7}, rng)}).planes(), 1U);

  test::Scene shelf;  // and with a board that stands out of it instead
  shelf.rectangle({0, -1, 0}, {0, 0.975, 0}, {0, 0, 1.5});
  shelf.rectangle({0, 0.025, 0}, {0, 0.975, 0}, {0, 0, 1.5});
  shelf.box({0, -0.025, 0}, {0.3, 0.025, 1.5});
  const Found found(
      {look(shelf, {1.6, 0.6, 0.7}, {0, 0, 0.7}, rng), look(shelf, {1.6, -0.6, 0.7}, {0, 0, 0.7}, rng)});
  std::size_t on_wall = 0;
  for (Label label = 1; label <= found.planes(); ++label)
    on_wall += found.segmentation.patches[label].plane.normal.x() > 0.99 &&
               std::fabs(found.segmentation.patches[label].plane.offset) < 0.01;
  EXPECT_EQ(on_wall, 2U);
}

TEST(Segment, LabelsAreAtRest) {
  std::mt19937_64 rng = test::rng();
  test::Scene room;
  room.box({-1, -1, 0}, {1, 1, 2});
  const Found found(
      {look(room, {0.5, 0.5, 1.5}, {-1, -1, 0}, rng), look(room, {0.5, 0, 1.5}, {-1, 0.5, 0.5}, rng)});
  std::vector<Label> labels = found.segmentation.labels;
  relabel(found.readings, found.segmentation.patches, labels);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) moved += labels[i] != found.segmentation.labels[i];
  EXPECT_LE(moved, labels.size() / 1000);  // planes were fitted to them once more
}

TEST(Segment, SameReadingsSamePlanes) {
  test::Scene room;
  room.box({-1, -1, 0}, {1, 1, 2});
  const auto once = [&] {
    std::mt19937_64 rng = test::rng();
    return Found({look(room, {0.5, 0.5, 1.5}, {-1, -1, 0}, rng)});
  };
  const Found a = once(), b = once();
  EXPECT_EQ(a.segmentation.labels, b.segmentation.labels);
  ASSERT_EQ(a.planes(), b.planes());
  for (Label label = 1; label <= a.planes(); ++label)
    EXPECT_EQ(a.segmentation.patches[label].plane.offset, b.segmentation.patches[label].plane.offset);
}

}  // namespace
}  // namespace octosurf::law
