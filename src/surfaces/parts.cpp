#include "surfaces/parts.hpp"

#include "surfaces/plane_covariance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace octosurf {
namespace {

using Index = Workspace::Index;

/// How much a fit's slopes may be off beside its noise, because that is not independent from point to
/// point: a laser's line errs as a whole. `bias` m at the patch's own standard width, where scatter
/// inside a voxel is no width.
Eigen::Matrix2d slope_bias(const Moments& moments, const Eigen::Matrix3d& R, double bias, double resolution) {
  constexpr double smallest = 1e-8;  // m²
  const Eigen::Matrix2d spread = (R * moments.covariance() * R.transpose()).topLeftCorner<2, 2>() -
                                 Eigen::Matrix2d::Identity() * (resolution * resolution / 16);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const Eigen::Vector2d variances =
      (bias * bias * axes.eigenvalues().cwiseMax(smallest).cwiseInverse().array()).matrix();
  return axes.eigenvectors() * variances.asDiagonal() * axes.eigenvectors().transpose();
}

/// `R`: rows u, v, normal of the frame; `origin`: its origin.
PlaneOverFrame height_of(const Patch& patch, const Eigen::Matrix3d& R, const Eigen::Vector3d& origin,
                         double bias, double resolution) {
  const Moments about = patch.moments.shifted(origin - patch.reference);
  PlaneOverFrame height = plane_over(about, R, patch.points);
  Eigen::Matrix<double, 3, 2> at_origin;  // a slope turns the patch about its own centre
  at_origin << -(R * about.sum / about.count).head<2>().transpose(), Eigen::Matrix2d::Identity();
  height.covariance += at_origin * slope_bias(patch.moments, R, bias, resolution) * at_origin.transpose();
  return height;
}

/// Parts of a plane while they are joined.
class Parts {
 public:
  Parts(Workspace& work, std::span<const Index> points, const Plane& plane)
      : work_(work),
        plane_(plane),
        reach_(std::max(1, static_cast<int>(work.state.parameters.max_hole_size() /
                                            work.state.parameters.occupancy.resolution))),
        careful_(work.state.parameters.aligned()),
        reference_(work.window[points.front()].position.cast<double>()) {
    fill(points);
    label();
  }

  std::vector<std::vector<Index>> operator()() {
    join();
    std::vector<std::vector<Index>> joined(patches_.size());
    for (const Cell& cell : cells_) {
      std::vector<Index>& part = joined[root(cell.part)];
      const auto points = points_of(cell);
      part.insert(part.end(), points.begin(), points.end());
    }
    std::erase_if(joined, [](const auto& part) { return part.empty(); });
    return joined;
  }

 private:
  static constexpr std::uint32_t unlabelled = ~std::uint32_t{0};
  struct Cell {
    PlaneCell at;
    std::uint32_t first = 0, count = 0;  // of points_
    std::uint32_t part = unlabelled;
    int depth = 0;
  };
  static constexpr std::size_t enough_contacts = 64;  // to know where two parts meet
  struct Contact {
    std::size_t tried = 0, open = 0, touching = 0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // sum over the open ones
  };

  /// Points by cell, cells by row.
  void fill(std::span<const Index> points) {
    // About the map's origin, so that no point's place in the list decides where cells begin.
    const SurfaceModel frame(0, plane_, plane_.offset * plane_.normal,
                             work_.state.parameters.occupancy.resolution);
    std::vector<std::pair<PlaneCell, Index>> placed;
    placed.reserve(points.size());
    for (const Index i : points) placed.emplace_back(frame.cell_of(work_.window[i].position), i);
    std::stable_sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) {
      return std::pair(a.first.v, a.first.u) < std::pair(b.first.v, b.first.u);
    });
    points_.reserve(points.size());
    for (const auto& [at, i] : placed) {
      if (cells_.empty() || cells_.back().at.u != at.u || cells_.back().at.v != at.v) {
        rows_.resize(static_cast<std::size_t>(at.v - placed.front().first.v) + 1,
                     static_cast<std::uint32_t>(cells_.size()));
        cells_.push_back({at, static_cast<std::uint32_t>(points_.size()), 0, unlabelled, 0});
      }
      ++cells_.back().count;
      points_.push_back(i);
    }
    rows_.push_back(static_cast<std::uint32_t>(cells_.size()));
    points_per_cell_ = static_cast<double>(points_.size()) / static_cast<double>(cells_.size());
  }

  std::span<const Index> points_of(const Cell& cell) const {
    return std::span(points_).subspan(cell.first, cell.count);
  }

  /// From the cells deepest inside outward, because noise bridges a gap in places: what touches among
  /// cells whose surroundings are full, then what that reaches and what touches among the next, …
  void label() {
    for (Cell& cell : cells_) cell.depth = depth_of(cell.at);
    std::vector<std::uint32_t> reached;
    for (int depth = deepest; depth >= 0; --depth) {
      spread(std::exchange(reached, {}), depth, reached);
      for (std::uint32_t c = 0; c < cells_.size(); ++c) {
        if (cells_[c].part != unlabelled || cells_[c].depth < depth) continue;
        cells_[c].part = static_cast<std::uint32_t>(patches_.size());
        patches_.push_back({{}, reference_, 0});
        spread({c}, depth, reached);
      }
    }
    for (const Cell& cell : cells_) add(points_of(cell), patches_[cell.part]);
    parents_.resize(patches_.size());
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
  }

  /// Breadth first over cells of at least this depth, so that parts that meet share what lies between.
  void spread(std::vector<std::uint32_t> open, int depth, std::vector<std::uint32_t>& reached) {
    for (std::size_t next = 0; next < open.size(); ++next) {
      const Cell from = cells_[open[next]];
      bool at_rim = false;
      for_each_within(from.at, 1, [&](std::uint32_t c) {
        if (cells_[c].part != unlabelled) return;
        if (cells_[c].depth < depth) {
          at_rim = true;
          return;
        }
        cells_[c].part = from.part;
        open.push_back(c);
      });
      if (at_rim) reached.push_back(open[next]);
    }
  }

  static constexpr int deepest = 2;
  /// 2: of the 5×5 cells around one at most is empty; 1: none of the 3×3; else 0.
  int depth_of(PlaneCell at) const {
    int near = 0;
    for_each_within(at, 1, [&](std::uint32_t) { ++near; });
    if (near < 9) return 0;
    int all = 0;
    for_each_within(at, 2, [&](std::uint32_t) { ++all; });
    return all < 24 ? 1 : 2;
  }

  template <class Visit>
  void for_each_within(PlaneCell at, int reach, Visit&& visit) const {
    const int first_row = cells_.front().at.v, last_row = first_row + static_cast<int>(rows_.size()) - 2;
    for (int v = std::max(first_row, at.v - reach); v <= std::min(last_row, at.v + reach); ++v) {
      const auto row = cells_.begin() + rows_[static_cast<std::size_t>(v - first_row)];
      const auto end = cells_.begin() + rows_[static_cast<std::size_t>(v - first_row) + 1];
      for (auto c = std::lower_bound(row, end, at.u - reach, [](const Cell&x, int u) { return x.at.u < u; });
           c != end && c->at.u <= at.u + reach; ++c)
        visit(static_cast<std::uint32_t>(c - cells_.begin()));
    }
  }

  void add(std::span<const Index> points, Patch& patch) {
    const NoiseModel& noise = work_.state.noise;
    for (const Index i : points) {
      const VoxelPoint& p = work_.window[i];
      const double ratio = noise.sigma(1) / std::max(noise.sigma(p.range_class), 1e-6);
      patch.moments.add(p.position.cast<double>() - patch.reference, ratio * ratio);
      ++patch.points;
    }
  }

  std::map<std::pair<std::uint32_t, std::uint32_t>, Contact> contacts() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, Contact> found;
    if (patches_.size() < 2) return found;
    for (const Cell& cell : cells_) {
      for_each_within(cell.at, 1, [&](std::uint32_t c) {
        if (cells_[c].part <= cell.part) return;
        Contact& contact = found[{cell.part, cells_[c].part}];
        ++contact.touching;
        ++contact.open;
        contact.place += work_.window[points_[cell.first]].position.cast<double>();
      });
      if (cell.depth > 0) continue;  // gaps are crossed from rim to rim
      for_each_within(cell.at, reach_, [&](std::uint32_t c) {
        const Cell& other = cells_[c];
        if (other.part <= cell.part || touch(cell, other)) return;
        Contact& contact = found[{cell.part, other.part}];
        if (contact.tried < enough_contacts) note(cell, other, contact);
      });
    }
    return found;
  }

  static bool touch(const Cell& a, const Cell& b) {
    return std::abs(a.at.u - b.at.u) <= 1 && std::abs(a.at.v - b.at.v) <= 1;
  }

  /// They touch nearly as much as halves of one patch would: three pairs of cells for each of its width.
  /// Then it takes more than a small difference to tell them apart, for poses drift between visits.
  bool grown_together(std::size_t touching, double points) const {
    return static_cast<double>(touching) >= 2 * std::sqrt(points / points_per_cell_);
  }

  void note(const Cell& cell, const Cell& other, Contact& contact) {
    ++contact.tried;
    const VoxelPoint p = work_.window[points_[cell.first]];
    const Eigen::Vector3d from = p.position.cast<double>();
    const Eigen::Vector3d to = work_.window[points_[other.first]].position.cast<double>();
    if (careful_ && obstructed(work_, plane_, from, to, work_.state.noise.tolerance(p, plane_))) return;
    ++contact.open;
    contact.place += (from + to) / 2;
  }

  struct Pair {
    std::uint32_t a, b;
    double points;  // of the smaller
    Eigen::Vector3d contact;
    std::size_t touching;
  };

  void join() {
    std::vector<Pair> pairs;
    for (const auto& [pair, contact] : contacts())
      if (contact.open > 0)
        pairs.push_back({pair.first, pair.second,
                         std::min(patches_[pair.first].points, patches_[pair.second].points),
                         contact.place / static_cast<double>(contact.open), contact.touching});
    // The largest first: they say best what the plane is.
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& x, const Pair& y) { return x.points > y.points; });
    while (join_once(pairs)) {
    }
  }

  bool join_once(std::span<const Pair> pairs) {
    const double tolerance = work_.state.noise.base_tolerance();
    const double resolution = work_.state.parameters.occupancy.resolution;
    bool joined = false;
    for (const Pair& pair : pairs) {
      const std::size_t a = root(pair.a), b = root(pair.b);
      if (a == b) continue;
      const bool one = !careful_ || grown_together(pair.touching, pair.points) ||
                       one_plane(patches_[a], patches_[b], plane_, pair.contact, tolerance, resolution);
      if (!one) continue;
      Patch& into = patches_[std::min(a, b)];
      into.moments.add(patches_[std::max(a, b)].moments);
      into.points += patches_[std::max(a, b)].points;
      parents_[std::max(a, b)] = std::min(a, b);
      joined = true;
    }
    return joined;
  }

  std::size_t root(std::size_t part) const {
    while (parents_[part] != part) part = parents_[part];
    return part;
  }

  Workspace& work_;
  Plane plane_;
  int reach_;     // cells, h
  bool careful_;  // else the paper's clusters by h alone
  Eigen::Vector3d reference_;
  double points_per_cell_ = 1;
  std::vector<Cell> cells_;
  std::vector<Index> points_;
  std::vector<std::uint32_t> rows_;  // where each row of cells begins, and the end
  std::vector<Patch> patches_;
  std::vector<std::size_t> parents_;
};

}  // namespace

bool one_plane(const Patch& a, const Patch& b, const Plane& about, const Eigen::Vector3d& contact,
               double tolerance, double resolution) {
  constexpr double edge_bias = 0.007;  // rad, 0.4°: what edges and far views leave in a fit
  constexpr double limit = 16.3;       // χ² of three, 99.9 %
  const Eigen::Matrix3d R = plane_axes(about.normal).transpose();
  const double bias = tolerance / 30;
  const PlaneOverFrame of_a = height_of(a, R, contact, bias, resolution),
                       of_b = height_of(b, R, contact, bias, resolution);
  Eigen::Matrix3d covariance = of_a.covariance + of_b.covariance;
  covariance.diagonal() +=
      Eigen::Vector3d(tolerance * tolerance / 100, edge_bias * edge_bias, edge_bias * edge_bias);
  const Eigen::Vector3d difference = of_a.plane - of_b.plane;
  return difference.dot(covariance.ldlt().solve(difference)) <= limit;
}

std::vector<std::vector<Index>> parts_of(Workspace& work, std::span<const Index> points, const Plane& plane) {
  return Parts(work, points, plane)();
}

bool obstructed(Workspace& work, const Plane& plane, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                double reach) {
  const VoxelGrid& grid = work.state.occupancy.grid();
  const double d = grid.resolution();
  const auto lifted = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p + (reach + d - plane.signed_distance(p)) * plane.normal);
  };
  const Eigen::Vector3d from = lifted(a), way = lifted(b) - from;
  const int steps = static_cast<int>(std::ceil(2 * way.norm() / d));
  for (int k = 0; k <= steps; ++k) {
    VoxelKey key;
    if (!grid.key_of((from + way * (static_cast<double>(k) / std::max(1, steps))).cast<float>(), key))
      continue;
    const Index i = work.window.find(key);
    if (i == PointWindow::none) continue;
    const VoxelPoint& p = work.window[i];
    if (plane.signed_distance(p.position.cast<double>()) > work.state.noise.tolerance(p, plane)) return true;
  }
  return false;
}

}  // namespace octosurf
