// Snapshots while the map goes on: what mapper.hpp promises to readers in other threads.
#include "support/polygons.hpp"
#include "support/room_tour.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {
namespace {

/// What is wrong with a snapshot; empty if it is whole.
std::string fault_of(const Snapshot& snapshot) {
  std::map<SurfaceId, std::size_t> inliers;  // a voxel more or less, and the octree is of another scan
  constexpr double all = std::numeric_limits<double>::infinity();
  snapshot.octree.for_each_occupied({Eigen::Vector3d::Constant(-all), Eigen::Vector3d::Constant(all)},
                                    [&](const OccupancyView::Voxel& voxel) {
                                      ++inliers[voxel.surface];
                                      return true;
                                    });
  inliers.erase(0);
  SurfaceId last = 0;
  for (const SurfacePtr& s : snapshot.surfaces) {
    const bool whole =
        s->id > last && s->revision <= snapshot.revision && s->inliers > 0 && s->inliers == inliers[s->id] &&
        snapshot.find(s->id) == s.get() && s->boundary.size() == test::count_vertices(s->polygons) &&
        std::fabs(test::area(s->polygons) - s->area_m2) < 1e-6 && test::invalid(s->polygons).empty();
    if (!whole) return "surface " + std::to_string(s->id);
    last = s->id;
  }
  return inliers.size() == snapshot.surfaces.size() ? "" : "a surface is in the octree only";
}

TEST(Readers, FourAtFullSpeedSeeWholeSnapshotsOnly) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 16);
  Mapper mapper(Parameters{}, 2);
  mapper.share_octree();
  std::atomic<bool> done{false};
  std::array<std::string, 4> wrong;
  std::array<std::uint64_t, 4> revision{};
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (bool last = false; !last;) {
        last = done;
        const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
        if (snapshot->revision < revision[i]) wrong[i] += " went back";
        revision[i] = snapshot->revision;
        wrong[i] += fault_of(*snapshot);
      }
    });
  for (const Scan& scan : scans) mapper.insert(scan);
  done = true;
  threads.clear();  // joins
  EXPECT_THAT(wrong, ::testing::Each(""));
  EXPECT_THAT(revision, ::testing::Each(scans.size())) << "what was inserted is seen at once";
}

}  // namespace
}  // namespace octosurf::mapper
