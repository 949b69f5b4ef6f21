// Detection while scans come: beside the batch form, which is its slow twin, and with what every map
// promises.
#include "detection/likelihood_detector.hpp"

#include "detection/owners.hpp"
#include "support/guarantees.hpp"
#include "support/map_state.hpp"
#include "support/room_tour.hpp"

namespace octosurf {
namespace {

void insert_all(Mapper& mapper, const std::vector<Scan>& scans) {
  for (const Scan& scan : scans) mapper.insert(scan);
}

/// The same points are one surface, but for the share of outliers that the model expects.
TEST(LikelihoodDetector, AgreesWithTheBatchForm) {
  Mapper mapper;
  insert_all(mapper, test::room_tour(test::rng(), 12));
  const std::vector<SurfaceId> step_by_step = test::owners(mapper.map());
  mapper.resegment();  // keeps the ids of what is the same
  const std::vector<SurfaceId> at_once = test::owners(mapper.map());
  ASSERT_EQ(step_by_step.size(), at_once.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < at_once.size(); ++i) same += step_by_step[i] == at_once[i];
  RecordProperty("same", std::to_string(same) + " of " + std::to_string(at_once.size()));
  EXPECT_GE(static_cast<double>(same), 0.9 * static_cast<double>(at_once.size()));
}

/// How many points each surface had before a scan, and in which they are after it.
std::map<SurfaceId, std::map<SurfaceId, std::size_t>> handed_over(
    const std::vector<OccupancyView::Voxel>& before, const Map& after) {
  std::map<SurfaceId, std::map<SurfaceId, std::size_t>> points;
  for (const OccupancyView::Voxel& voxel : before)
    if (voxel.surface != 0) ++points[voxel.surface][after.at(voxel.point).surface];
  return points;
}

TEST(LikelihoodDetector, WhoKeepsItsPointsKeepsItsId) {
  Mapper mapper;
  std::size_t kept = 0;
  for (const Scan& scan : test::room_tour(test::rng(), 12)) {
    std::vector<OccupancyView::Voxel> before;
    mapper.map().for_each_point([&](const OccupancyView::Voxel& voxel) { before.push_back(voxel); });
    mapper.insert(scan);
    const auto points = handed_over(before, mapper.map());
    std::map<SurfaceId, std::size_t> had;  // by the surface after the scan, from any before it
    for (const auto& [id, into] : points)
      for (const auto& [now, count] : into) had[now] += count;
    for (const auto& [id, into] : points)
      for (const auto& [now, count] : into) {
        std::size_t all = 0;
        for (const auto& [other, number] : into) all += number;
        if (now == 0 || 10 * count < 9 * all || 2 * count <= had.at(now)) continue;
        EXPECT_EQ(now, id) << scan.name << ": " << count << " of " << all << " points";
        ++kept;
      }
  }
  EXPECT_GT(kept, 12U);
}

// What is pending farther off than a gap's width, and will not be looked at again by itself, is of the plane
// that has come beside it.
TEST(LikelihoodDetector, WhatIsPendingBeyondWhatIsLookedAtJoinsThePlaneBesideIt) {
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  Mapper mapper;
  insert_all(mapper, {test::plate_scan(eye, 0, 8, 6), test::plate_scan(eye, 8, 9, 4)});
  ASSERT_EQ(mapper.map().size().surfaces, 0U);
  mapper.insert(test::plate_scan(eye, 9, 18, 6));
  const auto snapshot = mapper.snapshot();
  ASSERT_EQ(snapshot->surfaces.size(), 1U);
  EXPECT_EQ(snapshot->surfaces[0]->inliers, 8U * 6 + 4 + 9 * 6);
  EXPECT_EQ(mapper.map().size().pending, 0U);
  test::expect_guarantees(mapper.map());
}

// 48 points of a plane are two fewer than a surface needs; that 12 more are not as many again is no reason to
// wait.
TEST(LikelihoodDetector, APlaneThatLackedPointsIsLookedAtOnceAFifthMoreHasCome) {
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  Mapper mapper;
  const Scan plate = test::plate_scan(eye, 0, 10, 6);
  Scan with_gaps = plate;
  with_gaps.points.clear();
  for (std::size_t i = 0; i < plate.points.size(); ++i)
    if (i % 5 != 2) with_gaps.points.push_back(plate.points[i]);
  mapper.insert(with_gaps);
  ASSERT_EQ(mapper.map().size().surfaces, 0U);
  ASSERT_EQ(mapper.map().size().pending, 48U);
  mapper.insert(plate);
  ASSERT_EQ(mapper.map().size().surfaces, 1U);
  EXPECT_EQ(mapper.snapshot()->surfaces[0]->inliers, 10U * 6);
  test::expect_guarantees(mapper.map());
}

// This program does not link octosurf::pcl.
TEST(Detector, ThePapersIsRefusedWhereItIsNotLinkedAndTheMapStays) {
  Map map(Parameters::paper());
  EXPECT_THAT([&] { Mapper(std::move(map)); },
              ::testing::Throws<Error>(::testing::AllOf(
                  ::testing::Property(&Error::kind, Error::Kind::usage),
                  ::testing::Property(&Error::what, ::testing::HasSubstr("octosurf::pcl")))));
  EXPECT_EQ(map.size().scans, 0U);
  EXPECT_EQ(map.parameters().detection.detector, DetectorKind::paper);
}

using ::testing::IsEmpty;

test::Scene table_in_a_corner() {
  test::Scene scene;
  scene.rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
  scene.rectangle({0, 0, 0}, {2, 0, 0}, {0, 0, 2});
  scene.rectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  scene.box({0.5, 0.5, 0}, {1.1, 1, 0.4});
  return scene;
}

class Resegment : public ::testing::Test {
 protected:
  Resegment() { insert_scans(3); }
  ~Resegment() override { EXPECT_THAT(test::check_invariants(mapper.map()), IsEmpty()); }
  void insert_scans(int count) {
    for (int k = 0; k < count; ++k)
      mapper.insert(test::camera_scan(table_in_a_corner(),
                                      test::look_at({1.9, 1.2 + 0.2 * k, 1.6}, {0.5, 0.5, 0.2}), rng));
  }

  std::mt19937_64 rng = test::rng();
  Mapper mapper;
};

TEST_F(Resegment, KeepsAllInvariants) {
  const std::size_t points = mapper.map().size().points;
  const std::size_t surfaces = mapper.snapshot()->surfaces.size();
  const ScanReport report = mapper.resegment();
  test::expect_guarantees(mapper.map());
  EXPECT_EQ(mapper.map().size().points, points);
  EXPECT_EQ(surfaces + report.born.size() - report.merged.size() - report.gone.size(),
            mapper.snapshot()->surfaces.size());
  EXPECT_GE(mapper.snapshot()->surfaces.size(), 5U);  // floor, two walls, the table's top and a side
}

TEST(ResegmentNothing, StaysEmpty) { EXPECT_THAT(Mapper().resegment().born, IsEmpty()); }

TEST_F(Resegment, TellsWhoTookInWhom) {
  const auto before = mapper.snapshot();
  mapper.resegment();
  const auto after = mapper.snapshot();
  std::set<SurfaceId> told;
  after->removals.for_each_since(before->revision, [&](const Removal& removal) {
    if (removal.of != Removal::Of::surface || before->find(removal.id) == nullptr) return;
    told.insert(removal.id);
    if (removal.into == 0) return;
    const Surface* successor = after->find(removal.into);
    ASSERT_NE(successor, nullptr);
    EXPECT_THAT(successor->parents, ::testing::Contains(removal.id));
  });
  for (const SurfacePtr& surface : before->surfaces)
    EXPECT_NE(told.contains(surface->id), after->find(surface->id) != nullptr) << surface->id;
}

TEST_F(Resegment, KeepsIdsWhereMostOfASurfaceIsKept) {
  const auto before = mapper.snapshot();
  const std::vector<SurfaceId> had = test::owners(mapper.map());
  mapper.resegment();
  const auto after = mapper.snapshot();
  const std::vector<SurfaceId> have = test::owners(mapper.map());
  std::map<SurfaceId, std::map<SurfaceId, std::size_t>> shared;
  for (std::size_t i = 0; i < had.size(); ++i)
    if (had[i] != 0 && have[i] != 0) ++shared[had[i]][have[i]];
  std::size_t kept = 0;
  for (const auto& [id, with] : shared) {
    if (after->find(id) == nullptr) continue;
    ++kept;
    for (const auto& [other, points] : with) EXPECT_LE(points, with.at(id)) << id << " and " << other;
  }
  // Floor, two walls and the table's top are what they were.
  EXPECT_GE(kept, 4U);
}

TEST_F(Resegment, GivesTheSameAgainAndScansGoOnAfterIt) {
  mapper.resegment();
  const auto once = mapper.snapshot();
  mapper.resegment();
  const auto twice = mapper.snapshot();
  ASSERT_EQ(once->surfaces.size(), twice->surfaces.size());
  for (std::size_t i = 0; i < once->surfaces.size(); ++i)
    EXPECT_EQ(once->surfaces[i]->inliers, twice->surfaces[i]->inliers);
  insert_scans(2);
}

}  // namespace
}  // namespace octosurf
