// Snapshots while the map goes on: what mapper.hpp promises to readers in other threads.
#include "support/polygons.hpp"
#include "support/room_tour.hpp"
#include "support/testing.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {
namespace {

/// What one thread finds wrong with the snapshots it gets. Says the first thing only.
class Reader {
 public:
  void look(const Mapper& mapper) {
    const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
    require(snapshot->revision >= last_revision_, "went back", 0);
    last_revision_ = snapshot->revision;
    SurfaceId last = 0;
    for (const SurfacePtr& s : snapshot->surfaces) {
      require(s->id > last, "out of order", s->id);
      require(s->revision <= snapshot->revision, "is newer than its snapshot", s->id);
      require(s->inliers > 0, "has no inliers", s->id);
      require(s->boundary.size() == test::count_vertices(s->polygons),
              "has another boundary than its polygons", s->id);
      require(std::fabs(test::area(s->polygons) - s->area_m2) < 1e-6, "has another area than its polygons",
              s->id);
      require(snapshot->find(s->id) == s.get(), "is not found", s->id);
      last = s->id;
      // The slow check for each published surface once; keeping them also keeps their addresses from reuse.
      if (kept_.insert(s).second)
        require(test::invalid(s->polygons).empty(), "has an invalid polygon", s->id);
    }
    look_at_octree(*snapshot);
    ++looks_;
  }

  const std::string& wrong() const { return wrong_; }
  std::uint64_t last_revision() const { return last_revision_; }
  std::size_t looks() const { return looks_; }

 private:
  /// A voxel more or less than the surface has inliers, and the octree is of another scan.
  void look_at_octree(const Snapshot& snapshot) {
    constexpr double all = std::numeric_limits<double>::infinity();
    std::map<SurfaceId, std::size_t> inliers;
    snapshot.octree.for_each_occupied({Eigen::Vector3d::Constant(-all), Eigen::Vector3d::Constant(all)},
                                      [&](const OccupancyView::Voxel& voxel) {
                                        ++inliers[voxel.surface];
                                        return true;
                                      });
    for (const SurfacePtr& s : snapshot.surfaces)
      require(inliers[s->id] == s->inliers, "has other inliers in its octree", s->id);
    inliers.erase(0);
    require(inliers.size() == snapshot.surfaces.size(), "is in the octree only", inliers.size());
  }

  void require(bool holds, const char* what, std::size_t id) {
    if (!holds && wrong_.empty()) wrong_ = "surface " + std::to_string(id) + " " + what;
  }

  std::set<SurfacePtr> kept_;
  std::uint64_t last_revision_ = 0;
  std::size_t looks_ = 0;
  std::string wrong_;
};

TEST(Readers, FourAtFullSpeedSeeWholeSnapshotsOnly) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 16);
  Mapper mapper(Parameters{}, 2);
  mapper.share_octree();
  std::atomic<bool> done{false};
  std::vector<Reader> readers(4);
  std::vector<std::jthread> threads;
  for (Reader& reader : readers)
    threads.emplace_back([&] {
      for (bool last = false; !last;) {
        last = done;
        reader.look(mapper);
      }
    });
  for (const Scan& scan : scans) mapper.insert(scan);
  done = true;
  threads.clear();  // joins
  for (const Reader& reader : readers) {
    EXPECT_EQ(reader.wrong(), "");
    EXPECT_EQ(reader.last_revision(), scans.size()) << "what was inserted is seen at once";
    EXPECT_GT(reader.looks(), 0U);
  }
}

}  // namespace
}  // namespace octosurf::mapper
