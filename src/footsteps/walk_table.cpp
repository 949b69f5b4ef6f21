#include "footsteps/walk_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace octosurf::footsteps {
namespace {

std::size_t turned(int heading, int turn) {
  return static_cast<std::size_t>((heading + turn + 2 * WalkTable::headings) % WalkTable::headings);
}

}  // namespace

WalkTable::WalkTable(const std::vector<Motion>& motions) {
  double most = 0;  // m for a cost of 1
  for (int heading = 0; heading < headings; ++heading) {
    const double yaw = -2 * std::numbers::pi * heading / headings;
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw));
    for (const Motion& motion : motions) {
      double metres = 0;
      for (const Eigen::Vector2d& by : motion.by) metres = std::max(metres, along.dot(by) + motion.around_m);
      most = std::max(most, metres / motion.cost);
      edges_[static_cast<std::size_t>(heading)].push_back(
          {motion.turn, static_cast<float>(motion.cost), static_cast<std::size_t>(std::ceil(metres / cell))});
    }
  }
  cost_per_metre_ = 1 / most;
}

void WalkTable::aim(int heading) {
  if (heading != goal_) rows_ = {};
  goal_ = heading;
}

double WalkTable::cost(int heading, int direction, double metres) {
  const std::size_t row = std::min(static_cast<std::size_t>(std::max(0.0, metres) / cell), most_cells);
  std::vector<Row>& rows = rows_[static_cast<std::size_t>(direction)];
  while (rows.size() <= row) add_row(direction);
  return std::max<double>(rows[row][static_cast<std::size_t>(heading)], cost_per_metre_ * metres);
}

void WalkTable::add_row(int direction) {
  std::vector<Row>& rows = rows_[static_cast<std::size_t>(direction)];
  const std::size_t row = rows.size();
  Row& made = rows.emplace_back();
  made.fill(std::numeric_limits<float>::infinity());
  if (row == 0) made[static_cast<std::size_t>(goal_)] = 0;
  for (bool better = true; better;) {  // those that turn only lead to other headings of the same row
    better = false;
    for (int heading = 0; heading < headings; ++heading)
      for (const Edge& edge : edges_[turned(heading, -direction)]) {
        const float sum = edge.cost + rows[row - std::min(row, edge.cells)][turned(heading, edge.to)];
        float& least = made[static_cast<std::size_t>(heading)];
        if (sum >= least) continue;
        least = sum;
        better = true;
      }
  }
}

}  // namespace octosurf::footsteps
