// Scans that wait go in together: the octree as one by one, the surfaces as good.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/invariants.hpp"
#include "support/room_tour.hpp"

namespace octosurf::mapper {
namespace {

using test::leaves_of;
using test::pass_by;

test::Scene room() { return test::Scene().box({-1.5, -1.2, 0.01}, {1.5, 1.2, 2.0}); }
/// The box stands there at first, and is gone then: a voxel that was hit three times is free after seven
/// misses.
std::vector<Scan> box_goes(std::mt19937_64& rng) {
  std::vector<Scan> scans = pass_by(test::room_with_a_box(), rng, 3);
  for (Scan& scan : pass_by(room(), rng, 8)) scans.push_back(std::move(scan));
  return scans;
}

Parameters as_given() {
  Parameters parameters;
  parameters.align = false;
  return parameters;
}

/// In groups of 1 to `most`.
void insert_in_groups(Mapper& mapper, std::span<const Scan> scans, std::mt19937_64& rng, std::size_t most) {
  while (!scans.empty()) {
    const std::size_t count = std::min<std::size_t>(1 + rng() % most, scans.size());
    ASSERT_EQ(mapper.insert_all(scans.first(count)).size(), count);
    EXPECT_TRUE(test::check_invariants(mapper.map()).empty()) << test::check_invariants(mapper.map()).front();
    scans = scans.subspan(count);
  }
}

TEST(InsertAll, TheOctreeIsTheOneOfOneByOne) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = box_goes(rng);
  Parameters parameters = as_given();
  parameters.occupancy.preserve_surfaces = false;  // else surfaces that are found earlier keep their voxels
  Mapper one_by_one(parameters), grouped(parameters), at_once(parameters);
  for (const Scan& scan : scans) one_by_one.insert(scan);
  insert_in_groups(grouped, scans, rng, 5);
  insert_in_groups(at_once, scans, rng, scans.size());
  const test::Leaves leaves = leaves_of(one_by_one.map());
  EXPECT_GT(leaves.size(), 1000U);
  EXPECT_TRUE(leaves_of(grouped.map()) == leaves);
  EXPECT_TRUE(leaves_of(at_once.map()) == leaves);
  EXPECT_EQ(grouped.map().size().points, one_by_one.map().size().points);
}

TEST(InsertAll, FindsTheSameFaces) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = pass_by(test::room_with_a_box(), rng, 12);
  test::CheckedMapper one_by_one(as_given()), grouped(as_given());
  for (const Scan& scan : scans) one_by_one.insert(scan);
  insert_in_groups(grouped.mapper, scans, rng, 6);
  const auto area_on = [](const test::CheckedMapper& mapper, const auto& normal, const auto& point) {
    double area = 0;
    for (const SurfacePtr& surface : mapper.on_plane(normal, point)) area += surface->area_m2;
    return area;
  };
  const std::pair<Eigen::Vector3d, Eigen::Vector3d> faces[] = {{{0, 0, 1}, {0, 0, 0.01}},
                                                               {{0, 0, 1}, {0.6, 0, 0.4}},
                                                               {{-1, 0, 0}, {0.3, 0, 0.2}},
                                                               {{-1, 0, 0}, {1.5, 0, 1}}};
  for (const auto& [normal, point] : faces) {
    const double area = area_on(one_by_one, normal, point);
    EXPECT_GT(area, 0.05) << point.transpose();
    // What was seen last may wait for its surface in one map and not in the other: a strip, no face.
    EXPECT_NEAR(area_on(grouped, normal, point), area, 0.1 * area) << point.transpose();
  }
  test::expect_guarantees(grouped.mapper.map());
}

TEST(InsertAll, WhatGoesAmongTheScansIsGone) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = box_goes(rng);
  test::CheckedMapper mapper(as_given());
  const std::vector<ScanReport> reports = mapper.mapper.insert_all(scans);
  ASSERT_EQ(reports.size(), scans.size());
  EXPECT_TRUE(test::check_invariants(mapper.mapper.map()).empty());
  EXPECT_TRUE(mapper.on_plane({0, 0, 1}, {0.6, 0, 0.4}).empty()) << "the box's top";
  EXPECT_FALSE(mapper.on_plane({0, 0, 1}, {0.6, 0, 0.01}).empty()) << "the floor";
  std::size_t appeared = 0, vanished = 0;
  for (const ScanReport& report : reports) {
    appeared += report.appeared;
    vanished += report.vanished;
    EXPECT_LE(report.categorized, report.appeared);
    if (&report != &reports.back()) {
      EXPECT_TRUE(report.born.empty());
    }
  }
  EXPECT_GT(vanished, 100U);
  EXPECT_EQ(mapper.mapper.map().size().points, appeared - vanished);
  for (const SurfacePtr& surface : mapper.surfaces()) {
    EXPECT_TRUE(std::ranges::count(reports.back().born, surface->id)) << surface->id;
  }
  EXPECT_EQ(mapper.mapper.snapshot()->revision, 1U) << "published once";
}

// The snapshot has the box's faces until the last of the scans is in; the map loses them before.
TEST(InsertAll, ScansAreAlignedWhereASurfaceGoesAmongThem) {
  std::mt19937_64 rng = test::rng();
  test::CheckedMapper mapper{Parameters{}};
  for (const Scan& scan : pass_by(test::room_with_a_box(), rng, 3)) mapper.mapper.insert(scan);
  ASSERT_FALSE(mapper.on_plane({0, 0, 1}, {0.6, 0, 0.4}).empty()) << "the box's top";
  const std::vector<ScanReport> reports = mapper.mapper.insert_all(pass_by(room(), rng, 12));
  EXPECT_TRUE(mapper.on_plane({0, 0, 1}, {0.6, 0, 0.4}).empty());
  EXPECT_FALSE(mapper.on_plane({0, 0, 1}, {0.6, 0, 0.01}).empty()) << "the floor";
  for (const ScanReport& report : reports) EXPECT_GT(report.alignment.known, 0U);
}

TEST(InsertAll, StopsBeforeAScanThatIsRefused) {
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> scans = pass_by(room(), rng, 5);
  scans[3].T_map_sensor.linear() *= 1.01;
  Mapper mapper(as_given()), taken(as_given());
  EXPECT_EQ(mapper.insert_all(scans).size(), 3U);
  taken.insert_all(std::span(scans).first(3));
  const std::string digest = test::digest(taken.map());
  EXPECT_TRUE(test::digest(mapper.map()) == digest);
  EXPECT_THROW(mapper.insert_all(std::span(scans).subspan(3)), Error);
  EXPECT_TRUE(test::digest(mapper.map()) == digest);
  EXPECT_EQ(mapper.insert_all(std::span(scans).subspan(4)).size(), 1U);
  EXPECT_TRUE(mapper.insert_all(std::span<const Scan>()).empty());
}

}  // namespace
}  // namespace octosurf::mapper
