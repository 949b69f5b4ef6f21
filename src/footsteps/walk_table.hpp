#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace octosurf::footsteps {

/// What walking in free level space costs at least, in steps and turns: by heading, and by the way along a
/// direction. A robot may turn while it walks, walk backward or sidle; the table takes what is cheapest.
class WalkTable {
 public:
  /// A move of the body, one heading step or more to the left, in the frame of the heading before it.
  struct Motion {
    int turn = 0;
    double cost = 0;                    ///< more than 0
    std::vector<Eigen::Vector2d> by{};  ///< corners of where the body gets to
    double around_m = 0;                ///< farther than these by as much in any direction
  };
  static constexpr int headings = 16;

  explicit WalkTable(const std::vector<Motion>& motions);
  /// Walks end in this heading.
  void aim(int heading);
  /// Of so many metres along a direction, one of the headings. Consistent, and never more than what it costs.
  double cost(int heading, int direction, double metres);

 private:
  static constexpr double cell = 0.01;             // m; ways shorten by whole cells, rounded up
  static constexpr std::size_t most_cells = 2000;  // 20 m, from where turns matter little
  using Row = std::array<float, headings>;
  struct Edge {
    int to;  // heading, in steps from the one before
    float cost;
    std::size_t cells;  // advance
  };
  void add_row(int direction);

  std::array<std::vector<Edge>, headings> edges_;  // by heading, from the direction of the way
  double cost_per_metre_ = 0;                      // of the best motion
  int goal_ = 0;
  std::array<std::vector<Row>, headings> rows_;  // by direction, and cells of way
};

}  // namespace octosurf::footsteps
