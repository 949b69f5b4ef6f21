// Detection while scans come: beside the batch form, which is its slow twin, and with what every map
// promises.
#include "detection/likelihood_detector.hpp"

#include "support/guarantees.hpp"
#include "support/map_state.hpp"
#include "support/room_tour.hpp"

namespace octosurf {
namespace {

void insert_all(Mapper& mapper, const std::vector<Scan>& scans) {
  for (const Scan& scan : scans) mapper.insert(scan);
}

/// Scans that are mapped together are segmented at once: the same points are one surface, but for the share
/// of outliers that the model expects.
TEST(LikelihoodDetector, AgreesWithTheBatchForm) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 12);
  Mapper mapper, batch;
  insert_all(mapper, scans);
  ASSERT_EQ(batch.insert_all(scans).size(), scans.size());
  std::map<SurfaceId, std::map<SurfaceId, std::size_t>> shared;
  std::size_t all = 0;
  mapper.map().for_each_point([&](const OccupancyView::Voxel& voxel) {
    ++shared[voxel.surface][batch.map().at(voxel.point).surface];
    ++all;
  });
  std::size_t same = 0;
  for (const auto& [id, with] : shared)
    same +=
        id == 0 ? with.at(0) : std::ranges::max_element(with, {}, [](auto& w) { return w.second; })->second;
  RecordProperty("same", std::to_string(same) + " of " + std::to_string(all));
  EXPECT_GE(static_cast<double>(same), 0.9 * static_cast<double>(all));
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

}  // namespace
}  // namespace octosurf
