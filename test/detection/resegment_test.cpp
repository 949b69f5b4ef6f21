#include "detection/owners.hpp"
#include "support/guarantees.hpp"
#include "support/invariants.hpp"
#include "support/scene.hpp"

namespace octosurf {
namespace {

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
