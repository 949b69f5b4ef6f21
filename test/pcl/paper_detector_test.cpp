// The paper's detector on a map, beside the paper's Algorithms 1 to 3 over plain lists of points.
#include "geometry/rings.hpp"
#include "pcl/steps.hpp"
#include "simulation/recording.hpp"
#include "support/alpha_shape_twin.hpp"
#include "support/guarantees.hpp"
#include "support/map_state.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <gmock/gmock.h>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/explain.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using ::testing::IsEmpty;

Parameters papers() {
  Parameters parameters = Parameters::paper();
  parameters.occupancy.resolution = 0.04;
  parameters.surfaces.surface_tolerance = parameters.surfaces.sensor_noise + 0.04 * std::sqrt(3.0);
  parameters.detection.search_radius = parameters.detection.normal_radius = 0.06;
  return parameters;
}

std::vector<Scan> recording(const std::string& scene, std::size_t frames) {
  simulation::SimulationOptions options;
  options.scene = scene;
  options.frames = frames;
  options.seed = test::seed();
  const simulation::Recording simulated(options);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < simulated.size(); ++i) scans.push_back(simulated.scan(i));
  return scans;
}

using Voxel = std::array<std::int64_t, 3>;
Voxel voxel_of(const Eigen::Vector3d& p, double resolution) {
  const Eigen::Array3d cell = (p / resolution).array().floor();
  return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
          static_cast<std::int64_t>(cell.z())};
}

/// Scans that add to a map and change nothing of what it has.
class OnlyNew {
 public:
  explicit OnlyNew(double resolution) : resolution_(resolution) {}

  /// Without the readings in voxels that hold a point.
  Scan thinned(Scan scan) const {
    std::erase_if(scan.points, [&](const Eigen::Vector3f& p) {
      return known_.contains(voxel_of(scan.T_map_sensor * p.cast<double>(), resolution_));
    });
    return scan;
  }
  /// The points that have come, in key order, and where they were seen from.
  void look(const Map& map) {
    points.clear();
    views.clear();
    map.for_each_point([&](const Map::Voxel& voxel) {
      if (!known_.insert(voxel_of(*voxel.point, resolution_)).second) return;
      points.push_back(voxel.point->cast<float>());
      views.push_back(voxel.view->cast<float>());
    });
  }
  std::vector<Eigen::Vector3f> points, views;

 private:
  double resolution_;
  std::set<Voxel> known_;
};

/// Those of `from` that `which` names.
template <class Element>
std::vector<Element> pick(const std::vector<Element>& from, const pcl::Indices& which) {
  std::vector<Element> picked;
  for (const std::uint32_t i : which) picked.push_back(from[i]);
  return picked;
}

/// The detector's slow twin: the paper's Algorithms 1 to 3, every point against every surface, nothing taken
/// back.
class PaperTwin {
 public:
  struct Found {
    Plane plane;
    pcl::Indices inliers, boundary;
    std::vector<Polygon> polygons;
    bool grown = true;
  };

  explicit PaperTwin(const Parameters& parameters)
      : d_(parameters.occupancy.resolution),
        s_(parameters.surface_tolerance()),
        h_(parameters.max_hole_size()),
        r_(parameters.search_radius()),
        n_(static_cast<std::size_t>(parameters.min_surface_points())),
        detection_(parameters.detection) {}

  /// How many of these points are in a surface afterwards.
  std::size_t insert(const pcl::Points& points, const pcl::Points& views) {
    const std::size_t first = points_.size();
    points_.insert(points_.end(), points.begin(), points.end());
    views_.insert(views_.end(), views.begin(), views.end());
    pcl::Indices cloud;
    for (std::size_t i = first; i < points_.size(); ++i) cloud.push_back(static_cast<std::uint32_t>(i));
    std::stable_sort(surfaces.begin(), surfaces.end(), [](const Found& a, const Found& b) {
      return a.inliers.size() > b.inliers.size();  // III-B: "ordered by size"
    });
    for (Found& surface : surfaces)
      move(cloud, surface.inliers, [&](std::uint32_t i) { return near(surface, i) && inside(surface, i); });
    std::stable_sort(surfaces.begin(), surfaces.end(),
                     [](const Found& a, const Found& b) { return a.inliers.size() > b.inliers.size(); });
    for (Found& surface : surfaces) expand(surface, cloud);
    pending_.insert(pending_.end(), cloud.begin(), cloud.end());
    detect();
    for (Found& surface : surfaces) derive(surface);
    std::size_t categorized = 0;
    for (const Found& surface : surfaces)
      categorized += static_cast<std::size_t>(std::count_if(surface.inliers.begin(), surface.inliers.end(),
                                                            [first](std::uint32_t i) { return i >= first; }));
    return categorized;
  }

  std::vector<Found> surfaces;

 private:
  bool near(const Found& surface, std::uint32_t i) const {
    return std::abs(surface.plane.signed_distance(points_[i].cast<double>())) <= s_;
  }
  Eigen::Vector2d flat(const Found& surface, std::uint32_t i) const {
    const Eigen::Matrix3d turn =
        Eigen::Quaterniond::FromTwoVectors(surface.plane.normal, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return (turn * points_[i].cast<double>()).head<2>();
  }
  /// IV-A: an odd number of all rings is around it.
  bool inside(const Found& surface, std::uint32_t i) const {
    const Eigen::Vector2d p = flat(surface, i);
    bool odd = false;
    const auto cross = [&](const Ring2& ring) {
      for (std::size_t k = 0; k < ring.size(); ++k) {
        const Eigen::Vector2d &a = ring[k], &b = ring[(k + 1) % ring.size()];
        if ((a.y() > p.y()) != (b.y() > p.y()))
          odd ^= p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      }
    };
    for (const Polygon& polygon : surface.polygons) {
      cross(polygon.outer);
      for (const Ring2& hole : polygon.holes) cross(hole);
    }
    return odd;
  }
  template <class Which>
  static void move(pcl::Indices& from, pcl::Indices& to, const Which& which) {
    const auto taken = std::stable_partition(from.begin(), from.end(), [&](auto i) { return !which(i); });
    to.insert(to.end(), taken, from.end());
    from.erase(taken, from.end());
  }
  /// III-B2, Algorithm 1.
  void expand(Found& surface, pcl::Indices& cloud) {
    pcl::Indices boundary = surface.boundary;
    for (std::size_t next = 0; next < boundary.size(); ++next) {
      const Eigen::Vector3f center = points_[boundary[next]];
      const std::size_t before = boundary.size();
      move(cloud, boundary,
           [&](std::uint32_t i) { return (points_[i] - center).norm() <= h_ && near(surface, i); });
      surface.grown |= boundary.size() > before;
      surface.inliers.insert(surface.inliers.end(), boundary.begin() + static_cast<std::ptrdiff_t>(before),
                             boundary.end());
    }
  }
  /// III-C, Algorithm 2.
  void detect() {
    std::sort(pending_.begin(), pending_.end(), [&](std::uint32_t a, std::uint32_t b) {
      const Voxel v = voxel_of(points_[a].cast<double>(), d_), w = voxel_of(points_[b].cast<double>(), d_);
      return std::tuple(v[2], v[1], v[0]) < std::tuple(w[2], w[1], w[0]);
    });
    pending_ = pick(pending_, pcl::with_neighbors(pick(points_, pending_), r_, 2));
    if (pending_.size() <= n_) return;
    const auto normals = pcl::mls_normals(pick(points_, pending_), r_);
    pcl::Indices known;
    for (const pcl::PointNormal& normal : normals) known.push_back(pending_[normal.point]);
    std::set<std::uint32_t> placed;
    for (const pcl::Indices& smooth : pcl::smooth_regions(
             pick(points_, known), normals, r_, detection_.smoothness_angle, detection_.max_curvature, n_)) {
      pcl::Indices region = pick(known, smooth);
      while (region.size() > n_) {
        const pcl::PlaneFit fit = pcl::fit_plane(pick(points_, region), s_, detection_.ransac_iterations);
        if (fit.inliers.empty()) break;
        const pcl::Indices inliers = pick(region, fit.inliers);
        for (const pcl::Indices& cluster : pcl::clusters(pick(points_, inliers), h_, n_ + 1)) {
          surfaces.push_back({fit.plane, pick(inliers, cluster), {}, {}});
          Eigen::Vector3f seen_from = Eigen::Vector3f::Zero();
          for (const std::uint32_t i : surfaces.back().inliers) seen_from += views_[i].normalized();
          if (fit.plane.normal.dot(seen_from.cast<double>()) < 0)
            surfaces.back().plane = {-fit.plane.normal, -fit.plane.offset};
          placed.insert(surfaces.back().inliers.begin(), surfaces.back().inliers.end());
        }
        const std::set<std::uint32_t> gone(inliers.begin(), inliers.end());
        std::erase_if(region, [&](std::uint32_t i) { return gone.contains(i); });
      }
    }
    std::erase_if(pending_, [&](std::uint32_t i) { return placed.contains(i); });
  }
  /// IV-A, Algorithm 3, where something was expanded.
  void derive(Found& surface) const {
    if (!std::exchange(surface.grown, false)) return;
    std::vector<Eigen::Vector2d> points;
    std::map<std::pair<double, double>, std::uint32_t> inlier_at;
    for (const std::uint32_t i : surface.inliers) {
      points.push_back(flat(surface, i));
      inlier_at[{points.back().x(), points.back().y()}] = i;
    }
    surface.polygons = alpha_shape(points, h_);
    std::set<std::uint32_t> boundary;
    const auto add = [&](const Ring2& ring) {
      for (const Eigen::Vector2d& p : ring) boundary.insert(inlier_at.at({p.x(), p.y()}));
    };
    for (const Polygon& polygon : surface.polygons) {
      add(polygon.outer);
      for (const Ring2& hole : polygon.holes) add(hole);
    }
    surface.boundary.assign(boundary.begin(), boundary.end());
  }

  double d_, s_, h_, r_;
  std::size_t n_;
  DetectionParameters detection_;
  pcl::Points points_, views_;
  pcl::Indices pending_;
};

double area_of(const PaperTwin::Found& surface) {
  double area = 0;
  for (const Polygon& polygon : surface.polygons) {
    area += geometry::signed_area(polygon.outer);
    for (const Ring2& hole : polygon.holes) area += geometry::signed_area(hole);
  }
  return area;
}

/// Each of ours is one of theirs: the same plane, and as many inliers and as much area as far as stated.
void expect_same(const Snapshot& ours, std::vector<PaperTwin::Found> theirs, double inliers, double area_m2) {
  EXPECT_EQ(ours.surfaces.size(), theirs.size());
  for (const SurfacePtr& a : ours.surfaces) {
    const auto same = std::find_if(theirs.begin(), theirs.end(), [&](const PaperTwin::Found& b) {
      return (a->plane.normal - b.plane.normal).norm() < 1e-9 &&
             std::abs(a->plane.offset - b.plane.offset) < 1e-9 &&
             std::abs(static_cast<double>(a->inliers) - static_cast<double>(b.inliers.size())) <= inliers &&
             std::abs(a->area_m2 - area_of(b)) <= area_m2;
    });
    EXPECT_NE(same, theirs.end()) << "surface " << a->id << " of " << a->inliers << " inliers";
    if (same != theirs.end()) theirs.erase(same);
  }
}

// Each adds what is new to the planes that it has, expands them, and looks for others in what is left.
// Outlines differ by what lies on the edge: ours drops triangles with a side over h cos 1°, and projects
// along a normal that the plane's may leave by as much; a point beside such a triangle's is inside of one of
// the two.
TEST(PaperDetector, IsThePapersAlgorithmWhereNothingIsTakenBack) {
  for (const std::string scene : {"room", "stones"}) {
    SCOPED_TRACE(scene);
    Parameters parameters = papers();
    parameters.occupancy.miss = 0.4999;  // nothing vanishes
    Mapper mapper(parameters, 1, paper_detector());
    PaperTwin twin(parameters);
    OnlyNew only_new(parameters.occupancy.resolution);
    const double triangle = std::sqrt(3) / 4 * std::pow(parameters.max_hole_size(), 2);
    std::size_t grown = 0;
    for (const Scan& scan : recording(scene, 6)) {
      const ScanReport report = mapper.insert(only_new.thinned(scan));
      ASSERT_EQ(report.vanished, 0U);
      grown += report.added + report.expanded;
      only_new.look(mapper.map());
      ASSERT_EQ(only_new.points.size(), report.appeared);
      EXPECT_EQ(report.categorized, twin.insert(only_new.points, only_new.views)) << scan.name;
      EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
    }
    EXPECT_GT(grown, 1000U);
    EXPECT_GE(twin.surfaces.size(), 5U);
    expect_same(*mapper.snapshot(), twin.surfaces, 2, triangle);
  }
}

TEST(PaperDetector, TakesBackWhatTheWorldTakesAway) {
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  Mapper mapper(papers(), 1, paper_detector());
  mapper.insert(test::rectangle_scan(eye, {0, 0, 0.5}, {0.6, 0, 0}, {0, 0.6, 0}));
  ASSERT_EQ(mapper.snapshot()->surfaces.size(), 1U);
  const SurfaceId table = mapper.snapshot()->surfaces[0]->id;
  for (int i = 0; i < 12; ++i)
    mapper.insert(test::rectangle_scan(eye, {-0.5, -0.5, 0}, {2, 0, 0}, {0, 2, 0}));
  EXPECT_EQ(mapper.snapshot()->find(table), nullptr);
  EXPECT_EQ(mapper.snapshot()->surfaces.size(), 1U);
  test::expect_guarantees(mapper.map());
}

/// A floor at z = 0 from x to x + width, 1 m deep.
Scan strip(double x, double width) {
  return test::rectangle_scan({0.5, 0.5, 1.5}, {x, 0, 0}, {width, 0, 0}, {0, 1, 0});
}

// What the first has found takes in what the others add, though no snapshot has come in between.
TEST(PaperDetector, ScansThatAreMappedTogetherMakeOneSurface) {
  Mapper mapper(papers(), 1, paper_detector());
  mapper.insert_all(std::vector{strip(0, 0.5), strip(0.5, 0.3), strip(0.8, 0.4)});
  ASSERT_EQ(mapper.snapshot()->surfaces.size(), 1U);
  EXPECT_NEAR(mapper.snapshot()->surfaces[0]->area_m2, 1.16 * 0.96, 0.02);  // to the boundaries' centroids
  test::expect_guarantees(mapper.map());
}

TEST(PaperDetector, TakesInAnotherMap) {
  Mapper here(papers(), 1, paper_detector()), there(papers(), 1, paper_detector());
  here.insert(strip(0, 0.6));
  there.insert(strip(0.4, 0.6));
  here.merge(there.map());
  const Snapshot both = *here.snapshot();
  ASSERT_EQ(both.surfaces.size(), 2U);  // they never merge
  EXPECT_NEAR(both.surfaces[0]->area_m2 + both.surfaces[1]->area_m2, 0.92 * 0.96, 0.03);
  test::expect_guarantees(here.map());
}

// Later readings are better, and would move the plane of any other detector.
TEST(PaperDetector, NeverFitsAPlaneAgain) {
  Mapper mapper(papers(), 1, paper_detector());
  mapper.insert(strip(0, 1));
  const Plane first = mapper.snapshot()->surfaces.at(0)->plane;
  for (int i = 0; i < 5; ++i) {
    Scan lower = strip(0, 1.5);
    for (Eigen::Vector3f& p : lower.points) p.z() -= 0.005F;
    mapper.insert(lower);
  }
  EXPECT_EQ(mapper.snapshot()->surfaces.at(0)->plane.normal, first.normal);
  EXPECT_EQ(mapper.snapshot()->surfaces.at(0)->plane.offset, first.offset);
}

TEST(PaperDetector, SaysWhyThereIsNoSurface) {
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  const auto plate = [&](double x, double edge) {
    return test::rectangle_scan(eye, {x, 0, 0.5}, {edge, 0, 0}, {0, edge, 0});
  };
  Mapper mapper(papers(), 1, paper_detector());
  mapper.insert(plate(0, 0.22));  // some 36 voxels each, of 50, and 20 cm apart
  mapper.insert(plate(0.42, 0.22));
  mapper.insert(plate(2, 0.01));
  ASSERT_THAT(mapper.snapshot()->surfaces, IsEmpty());
  EXPECT_EQ(explain(mapper.map(), {2.005, 0.005, 0.5}, paper_detector()).reason, Reason::isolated);
  const Explanation few = explain(mapper.map(), {0.1, 0.1, 0.5}, paper_detector());
  ASSERT_EQ(few.reason, Reason::too_few_points);
  EXPECT_NEAR(few.figures.at(0).value, 36, 7);
  EXPECT_EQ(few.figures.at(0).at_least, 51);
}

TEST(PaperDetector, LooksAtAWholeMapAsThePapersAlgorithmDoes) {
  const Parameters parameters = papers();
  Mapper mapper(parameters, 1, paper_detector());
  for (const Scan& scan : recording("room", 6)) mapper.insert(scan);
  OnlyNew all(parameters.occupancy.resolution);
  all.look(mapper.map());
  mapper.resegment();
  test::expect_guarantees(mapper.map());
  PaperTwin twin(parameters);
  twin.insert(all.points, all.views);
  EXPECT_GE(twin.surfaces.size(), 3U);
  expect_same(*mapper.snapshot(), twin.surfaces, 2,
              std::sqrt(3) / 4 * std::pow(parameters.max_hole_size(), 2));
}

}  // namespace
}  // namespace octosurf
