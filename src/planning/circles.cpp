#include "planning/rings.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using BoostPoint = bg::model::d2::point_xy<double>;
using BoostSegment = bg::model::segment<BoostPoint>;
using BoostBox = bg::model::box<BoostPoint>;

struct Disc {
  Eigen::Vector2d center;
  double radius;
};

// Bounds on the work where min_radius is tiny: grid points along the longer side, boundary samples.
constexpr double grid_points = 300;
constexpr double boundary_samples = 20000;

/// Empty for a triangle of zero area, for which CGAL's circumcenter() asserts.
std::optional<Eigen::Vector2d> circumcenter(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                            const Eigen::Vector2d& c) {
  const Eigen::Vector2d q = b - a, r = c - a;
  const double denominator = 2 * (q.x() * r.y() - r.x() * q.y());
  if (denominator == 0) return {};
  const double q2 = q.squaredNorm(), r2 = r.squaredNorm();
  return a + Eigen::Vector2d(r.y() * q2 - q.y() * r2, q.x() * r2 - r.x() * q2) / denominator;
}

class Fill {
 public:
  Fill(const Polygon& polygon, double min_radius) : polygon_(polygon), min_radius_(min_radius) {
    std::vector<BoostSegment> segments;
    planning::for_each_edge(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      if (!a.allFinite()) throw Error(Error::Kind::data, "polygon", "a vertex is not finite");
      segments.emplace_back(BoostPoint(a.x(), a.y()), BoostPoint(b.x(), b.y()));
      low_ = low_.cwiseMin(a);
      high_ = high_.cwiseMax(a);
      perimeter_ += (b - a).norm();
    });
    edges_ = decltype(edges_)(segments);  // builds the tree
  }

  // Largest first, each only if its centre is not covered yet.
  std::vector<Disc> run() {
    if (edges_.empty()) return {};
    add_medial_candidates();
    add_grid_candidates();
    std::sort(candidates_.begin(), candidates_.end(), [](const Disc& a, const Disc& b) {
      return std::make_tuple(-a.radius, a.center.x(), a.center.y()) <
             std::make_tuple(-b.radius, b.center.x(), b.center.y());
    });
    std::vector<Disc> chosen;
    bgi::rtree<std::pair<BoostBox, std::size_t>, bgi::rstar<16>> boxes;
    for (const Disc& disc : candidates_) {
      const BoostPoint center(disc.center.x(), disc.center.y());
      const bool covered =
          std::any_of(boxes.qbegin(bgi::intersects(center)), boxes.qend(), [&](const auto& hit) {
            const Disc& other = chosen[hit.second];
            return (other.center - disc.center).norm() <= other.radius;
          });
      if (covered) continue;
      const BoostPoint low(disc.center.x() - disc.radius, disc.center.y() - disc.radius);
      const BoostPoint high(disc.center.x() + disc.radius, disc.center.y() + disc.radius);
      boxes.insert({BoostBox(low, high), chosen.size()});
      chosen.push_back(disc);
    }
    return chosen;
  }

 private:
  // `center` is known to be inside.
  void add_candidate(const Eigen::Vector2d& center) {
    const BoostPoint point(center.x(), center.y());
    const auto nearest_edge = edges_.qbegin(bgi::nearest(point, 1));
    const double radius = bg::distance(point, *nearest_edge);
    if (radius >= min_radius_) candidates_.push_back({center, radius});
  }

  // Centres of Delaunay circles of boundary samples lie near the medial axis, which has the centres of
  // maximal inscribed circles.
  void add_medial_candidates() {
    const double spacing = std::max(min_radius_ / 2, perimeter_ / boundary_samples);
    std::vector<Kernel::Point_2> samples;
    planning::for_each_edge(polygon_, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      const auto steps = static_cast<int>(std::ceil((b - a).norm() / spacing));
      for (int i = 0; i < steps; ++i) {
        const Eigen::Vector2d p = a + (b - a) * (static_cast<double>(i) / steps);
        samples.emplace_back(p.x(), p.y());
      }
    });
    const CGAL::Delaunay_triangulation_2<Kernel> delaunay(samples.begin(), samples.end());
    for (const auto face : delaunay.finite_face_handles()) {
      const auto corner = [&](int k) {
        const Kernel::Point_2& p = face->vertex(k)->point();
        return Eigen::Vector2d(p.x(), p.y());
      };
      const std::optional<Eigen::Vector2d> found = circumcenter(corner(0), corner(1), corner(2));
      if (!found) continue;
      const Eigen::Vector2d& center = *found;
      // Slivers of samples on one edge have arbitrary centres.
      if ((center.array() < low_.array()).any() || (center.array() > high_.array()).any()) continue;
      if (planning::contains(polygon_, center)) add_candidate(center);
    }
  }

  // Covers the space between the medial circles.
  void add_grid_candidates() {
    const Eigen::Vector2d extent = high_ - low_;
    const double step = std::max(min_radius_, extent.maxCoeff() / grid_points);
    for (double v = low_.y(); v <= high_.y(); v += step) {
      const std::vector<double> at = planning::crossings(polygon_, v);
      for (std::size_t i = 0; i + 1 < at.size(); i += 2) {
        double u = low_.x() + step * std::ceil((at[i] - low_.x()) / step);
        for (; u < at[i + 1]; u += step) add_candidate({u, v});
      }
    }
  }

  const Polygon& polygon_;
  double min_radius_;
  double perimeter_ = 0;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(HUGE_VAL);
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-HUGE_VAL);
  bgi::rtree<BoostSegment, bgi::rstar<16>> edges_;
  std::vector<Disc> candidates_;
};

}  // namespace

std::vector<Circle> circles(const Surface& surface, double min_radius) {
  if (!std::isfinite(min_radius) || min_radius <= 0) {
    throw Error(Error::Kind::usage, "min_radius", std::to_string(min_radius) + " is not greater than 0",
                "give the smallest useful radius in metres, such as 0.05");
  }
  std::vector<Circle> result;
  for (const Polygon& polygon : simplified(surface)) {
    for (const Disc& disc : Fill(polygon, min_radius).run()) {
      result.push_back({surface.to_map(disc.center), disc.radius});
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Circle& a, const Circle& b) { return a.radius > b.radius; });
  return result;
}

}  // namespace octosurf
