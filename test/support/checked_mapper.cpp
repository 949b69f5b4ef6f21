#include "support/checked_mapper.hpp"

#include "support/invariants.hpp"

namespace octosurf::test {

CheckedMapper::~CheckedMapper() { EXPECT_THAT(check_invariants(mapper.map()), ::testing::IsEmpty()); }

ScanReport CheckedMapper::insert(const Scan& scan) {
  const auto before = mapper.snapshot();
  const Map::Size size_before = mapper.map().size();
  const ScanReport report = mapper.insert(scan);
  const auto after = mapper.snapshot();
  const Map::Size size = mapper.map().size();
  if (std::has_single_bit(size.scans)) {
    EXPECT_THAT(check_invariants(mapper.map()), ::testing::IsEmpty());
  }
  EXPECT_EQ(report.points_raw, scan.points.size());
  EXPECT_LE(report.categorized, report.appeared);
  EXPECT_EQ(size.points, size_before.points + report.appeared - report.vanished);
  EXPECT_EQ(size.points, size.pending + size.inliers);
  EXPECT_EQ(size.scans, size_before.scans + 1);
  EXPECT_GE(after->revision, before->revision);
  expect_told(*before, *after, report);
  return report;
}

std::vector<SurfacePtr> CheckedMapper::on_plane(const Eigen::Vector3d& normal,
                                                const Eigen::Vector3d& point) const {
  std::vector<SurfacePtr> found;
  for (const SurfacePtr& s : surfaces())
    if (s->plane.normal.dot(normal) > 0.9962 && std::fabs(s->plane.signed_distance(point)) < 0.02)
      found.push_back(s);
  return found;
}

void CheckedMapper::expect_told(const Snapshot& before, const Snapshot& after, const ScanReport& report) {
  const auto tells = [](const std::vector<SurfaceId>& list, SurfaceId id) {
    EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
    return std::find(list.begin(), list.end(), id) != list.end();
  };
  for (const SurfacePtr& s : after.surfaces) {
    const Surface* was = before.find(s->id);
    EXPECT_EQ(was == nullptr, tells(report.born, s->id)) << "surface " << s->id;
    if (was != nullptr && s->inliers > was->inliers) {
      EXPECT_TRUE(tells(report.grown, s->id));
    }
    if (was != nullptr && s->inliers < was->inliers) {
      EXPECT_TRUE(tells(report.shrunk, s->id));
    }
    if (was == s.get()) continue;
    EXPECT_EQ(s->revision, after.revision) << "changed, but not by this scan";
  }
  for (const SurfaceId id : report.shrunk) EXPECT_NE(after.find(id), nullptr) << "surface " << id;
  for (const SurfacePtr& s : before.surfaces)
    if (after.find(s->id) == nullptr) {
      EXPECT_TRUE(tells(report.gone, s->id) || tells(report.merged, s->id)) << "surface " << s->id;
    }
}

}  // namespace octosurf::test
