// What is taken back from a map, and comes back where it is.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"

#include <octosurf/map.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf::mapper {
namespace {

using test::CheckedMapper;
using test::Scene;
using State = OccupancyView::State;

const Eigen::AlignedBox3d chest(Eigen::Vector3d(-0.2, -0.15, 0.011), Eigen::Vector3d(0.2, 0.15, 0.311));

Scene floor_of_room() {
  Scene scene;
  scene.rectangle({-1.2, -1.2, 0.011}, {2.4, 0, 0}, {0, 2.4, 0});
  return scene;
}
Scene with_chest() {
  Scene scene = floor_of_room();
  scene.box(chest.min(), chest.max());
  return scene;
}
void look(CheckedMapper& mapper, const Scene& scene, int count, std::mt19937_64& rng) {
  for (const Scan& scan : test::orbit(scene, {0, 0, 0.1}, 1.1, 1.3, count, rng, {320, 240, 260}))
    mapper.insert(scan);
}
std::size_t tops(const CheckedMapper& mapper) {
  return mapper.on_plane({0, 0, 1}, {0, 0, chest.max().z()}).size();
}

TEST(Clear, WhatIsInsideGoesAndComesBackOnlyIfItIsThere) {
  for (const bool stays : {false, true}) {
    SCOPED_TRACE(stays ? "it stays" : "it is carried out");
    std::mt19937_64 rng = test::rng();
    CheckedMapper mapper(test::of_voxels(0.02));
    look(mapper, with_chest(), 10, rng);
    ASSERT_EQ(tops(mapper), 1U);
    const auto before = mapper.mapper.snapshot();
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.05);
    const ScanReport report =
        mapper.mapper.clear(SpacePart::box({chest.min() - margin, chest.max() + margin}));
    test::expect_guarantees(mapper.mapper.map());
    EXPECT_GT(report.vanished, 500U);
    EXPECT_GE(report.gone.size(), 5U);  // top and sides
    EXPECT_EQ(tops(mapper), 0U);
    EXPECT_GT(mapper.mapper.snapshot()->revision, before->revision);
    EXPECT_EQ(mapper.mapper.map().octree().at({0, 0, chest.max().z()}).state, State::unknown);
    look(mapper, stays ? with_chest() : floor_of_room(), 2, rng);
    EXPECT_EQ(tops(mapper), stays ? 1U : 0U);
  }
}

TEST(Clear, IsByTheMiddlesOfVoxels) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> any(-1, 1);
  for (const bool as_free : {false, true})
    for (const bool round : {false, true}) {
      SCOPED_TRACE(testing::Message() << (as_free ? "free" : "unknown") << (round ? ", round" : ""));
      CheckedMapper mapper(test::of_voxels(0.02));
      look(mapper, with_chest(), 4, rng);
      SpacePart part;
      part.T_map_part.linear() =
          Eigen::Quaterniond(any(rng), any(rng), any(rng), any(rng)).normalized().toRotationMatrix();
      part.T_map_part.translation() << any(rng) / 4, any(rng) / 4, any(rng) / 4;
      part.half_size << 0.3, round ? 0.3 : 0.1, 0.2;
      part.round = round;
      const OccupancyView before = mapper.mapper.map().octree();
      mapper.mapper.clear(part, as_free);
      const OccupancyView after = mapper.mapper.map().octree();
      std::size_t inside = 0;
      for (int i = 0; i < 200000; ++i) {
        const Eigen::Vector3d p(any(rng), any(rng), any(rng));
        const OccupancyView::Voxel was = before.at(p), is = after.at(p);
        const Eigen::Vector3d q = part.T_map_part.inverse() * was.center;
        const bool in = round ? q.head<2>().norm() <= 0.3 && std::abs(q.z()) <= 0.2
                              : (q.cwiseAbs().array() <= part.half_size.array()).all();
        if (!in) {
          ASSERT_EQ(was.log_odds, is.log_odds) << p.transpose();
          ASSERT_EQ(was.state, is.state);
        } else if (was.state == State::unknown || !as_free) {
          ASSERT_EQ(is.state, State::unknown) << p.transpose();
        } else {
          ASSERT_EQ(is.state, State::free) << p.transpose();
          ++inside;
        }
      }
      EXPECT_EQ(inside > 100, as_free);
      test::expect_guarantees(mapper.mapper.map());
    }
}

TEST(Clear, RefusesPartsThatAreNone) {
  CheckedMapper mapper(test::of_voxels(0.02));
  EXPECT_THROW(mapper.mapper.clear(SpacePart()), Error);
  SpacePart endless = SpacePart::cylinder({0, 0, 0}, 1, 1);
  endless.half_size.z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(mapper.mapper.clear(endless), Error);
}

}  // namespace
}  // namespace octosurf::mapper
