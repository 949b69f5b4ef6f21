#include "footsteps/walk_table.hpp"

#include "support/testing.hpp"

namespace octosurf::footsteps {
namespace {

Eigen::Rotation2Dd turned(int heading) {
  return Eigen::Rotation2Dd(heading * 2 * std::numbers::pi / WalkTable::headings);
}

/// Forward 0.3 m, aside 0.1 m, back 0.15 m, while it turns by up to one heading.
std::vector<WalkTable::Motion> walker() {
  std::vector<WalkTable::Motion> motions;
  for (const int turn : {-1, 0, 1})
    motions.push_back({turn, 1 + 0.3 * std::abs(turn), {{0.3, 0}, {-0.15, 0}, {0, 0.1}, {0, -0.1}}});
  return motions;
}

TEST(WalkTable, TurnsWhileItWalksAndBacksUpIfThatIsShorter) {
  WalkTable table(walker());
  table.aim(0);
  EXPECT_NEAR(table.cost(0, 0, 2.995), 10, 1e-5);    // straight on
  EXPECT_NEAR(table.cost(0, 8, 0.595), 4, 1e-5);     // four steps back are less than two turns
  EXPECT_LT(table.cost(4, 0, 3), 4 * 1.3 + 10 - 1);  // the turn's steps get ahead, too
}

TEST(WalkTable, NoWalkCostsLess) {
  std::mt19937_64 random = test::rng();
  std::uniform_int_distribution<int> heading(0, WalkTable::headings - 1), steps(0, 60);
  std::uniform_int_distribution<std::size_t> which(0, 2), corner(0, 3);
  const auto motions = walker();
  for (int walk = 0; walk < 300; ++walk) {
    int at = heading(random);
    const int start = at;
    Eigen::Vector2d way = Eigen::Vector2d::Zero();
    double cost = 0;
    for (int left = steps(random); left > 0; --left) {
      const WalkTable::Motion& motion = motions[which(random)];
      way += turned(at) * motion.by[corner(random)];
      cost += motion.cost;
      at = (at + motion.turn + WalkTable::headings) % WalkTable::headings;
    }
    WalkTable table(motions);
    table.aim(at);
    for (int direction = 0; direction < WalkTable::headings; ++direction)
      EXPECT_LE(table.cost(start, direction, (turned(-direction) * way).x()), cost + 1e-4);
  }
}

}  // namespace
}  // namespace octosurf::footsteps
