// What is looked at side by side: how it falls into parts, and how their planes become one proposal.
#include "detection/parts.hpp"

#include "support/pending_points.hpp"

namespace octosurf::detection {
namespace {

using surfaces::Proposal;

const Eigen::Vector3d above(1, 0.5, 2);

TEST(Parts, HaveEachPointOnceAndWhatIsWithinHTogether) {
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> boards;
  for (int k = 0; k < 8; ++k) {
    const double x = 0.3 * static_cast<double>(rng() % 20), y = 0.3 * static_cast<double>(rng() % 20);
    boards.push_back(test::rectangle_scan(above, {x, y, 0}, {0.6, 0, 0}, {0, 0.6, 0}));
  }
  const test::PendingPoints points(boards);
  const std::vector<Part> parts = divided(points.ledger, {.points = points.all});
  std::vector<PointId> all;
  std::vector<std::size_t> part_of(points.ledger.window.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    EXPECT_TRUE(k == 0 || parts[k].points.size() <= parts[k - 1].points.size()) << "the largest first";
    std::vector<PointId> in_order = parts[k].points;
    points.ledger.window.put_in_order(in_order);
    EXPECT_EQ(in_order, parts[k].points);
    for (const PointId i : parts[k].points) part_of[index_of(i)] = k;
    all.insert(all.end(), parts[k].points.begin(), parts[k].points.end());
  }
  points.ledger.window.put_in_order(all);
  EXPECT_EQ(all, points.all);
  const double h = points.ledger.parameters.max_hole_size();
  for (int k = 0; k < 20'000; ++k) {
    const PointId a = points.all[rng() % points.all.size()], b = points.all[rng() % points.all.size()];
    if ((points.position(a) - points.position(b)).norm() >= h) continue;
    ASSERT_EQ(part_of[index_of(a)], part_of[index_of(b)]);
  }
}

/// Two boards 2 m apart, of some 2,500 readings each, and between them a line that belongs to the first.
class TwoBoards : public ::testing::Test {
 protected:
  surfaces::SurfaceModel& known(double from_x, double to_x) {
    surfaces::SurfaceModel& surface = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0});
    for (const PointId i : points_.all)
      if (points_.position(i).x() >= from_x && points_.position(i).x() <= to_x)
        points_.ledger.give(i, surface);
    return surface;
  }
  std::vector<PointId> left() const { return between(-1, 1.1); }
  std::vector<PointId> right() const { return between(2.6, 4); }
  std::vector<PointId> between(double from_x, double to_x) const {
    std::vector<PointId> some;
    for (const PointId i : points_.all)
      if (points_.position(i).x() > from_x && points_.position(i).x() < to_x) some.push_back(i);
    return some;
  }

  test::PendingPoints points_{{test::rectangle_scan(above, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                               test::rectangle_scan(above, {2.7, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                               test::rectangle_scan(above, {1.3, 0.3, 0}, {1.1, 0, 0}, {0, 0.1, 0})}};
};

TEST_F(TwoBoards, AreTwoPartsUnlessASurfaceHasReadingsOfBoth) {
  std::vector<PointId> both = left();
  for (const PointId i : right()) both.push_back(i);
  points_.ledger.window.put_in_order(both);
  ASSERT_EQ(divided(points_.ledger, {.points = both}).size(), 2U);
  const SurfaceId id = known(0.6, 2.8).id();
  const std::vector<Part> parts = divided(points_.ledger, {.surfaces = {id}, .gained = both});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts.front().surfaces, std::vector{id});
  EXPECT_EQ(parts.front().gained, both);
}

TEST_F(TwoBoards, SmallPartsArePutTogether) {
  std::vector<PointId> few;
  for (const std::vector<PointId>& board : {left(), right()})
    few.insert(few.end(), board.begin(), board.begin() + 100);
  points_.ledger.window.put_in_order(few);
  EXPECT_EQ(divided(points_.ledger, {.points = few}).size(), 1U);
}

TEST_F(TwoBoards, OfOneSurfaceInTwoPartsAreOnePlane) {
  const surfaces::SurfaceModel& line = known(1.2, 2.5);
  JointProposal joint(points_.ledger);
  const auto found = [&](const std::vector<PointId>& points, double x) {
    Proposal proposal;
    proposal.planes.push_back({{Eigen::Vector3d::UnitZ(), 0}, {x, 0, 0}});
    for (const PointId i : points) proposal.points.push_back({i, 1});
    proposal.rest.push_back({line.id(), 1, 0});
    return proposal;
  };
  joint.add(found(left(), 0), points_.ledger.window);
  joint.add(found(right(), 3), points_.ledger.window);
  Proposal alone = found({left().front(), points_.all.back()}, 9);  // the first one is taken already
  alone.rest.clear();
  joint.add(alone, points_.ledger.window);
  const Proposal all = std::move(joint).take();
  ASSERT_EQ(all.planes.size(), 2U) << "and none of a single reading";
  ASSERT_EQ(all.rest.size(), 1U);
  EXPECT_EQ(all.rest.front().label, 1U);
  EXPECT_EQ(all.rest.front().readings, static_cast<double>(line.size()));
  std::set<PointId> labelled;
  for (const auto& [point, label] : all.points) {
    EXPECT_TRUE(labelled.insert(point).second);
    EXPECT_EQ(label, labelled.size() <= left().size() + right().size() ? 1U : 0U);
  }
}

}  // namespace
}  // namespace octosurf::detection
