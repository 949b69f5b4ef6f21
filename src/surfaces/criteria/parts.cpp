#include "surfaces/criteria/parts.hpp"

#include "geometry/breadth_first.hpp"
#include "geometry/cell_rows.hpp"
#include "geometry/disjoint_sets.hpp"
#include "geometry/plane_covariance.hpp"
#include "surfaces/criteria/obstructed.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tsl/robin_map.h>
#include <tuple>
#include <utility>

namespace octosurf::surfaces {
namespace {

using Index = MapView::Index;

/// Covariance of the errors of a fit's slopes that are common to many points, such as those of one line of a
/// laser: `bias` m at one standard deviation of the patch's extent, from which the scatter inside a voxel is
/// subtracted.
Eigen::Matrix2d slope_bias(const geometry::Moments& moments, const Eigen::Matrix3d& R, double bias,
                           double resolution) {
  constexpr double smallest = 1e-8;  // m²
  const Eigen::Matrix2d extent = (R * moments.covariance() * R.transpose()).topLeftCorner<2, 2>() -
                                 Eigen::Matrix2d::Identity() * (resolution * resolution / 16);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(extent);
  const Eigen::Vector2d variances =
      (bias * bias * axes.eigenvalues().cwiseMax(smallest).cwiseInverse().array()).matrix();
  return axes.eigenvectors() * variances.asDiagonal() * axes.eigenvectors().transpose();
}

/// `R`: rows u, v, normal of the frame; `origin`: its origin.
geometry::PlaneOverFrame height_of(const Patch& patch, const Eigen::Matrix3d& R,
                                   const Eigen::Vector3d& origin, double bias, double resolution) {
  const geometry::Moments about = patch.moments.shifted(origin - patch.reference);
  geometry::PlaneOverFrame height = geometry::plane_over(about, R, patch.points);
  Eigen::Matrix<double, 3, 2> at_origin;  // a slope turns the patch about its own centre
  at_origin << -(R * about.sum / about.count).head<2>().transpose(), Eigen::Matrix2d::Identity();
  height.covariance += at_origin * slope_bias(patch.moments, R, bias, resolution) * at_origin.transpose();
  return height;
}

constexpr double edge_bias = 0.007;  // rad, 0.4°: error that edges and far views leave in a fit's slopes
constexpr double limit = 16.3;       // χ² of three, 99.9 %

double offset_bias(double tolerance) { return tolerance / 30; }

/// In cells about the map's origin, so that no point's place in the list decides where they begin.
geometry::PointsByCell by_cell(const MapView& map, std::span<const Index> points, const Plane& plane) {
  const SurfaceModel frame(0, plane, plane.offset * plane.normal, map.parameters.occupancy.resolution);
  std::vector<geometry::PlaneCell> cells;
  cells.reserve(points.size());
  for (const Index i : points) cells.push_back(frame.cell_of(map.window[i].position));
  return geometry::PointsByCell(points, cells);
}

/// Parts of a plane while they are joined.
class Parts {
 public:
  Parts(const MapView& map, std::span<const Index> points, const Plane& plane)
      : map_(map),
        plane_(plane),
        R_(geometry::plane_axes(plane.normal).transpose()),
        reach_(std::max(
            1, static_cast<int>(map.parameters.max_hole_size() / map.parameters.occupancy.resolution))),
        robust_(map.parameters.aligned()),
        reference_(map.window[points.front()].position.cast<double>()),
        points_(by_cell(map, points, plane)),
        rows_(points_.cells),
        depths_(rows_.depths()),
        sparse_(robust_ && sparse()),
        parts_(points_.cells.size(), unlabelled),
        points_per_cell_(static_cast<double>(points.size()) / static_cast<double>(points_.cells.size())) {
    label();
  }

  std::vector<std::vector<Index>> operator()() {
    join();
    std::vector<std::vector<Index>> joined(patches_.size());
    for (std::size_t cell = 0; cell < parts_.size(); ++cell) {
      std::vector<Index>& part = joined[joints_.root(parts_[cell])];
      const auto points = points_.of(cell);
      part.insert(part.end(), points.begin(), points.end());
    }
    std::erase_if(joined, [](const auto& part) { return part.empty(); });
    return joined;
  }

 private:
  static constexpr std::uint32_t unlabelled = ~std::uint32_t{0};
  static constexpr std::size_t min_sampled_gaps = 32;  // before gaps of a pair are left out
  static constexpr std::uint32_t last = ~std::uint32_t{0};
  struct Contact {
    std::uint32_t cell, other;
    bool touching;
    std::uint32_t next;  // of the same pair; or `last`
  };
  struct Pair {
    std::uint32_t a, b;
    double points = 0;                       // of the smaller
    std::uint32_t begin = last, end = last;  // of contacts_, as they were found
    std::size_t gap_candidates = 0, sampled_gaps = 0, touching = 0;
    std::optional<bool> free_contact = std::nullopt;  // empty: not known yet
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // mean of the unobstructed contacts
    std::array<std::size_t, 4> refused{};             // roots and their sizes when they were not one plane
  };

  /// Points of an object that stands on the plane, such as a shelf's board, can lie within the plane's
  /// tolerance and so bridge the gap that the object makes. Their cells are labelled last.
  void mark_covered_cells() {
    for (std::size_t cell = 0; cell < depths_.size(); ++cell) {
      const auto points = points_.of(cell);
      if (std::any_of(points.begin(), points.end(), [&](Index i) {
            const Eigen::Vector3d at = map_.window[i].position.cast<double>();
            return blocked(i, at, at);
          }))
        depths_[cell] = covered;
    }
  }

  /// The lines of a laser leave holes between them: cells without points that have five neighbours with some,
  /// or more. A plane seen through a crack has such holes too, but it is small.
  bool sparse() const {
    constexpr std::size_t min_cells = 600;
    constexpr std::size_t cells_per_hole = 7;  // at twelve a real depth camera's kitchen is cut up
    const std::vector<geometry::PlaneCell>& cells = points_.cells;
    if (cells.size() <= min_cells) return false;
    std::size_t holes = 0;
    for (std::size_t c = 0; c + 1 < cells.size(); ++c) {
      if (cells[c].v != cells[c + 1].v || cells[c].u + 2 != cells[c + 1].u) continue;
      std::uint32_t near = 0;
      rows_.for_each_run_within({cells[c].u + 1, cells[c].v}, 1,
                                [&](std::uint32_t first, std::uint32_t end) { near += end - first; });
      holes += near >= 5;
    }
    return holes * cells_per_hole > cells.size();
  }

  /// From the cells deepest inside outward, because noise bridges a gap in places. Cells whose surroundings
  /// are full are joined first where they touch; the parts then grow into the cells of the next lower depth,
  /// whose remaining cells make parts of their own; and so on.
  void label() {
    if (sparse_) mark_covered_cells();
    std::vector<std::uint32_t> reached;
    for (int depth = deepest; depth >= covered; --depth) {
      grow(std::exchange(reached, {}), depth, reached);
      for (std::uint32_t c = 0; c < parts_.size(); ++c) {
        if (parts_[c] != unlabelled || depths_[c] < depth) continue;
        parts_[c] = static_cast<std::uint32_t>(patches_.size());
        patches_.push_back({{}, reference_, 0});
        grow({c}, depth, reached);
      }
    }
    gather();
    joints_ = geometry::DisjointSets(patches_.size());
  }

  /// Breadth first over cells of at least this depth, so that parts that meet share what lies between.
  void grow(std::vector<std::uint32_t> open, int depth, std::vector<std::uint32_t>& reached) {
    geometry::breadth_first(open, [&](std::uint32_t from) {
      bool at_rim = false;
      rows_.for_each_run_within(points_.cells[from], 1, [&](std::uint32_t first, std::uint32_t end) {
        for (std::uint32_t c = first; c < end; ++c) {
          if (parts_[c] != unlabelled) continue;
          if (depths_[c] < depth) {
            at_rim = true;
            continue;
          }
          parts_[c] = parts_[from];
          open.push_back(c);
        }
      });
      if (at_rim) reached.push_back(from);
    });
  }

  static constexpr std::int8_t deepest = 2, covered = -1;  // covered: by an object on the plane

  void gather() {
    const sensing::NoiseModel& noise = map_.noise;
    std::array<double, sensing::NoiseModel::classes> weights{};
    for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c) {
      const double ratio = noise.sigma(1) / std::max(noise.sigma(c), 1e-6);
      weights[c] = ratio * ratio;
    }
    for (std::size_t cell = 0; cell < parts_.size(); ++cell) {
      Patch& patch = patches_[parts_[cell]];
      for (const Index i : points_.of(cell)) {
        const occupancy::VoxelPoint& p = map_.window[i];
        patch.moments.add(p.position.cast<double>() - patch.reference, weights[p.range_class]);
        ++patch.points;
      }
    }
  }

  /// Where parts touch, and some of the places where they face each other over a gap of up to h.
  void find_contacts() {
    const geometry::HighestAround highest(points_.cells, parts_, reach_);
    for (std::uint32_t cell = 0; cell < parts_.size(); ++cell) {
      const geometry::PlaneCell at = points_.cells[cell];
      if (highest(at) <= parts_[cell]) continue;
      rows_.for_each_run_within(at, 1, [&](std::uint32_t first, std::uint32_t end) {
        for (std::uint32_t c = first; c < end; ++c)
          if (parts_[c] > parts_[cell]) note(cell, c, true);
      });
      if (depths_[cell] > 0) continue;  // gaps are crossed from rim to rim
      rows_.for_each_run_within(at, reach_, [&](std::uint32_t first, std::uint32_t end) {
        for (std::uint32_t c = first; c < end; ++c)
          if (parts_[c] > parts_[cell] && !touch(at, points_.cells[c])) note(cell, c, false);
      });
    }
  }

  static bool touch(geometry::PlaneCell a, geometry::PlaneCell b) {
    return std::abs(a.u - b.u) <= 1 && std::abs(a.v - b.v) <= 1;
  }

  void note(std::uint32_t cell, std::uint32_t other, bool touching) {
    if (depths_[cell] == covered || depths_[other] == covered) return;
    Pair& pair = pair_of(parts_[cell], parts_[other]);
    // Gaps are sampled ever more sparsely, so that the samples are spread along the whole contact.
    const std::size_t stride = 1 + pair.sampled_gaps / min_sampled_gaps;
    if (!touching && pair.gap_candidates++ % (stride * stride) != 0) return;
    ++(touching ? pair.touching : pair.sampled_gaps);
    const auto place = static_cast<std::uint32_t>(contacts_.size());
    contacts_.push_back({cell, other, touching, last});
    (pair.begin == last ? pair.begin : contacts_[pair.end].next) = place;
    pair.end = place;
  }

  Pair& pair_of(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = std::uint64_t{a} << 32 | b;
    if (pairs_.empty() || key != last_pair_) {  // they come in runs
      const auto [entry, fresh] = places_.try_emplace(key, pairs_.size());
      if (fresh) pairs_.push_back({a, b, std::min(patches_[a].points, patches_[b].points)});
      last_pair_ = key;
      last_pair_place_ = entry->second;
    }
    return pairs_[last_pair_place_];
  }

  /// They touch nearly as much as two halves of one patch would, which have three touching pairs of cells for
  /// each cell of its width. Then a small difference does not part them, because poses drift between visits.
  bool touch_along_width(const Pair& pair) const {
    return static_cast<double>(pair.touching) >= 2 * std::sqrt(pair.points / points_per_cell_);
  }

  Eigen::Vector3d first_of(std::uint32_t cell) const {
    return map_.window[points_.points[points_.first[cell]]].position.cast<double>();
  }

  bool blocked(Index i, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const occupancy::VoxelPoint& p = map_.window[i];
    return obstructed(map_, plane_, from, to, map_.noise.tolerance(p, plane_), sparse_ ? reach_ : 1);
  }

  /// True if some contact is unobstructed; if `sparse_`, if most of them are, because an object between the
  /// parts may have no reading at some. Stores the mean place of the unobstructed contacts.
  bool has_free_contact(Pair& pair) {
    if (pair.free_contact) return *pair.free_contact;
    std::size_t unobstructed = 0, all = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint32_t k = pair.begin; k != last; k = contacts_[k].next, ++all) {
      const Contact& contact = contacts_[k];
      const Eigen::Vector3d from = first_of(contact.cell), to = first_of(contact.other);
      if (!contact.touching && robust_ && blocked(points_.points[points_.first[contact.cell]], from, to))
        continue;
      ++unobstructed;
      sum += contact.touching ? from : (from + to) / 2;
    }
    pair.free_contact = unobstructed > 0 && (!sparse_ || 2 * unobstructed > all);
    if (unobstructed > 0) pair.place = sum / static_cast<double>(unobstructed);
    return *pair.free_contact;
  }

  void join() {
    if (patches_.size() < 2) return;
    find_contacts();
    // The largest first: their planes are the most certain.
    std::sort(pairs_.begin(), pairs_.end(), [](const Pair& x, const Pair& y) {
      return std::tuple(-x.points, x.a, x.b) < std::tuple(-y.points, y.a, y.b);
    });
    slopes_.resize(patches_.size());
    while (join_once()) {
    }
  }

  bool join_once() {
    bool joined = false;
    for (Pair& pair : pairs_) {
      const std::size_t a = joints_.root(pair.a), b = joints_.root(pair.b);
      if (a == b) continue;
      if (robust_ && (!touch_along_width(pair) || !has_free_contact(pair)) && !explained_by_one(pair, a, b))
        continue;
      Patch& into = patches_[std::min(a, b)];
      into.moments.add(patches_[std::max(a, b)].moments);
      into.points += patches_[std::max(a, b)].points;
      joints_.join(std::min(a, b), std::max(a, b));
      joined = true;
    }
    return joined;
  }

  struct Slopes {
    double points = 0;  // of the patch when they were fitted
    Eigen::Vector2d slopes;
    Eigen::Matrix2d covariance;
  };
  const Slopes& slopes_of(std::size_t part) {
    Slopes& known = slopes_[part];
    const Patch& patch = patches_[part];
    if (known.points != patch.points) {
      const geometry::PlaneOverFrame fit =
          height_of(patch, R_, patch.reference + patch.moments.mean(),
                    offset_bias(map_.noise.base_tolerance()), map_.parameters.occupancy.resolution);
      known = {patch.points, fit.plane.tail<2>(), fit.covariance.bottomRightCorner<2, 2>()};
    }
    return known;
  }

  /// Their slopes differ too much for one plane, wherever they meet. A quick check before one_plane(): slopes
  /// do not depend on the place that they are taken about, and the χ² of the slopes alone is never larger
  /// than that with the heights.
  bool slopes_differ(std::size_t a, std::size_t b) {
    constexpr double rounding = 1.01;  // far more than rounding makes
    const Slopes &of_a = slopes_of(a), &of_b = slopes_of(b);
    const Eigen::Vector2d difference = of_a.slopes - of_b.slopes;
    const Eigen::Matrix2d covariance =
        of_a.covariance + of_b.covariance + edge_bias * edge_bias * Eigen::Matrix2d::Identity();
    return difference.dot(covariance.inverse() * difference) > rounding * limit;
  }

  /// A pair that was refused is not tried again before one of the two has grown.
  bool explained_by_one(Pair& pair, std::size_t a, std::size_t b) {
    if (slopes_differ(a, b) || !has_free_contact(pair)) return false;
    const std::array<std::size_t, 4> now{a, b, static_cast<std::size_t>(patches_[a].points),
                                         static_cast<std::size_t>(patches_[b].points)};
    if (now == pair.refused) return false;
    if (one_plane(patches_[a], patches_[b], plane_, pair.place, map_.noise.base_tolerance(),
                  map_.parameters.occupancy.resolution))
      return true;
    pair.refused = now;
    return false;
  }

  const MapView& map_;
  Plane plane_;
  Eigen::Matrix3d R_;  // rows u, v, normal
  int reach_;          // cells, h
  bool robust_;        // Parameters::aligned(); else the paper's clusters by h alone
  Eigen::Vector3d reference_;
  geometry::PointsByCell points_;
  geometry::CellRows rows_;
  std::vector<std::int8_t> depths_;  // of each cell
  bool sparse_;
  std::vector<std::uint32_t> parts_;  // of each cell
  double points_per_cell_;
  std::vector<Patch> patches_;
  geometry::DisjointSets joints_;  // parts; the root has the patch of all
  std::vector<Slopes> slopes_;
  std::vector<Contact> contacts_;
  std::vector<Pair> pairs_;
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> places_;
  std::uint64_t last_pair_ = 0;
  std::size_t last_pair_place_ = 0;
};

}  // namespace

bool one_plane(const Patch& a, const Patch& b, const Plane& about, const Eigen::Vector3d& contact,
               double tolerance, double resolution) {
  const Eigen::Matrix3d R = geometry::plane_axes(about.normal).transpose();
  const double bias = offset_bias(tolerance);
  const geometry::PlaneOverFrame of_a = height_of(a, R, contact, bias, resolution),
                                 of_b = height_of(b, R, contact, bias, resolution);
  Eigen::Matrix3d covariance = of_a.covariance + of_b.covariance;
  covariance.diagonal() +=
      Eigen::Vector3d(tolerance * tolerance / 100, edge_bias * edge_bias, edge_bias * edge_bias);
  const Eigen::Vector3d difference = of_a.plane - of_b.plane;
  return difference.dot(covariance.ldlt().solve(difference)) <= limit;
}

std::vector<std::vector<Index>> parts_of(const MapView& map, std::span<const Index> points,
                                         const Plane& plane) {
  return Parts(map, points, plane)();
}

}  // namespace octosurf::surfaces
