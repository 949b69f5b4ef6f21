// The paper's detector on a map, beside the paper's pipeline outside of octosurf.
#include "reference/paper_pipeline.hpp"
#include "simulation/recording.hpp"
#include "support/guarantees.hpp"
#include "support/map_state.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <gmock/gmock.h>
#include <set>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/explain.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using ::testing::IsEmpty;

Parameters papers() {
  enable_paper_detector();
  return reference::paper_parameters_small_radius(0.04);
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

/// In order of the offset: ids hang on what was there before.
std::vector<Plane> planes_of(const Snapshot& snapshot) {
  std::vector<Plane> planes;
  for (const SurfacePtr& surface : snapshot.surfaces) planes.push_back(surface->plane);
  std::sort(planes.begin(), planes.end(), [](const Plane& a, const Plane& b) {
    return std::pair(a.offset, a.normal.x()) < std::pair(b.offset, b.normal.x());
  });
  return planes;
}

void expect_same_planes(const Snapshot& ours, const Snapshot& theirs) {
  const std::vector<Plane> a = planes_of(ours), b = planes_of(theirs);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LT((a[i].normal - b[i].normal).norm(), 1e-9);
    EXPECT_NEAR(a[i].offset, b[i].offset, 1e-9);
  }
}

// Each adds what is new to the planes that it has, expands them, and looks for others in what is left.
// Outlines differ by what lies on the edge: ours drops triangles with a side over h cos 1°, and projects
// along a normal that the plane's may leave by as much; a point beside such a triangle's is inside of one of
// the two.
TEST(PaperDetector, HasThePlanesOfPclsPipelineWhereNothingIsTakenBack) {
  for (const std::string scene : {"room", "stones"}) {
    SCOPED_TRACE(scene);
    Parameters parameters = papers();
    parameters.occupancy.miss = 0.4999;  // nothing vanishes
    Mapper mapper(parameters);
    reference::PaperPipeline pipeline(parameters);
    OnlyNew only_new(parameters.occupancy.resolution);
    const double triangle = std::sqrt(3) / 4 * std::pow(parameters.max_hole_size(), 2);
    std::size_t grown = 0;
    for (const Scan& scan : recording(scene, 6)) {
      const ScanReport report = mapper.insert(only_new.thinned(scan));
      ASSERT_EQ(report.vanished, 0U);
      grown += report.added + report.expanded;
      only_new.look(mapper.map());
      ASSERT_EQ(only_new.points.size(), report.appeared);
      const reference::PaperReport theirs = pipeline.insert_points(only_new.points, only_new.views);
      EXPECT_EQ(report.categorized, theirs.categorized) << scan.name;
      EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
    }
    const Snapshot ours = *mapper.snapshot(), theirs = pipeline.snapshot();
    EXPECT_GT(grown, 1000U);
    EXPECT_GE(ours.surfaces.size(), 5U);
    expect_same_planes(ours, theirs);
    for (std::size_t i = 0; i < std::min(ours.surfaces.size(), theirs.surfaces.size()); ++i) {
      const Surface &a = *ours.surfaces[i], &b = *theirs.surfaces[i];
      EXPECT_NEAR(static_cast<double>(a.inliers), static_cast<double>(b.inliers), 2) << a.id;
      EXPECT_NEAR(a.area_m2, b.area_m2, triangle) << a.id;
    }
  }
}

TEST(PaperDetector, TakesBackWhatTheWorldTakesAway) {
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  Mapper mapper(papers());
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
  Mapper mapper(papers());
  mapper.insert_all(std::vector{strip(0, 0.5), strip(0.5, 0.3), strip(0.8, 0.4)});
  ASSERT_EQ(mapper.snapshot()->surfaces.size(), 1U);
  EXPECT_NEAR(mapper.snapshot()->surfaces[0]->area_m2, 1.16 * 0.96, 0.02);  // to the rims' centroids
  test::expect_guarantees(mapper.map());
}

TEST(PaperDetector, TakesInAnotherMap) {
  Mapper here(papers()), there(papers());
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
  Mapper mapper(papers());
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
  Mapper mapper(papers());
  mapper.insert(plate(0, 0.22));  // some 36 voxels each, of 50, and 20 cm apart
  mapper.insert(plate(0.42, 0.22));
  mapper.insert(plate(2, 0.01));
  ASSERT_THAT(mapper.snapshot()->surfaces, IsEmpty());
  EXPECT_EQ(explain(mapper.map(), {2.005, 0.005, 0.5}).reason, Reason::isolated);
  const Explanation few = explain(mapper.map(), {0.1, 0.1, 0.5});
  ASSERT_EQ(few.reason, Reason::too_few_points);
  EXPECT_NEAR(few.figures.at(0).value, 36, 7);
  EXPECT_EQ(few.figures.at(0).at_least, 51);
}

TEST(PaperDetector, LooksAtAWholeMapAsPclsPipelineDoesOffline) {
  const Parameters parameters = papers();
  Mapper mapper(parameters);
  for (const Scan& scan : recording("room", 6)) mapper.insert(scan);
  OnlyNew all(parameters.occupancy.resolution);
  all.look(mapper.map());
  mapper.resegment();
  test::expect_guarantees(mapper.map());
  const Snapshot theirs = reference::paper_pipeline_offline(all.points, all.views, parameters);
  EXPECT_GE(theirs.surfaces.size(), 3U);
  expect_same_planes(*mapper.snapshot(), theirs);
}

}  // namespace
}  // namespace octosurf
