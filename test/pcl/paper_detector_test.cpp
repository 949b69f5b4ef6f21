// The paper's detector on a map, beside the paper's Algorithms 1 to 3 over plain lists of points.
#include "geometry/voxel_grid.hpp"
#include "pcl/steps.hpp"
#include "simulation/recording.hpp"
#include "support/alpha_shape_twin.hpp"
#include "support/guarantees.hpp"
#include "support/map_state.hpp"
#include "support/polygons.hpp"

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/explain.hpp>

namespace octosurf {
namespace {

using geometry::VoxelKey;
using ::testing::IsEmpty;

Parameters papers() {
  Parameters parameters = Parameters::paper(0.04);
  parameters.detection.search_radius = 0.06;
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

  explicit PaperTwin(const Parameters& parameters) : parameters_(parameters) {}

  bool has_point_at(const Eigen::Vector3d& p) const { return known_.contains(key_of(p.cast<float>())); }
  std::size_t size() const { return points_.size(); }
  /// The points that are new in a map; how many of them are in a surface afterwards.
  std::size_t insert(const Map& map) {
    pcl::Indices cloud;
    map.for_each_point([&](const OccupancyView::Voxel& voxel) {
      if (!known_.insert(key_of(voxel.point.cast<float>())).second) return;
      cloud.push_back(static_cast<std::uint32_t>(points_.size()));
      points_.push_back(voxel.point.cast<float>());
      views_.push_back(voxel.view.cast<float>());
    });
    const auto first = static_cast<std::ptrdiff_t>(taken_.size());
    taken_.resize(points_.size());
    for (Found* s : by_size()) {
      const test::Region inside(s->polygons);
      take(cloud, s->inliers, [&](std::uint32_t i) { return near(*s, i) && inside.covers(flat(*s, i)); });
    }
    for (Found* s : by_size()) expand(*s, cloud);
    pending_.insert(pending_.end(), cloud.begin(), cloud.end());
    detect();
    for (Found& surface : surfaces) derive(surface);
    return static_cast<std::size_t>(std::count(taken_.begin() + first, taken_.end(), true));
  }

  std::vector<Found> surfaces;

 private:
  VoxelKey key_of(const Eigen::Vector3f& p) const {
    VoxelKey key;
    EXPECT_TRUE(geometry::VoxelGrid(parameters_.occupancy.resolution).key_of(p, key));
    return key;
  }
  /// III-B: "ordered by size".
  std::vector<Found*> by_size() {
    std::vector<Found*> sorted;
    for (Found& surface : surfaces) sorted.push_back(&surface);
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Found* a, const Found* b) { return a->inliers.size() > b->inliers.size(); });
    return sorted;
  }
  bool near(const Found& surface, std::uint32_t i) const {
    return std::abs(surface.plane.signed_distance(points_[i].cast<double>())) <= s_;
  }
  Eigen::Vector2d flat(const Found& surface, std::uint32_t i) const {
    return (Eigen::Quaterniond::FromTwoVectors(surface.plane.normal, Eigen::Vector3d::UnitZ()) *
            points_[i].cast<double>())
        .head<2>();
  }
  template <class Which>
  void take(pcl::Indices& from, pcl::Indices& to, const Which& which) {
    const auto taken = std::stable_partition(from.begin(), from.end(), [&](auto i) { return !which(i); });
    for (auto i = taken; i != from.end(); ++i) taken_[*i] = true;
    to.insert(to.end(), taken, from.end());
    from.erase(taken, from.end());
  }
  /// III-B2, Algorithm 1.
  void expand(Found& surface, pcl::Indices& cloud) {
    pcl::Indices boundary = surface.boundary;
    for (std::size_t next = 0; next < boundary.size(); ++next)
      take(cloud, boundary, [&, center = points_[boundary[next]]](std::uint32_t i) {
        return (points_[i] - center).norm() <= h_ && near(surface, i);
      });
    surface.grown |= boundary.size() > surface.boundary.size();
    surface.inliers.insert(surface.inliers.end(), boundary.begin() + std::ssize(surface.boundary),
                           boundary.end());
  }
  /// III-C, Algorithm 2.
  void detect() {
    std::sort(pending_.begin(), pending_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key_of(points_[a]) < key_of(points_[b]); });
    pending_ = pick(pending_, pcl::with_neighbors(pick(points_, pending_), r_, 2));
    if (pending_.size() <= n_) return;
    const pcl::Points points = pick(points_, pending_);
    for (const pcl::Indices& smooth : pcl::smooth_regions(points, pcl::mls_normals(points, r_), r_)) {
      pcl::Indices region = pick(pending_, smooth);
      while (region.size() > n_) {
        const pcl::PlaneFit fit = pcl::fit_plane(pick(points_, region), s_);
        if (fit.inliers.empty()) break;
        const pcl::Indices inliers = pick(region, fit.inliers);
        for (const pcl::Indices& cluster : pcl::clusters(pick(points_, inliers), h_))
          if (cluster.size() > n_) add(fit.plane, pick(inliers, cluster));
        const std::set<std::uint32_t> gone(inliers.begin(), inliers.end());
        std::erase_if(region, [&](std::uint32_t i) { return gone.contains(i); });
      }
    }
    std::erase_if(pending_, [&](std::uint32_t i) { return taken_[i]; });
  }
  void add(const Plane& plane, const pcl::Indices& inliers) {
    Eigen::Vector3f seen_from = Eigen::Vector3f::Zero();
    for (const std::uint32_t i : inliers) {
      seen_from += views_[i].normalized();
      taken_[i] = true;
    }
    const double side = plane.normal.dot(seen_from.cast<double>()) < 0 ? -1 : 1;
    surfaces.push_back({{side * plane.normal, side * plane.offset}, inliers, {}, {}});
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
    surface.boundary.clear();
    const auto add_ring = [&](const Ring2& ring) {
      for (const Eigen::Vector2d& p : ring) surface.boundary.push_back(inlier_at.at({p.x(), p.y()}));
    };
    for (const Polygon& polygon : surface.polygons) {
      add_ring(polygon.outer);
      std::for_each(polygon.holes.begin(), polygon.holes.end(), add_ring);
    }
  }

  Parameters parameters_;
  double s_ = parameters_.surface_tolerance(), h_ = parameters_.max_hole_size();
  double r_ = parameters_.search_radius();
  std::size_t n_ = static_cast<std::size_t>(parameters_.min_surface_points());
  std::set<VoxelKey> known_;
  pcl::Points points_, views_;
  std::vector<bool> taken_;
  pcl::Indices pending_;
};

/// Each of ours is one of theirs: the same plane, and as many inliers and as much area as far as stated.
void expect_same(const Snapshot& ours, std::vector<PaperTwin::Found> theirs, double inliers, double area_m2) {
  EXPECT_EQ(ours.surfaces.size(), theirs.size());
  for (const SurfacePtr& a : ours.surfaces) {
    const auto same = std::find_if(theirs.begin(), theirs.end(), [&](const PaperTwin::Found& b) {
      return (a->plane.normal - b.plane.normal).norm() < 1e-9 &&
             std::abs(a->plane.offset - b.plane.offset) < 1e-9 &&
             std::abs(static_cast<double>(a->inliers) - static_cast<double>(b.inliers.size())) <= inliers &&
             std::abs(a->area_m2 - test::area(b.polygons)) <= area_m2;
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
    const double triangle = std::sqrt(3) / 4 * std::pow(parameters.max_hole_size(), 2);
    std::size_t grown = 0;
    for (Scan& scan : recording(scene, 6)) {
      std::erase_if(scan.points, [&](const Eigen::Vector3f& p) {
        return twin.has_point_at(scan.T_map_sensor * p.cast<double>());
      });
      const std::size_t before = twin.size();
      const ScanReport report = mapper.insert(scan);
      ASSERT_EQ(report.vanished, 0U);
      grown += report.added + report.expanded;
      EXPECT_EQ(report.categorized, twin.insert(mapper.map())) << scan.name;
      ASSERT_EQ(twin.size() - before, report.appeared);
      EXPECT_THAT(test::check_invariants(mapper.map()), IsEmpty());
    }
    EXPECT_GT(grown, 1000U);
    EXPECT_GE(twin.surfaces.size(), 5U);
    expect_same(*mapper.snapshot(), twin.surfaces, 2, triangle);
  }
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

}  // namespace
}  // namespace octosurf
