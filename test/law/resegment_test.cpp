#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <gmock/gmock.h>
#include <random>
#include <set>

#include <octosurf/mapper.hpp>

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

void insert_scans(Mapper& mapper, std::mt19937_64& rng, int scans = 3) {
  for (int k = 0; k < scans; ++k)
    mapper.insert(test::camera_scan(table_in_a_corner(),
                                    test::look_at({1.9, 1.2 + 0.2 * k, 1.6}, {0.5, 0.5, 0.2}), rng));
}

TEST(Resegment, KeepsAllInvariants) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper;
  insert_scans(mapper, rng);
  const std::size_t points = mapper.map().size().points;
  const std::size_t surfaces = mapper.snapshot()->surfaces.size();
  const ScanReport report = mapper.resegment();
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  test::expect_guarantees(mapper.map());
  EXPECT_EQ(mapper.map().size().points, points);
  EXPECT_EQ(report.born.size(), mapper.snapshot()->surfaces.size());
  EXPECT_EQ(report.merged.size() + report.gone.size(), surfaces);
  EXPECT_GE(report.born.size(), 5U);  // floor, two walls, the table's top and a side
}

TEST(Resegment, TellsWhoTookInWhom) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper;
  insert_scans(mapper, rng);
  const auto before = mapper.snapshot();
  mapper.resegment();
  const auto after = mapper.snapshot();
  std::set<SurfaceId> told;
  after->departures.for_each_since(before->revision, [&](const Departure& departure) {
    if (departure.of != Departure::Of::surface || before->find(departure.id) == nullptr) return;
    told.insert(departure.id);
    if (departure.into == 0) return;
    const Surface* heir = after->find(departure.into);
    ASSERT_NE(heir, nullptr);
    EXPECT_THAT(heir->parents, ::testing::Contains(departure.id));
  });
  EXPECT_EQ(told.size(), before->surfaces.size());
  for (const SurfacePtr& surface : after->surfaces) EXPECT_EQ(before->find(surface->id), nullptr);
}

TEST(Resegment, GivesTheSameAgain) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper;
  insert_scans(mapper, rng);
  mapper.resegment();
  const auto once = mapper.snapshot();
  mapper.resegment();
  const auto twice = mapper.snapshot();
  ASSERT_EQ(once->surfaces.size(), twice->surfaces.size());
  for (std::size_t i = 0; i < once->surfaces.size(); ++i)
    EXPECT_EQ(once->surfaces[i]->inliers, twice->surfaces[i]->inliers);
}

TEST(Resegment, ScansGoOnAfterIt) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper;
  insert_scans(mapper, rng);
  mapper.resegment();
  insert_scans(mapper, rng, 2);
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
}

TEST(Resegment, AnEmptyMapStaysEmpty) {
  Mapper mapper;
  EXPECT_THAT(mapper.resegment().born, IsEmpty());
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
}

}  // namespace
}  // namespace octosurf
