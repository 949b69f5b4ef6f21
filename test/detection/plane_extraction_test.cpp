// Plane extraction by itself, out of regions that are handed to it; and how it counts a plane's points.
#include "detection/plane_extraction.hpp"

#include "detection/region_points.hpp"
#include "pending_points.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"

#include <gmock/gmock.h>
#include <random>

namespace octosurf::detection {
namespace {

using test::PendingPoints;
using test::rectangle_scan;
using ::testing::Contains;
using ::testing::Field;
using ::testing::IsEmpty;
using Index = occupancy::PointWindow::Index;

const Eigen::Vector3d eye(0.5, 0.5, 2);

struct Extracted {
  std::vector<const surfaces::SurfaceModel*> surfaces;
  std::vector<PlaneProposal> refused;

  const PlaneProposal* refusal(Reason reason, std::string_view what = {}) const {
    const auto at = std::find_if(refused.begin(), refused.end(), [&](const PlaneProposal& p) {
      return p.refusal->reason == reason && p.refusal->what == what;
    });
    return at == refused.end() ? nullptr : &*at;
  }
};

/// All of the points as one region.
Extracted extracted(PendingPoints& pending) {
  Extracted result;
  PlaneExtraction planes(pending.ledger, pending.all);
  while (std::optional<PlaneProposal> proposal = planes.next()) {
    if (proposal->refusal) {
      result.refused.push_back(std::move(*proposal));
      continue;
    }
    surfaces::SurfaceModel& surface =
        pending.state.surfaces.create(proposal->plane, pending.position(proposal->points.front()));
    for (const Index i : proposal->points) pending.ledger.give(i, surface);
    result.surfaces.push_back(&surface);
  }
  return result;
}

double angle_deg(const Plane& plane, const Eigen::Vector3d& normal) {
  return std::atan2(plane.normal.cross(normal).norm(), plane.normal.dot(normal)) * 180 / std::numbers::pi;
}

TEST(PlaneExtraction, APlaneIsASurfaceOfAllItsPoints) {
  std::mt19937_64 rng = test::rng();
  for (int round = 0; round < 5; ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const Eigen::Vector3d x = pose.linear().col(0), y = pose.linear().col(1), n = pose.linear().col(2);
    PendingPoints pending({rectangle_scan(pose.translation() + 1.5 * n,
                                          pose.translation() - 0.3 * x - 0.2 * y, 0.6 * x, 0.4 * y)});
    const Extracted result = extracted(pending);
    ASSERT_EQ(result.surfaces.size(), 1U);
    EXPECT_EQ(result.surfaces[0]->size(), pending.all.size());
    // Points are stored to 1/256 voxel (0.08 mm, rms 0.023 mm): over a hundred of them on 0.4 m.
    EXPECT_LT(angle_deg(result.surfaces[0]->plane(), n), 0.02);
    EXPECT_NEAR(result.surfaces[0]->plane().signed_distance(pose.translation()), 0, 2e-5);
    for (const Index i : pending.all) EXPECT_EQ(pending.ledger.window[i].surface, result.surfaces[0]->id());
  }
}

TEST(PlaneExtraction, TakesTheLargestPlaneFirst) {
  // Three steps of a stair in one region, each 0.1 m higher and narrower than the one before.
  std::vector<Scan> steps;
  for (int i = 0; i < 3; ++i)
    steps.push_back(rectangle_scan(eye, {0.4 * i, 0, 0.01 + 0.1 * i}, {0.4 - 0.1 * i, 0, 0}, {0, 1, 0}));
  PendingPoints pending(steps);
  const Extracted result = extracted(pending);
  ASSERT_EQ(result.surfaces.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(result.surfaces[static_cast<std::size_t>(i)]->id(), static_cast<SurfaceId>(i + 1));
    EXPECT_NEAR(result.surfaces[static_cast<std::size_t>(i)]->plane().offset, 0.01 + 0.1 * i, 1e-4);
    EXPECT_LT(angle_deg(result.surfaces[static_cast<std::size_t>(i)]->plane(), Eigen::Vector3d::UnitZ()),
              0.02);
  }
}

TEST(PlaneExtraction, OnePlanesPartsBeyondHAreSurfacesOfTheirOwn) {
  const double h = Parameters{}.max_hole_size();
  for (const bool far : {true, false}) {
    const double gap = far ? 1.5 * h : 0.5 * h;
    PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.4, 0, 0}, {0, 0.8, 0}),
                           rectangle_scan(eye, {0.4 + gap, 0, 0.01}, {0.4, 0, 0}, {0, 0.8, 0})});
    const Extracted result = extracted(pending);
    ASSERT_EQ(result.surfaces.size(), far ? 2U : 1U);
    std::size_t points = 0;
    for (const surfaces::SurfaceModel* s : result.surfaces) points += s->size();
    EXPECT_EQ(points, pending.all.size());
  }
}

TEST(PlaneExtraction, TellsWhatIsLeftBesideThePlanes) {
  // A floor, and some points 0.2 m above it: too few for a plane of their own.
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.6, 0, 0}, {0, 0.6, 0}),
                         rectangle_scan(eye, {0.2, 0.2, 0.21}, {0.08, 0, 0}, {0, 0.08, 0})});
  const auto above = static_cast<std::size_t>(std::count_if(
      pending.all.begin(), pending.all.end(), [&](Index i) { return pending.position(i).z() > 0.1; }));
  ASSERT_GT(above, 10U);
  const Extracted result = extracted(pending);
  ASSERT_EQ(result.surfaces.size(), 1U);
  const PlaneProposal* left = result.refusal(Reason::too_few_points, surfaces::few::left_over);
  ASSERT_NE(left, nullptr);
  EXPECT_EQ(left->points.size(), above);
  EXPECT_EQ(left->refusal->measured, static_cast<double>(above));
  EXPECT_EQ(left->refusal->limit, pending.state.parameters.min_surface_points());
}

TEST(PlaneExtraction, TellsAClusterThatIsTooSmall) {
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.6, 0, 0}, {0, 0.6, 0}),
                         rectangle_scan(eye, {0.8, 0.2, 0.01}, {0.1, 0, 0}, {0, 0.1, 0})});
  const auto beside = static_cast<std::size_t>(std::count_if(
      pending.all.begin(), pending.all.end(), [&](Index i) { return pending.position(i).x() > 0.7; }));
  const Extracted result = extracted(pending);
  ASSERT_EQ(result.surfaces.size(), 1U);
  const PlaneProposal* small = result.refusal(Reason::too_few_points, surfaces::few::in_cluster);
  ASSERT_NE(small, nullptr);
  EXPECT_EQ(small->points.size(), beside);
  EXPECT_EQ(small->refusal->measured, static_cast<double>(beside));
}

TEST(PlaneExtraction, TellsHowNarrowAStripIs) {
  PendingPoints pending({rectangle_scan(eye, {0, 0.005, 0.01}, {1.5, 0, 0}, {0, 0.03, 0})});
  pending.state.parameters.surfaces.min_surface_width = 0.05;
  const Extracted result = extracted(pending);
  EXPECT_THAT(result.surfaces, IsEmpty());
  const PlaneProposal* narrow = result.refusal(Reason::too_narrow);
  ASSERT_NE(narrow, nullptr);
  EXPECT_EQ(narrow->refusal->limit, 0.05);
  // Readings at y = 5 and 14 mm in one row of voxels, 23 and 32 mm in the next: their means are 18 mm apart,
  // as are those of the halves of what spreads uniformly over √12·9 = 31.2 mm.
  EXPECT_NEAR(narrow->refusal->measured, 0.0312, 0.0003);
}

TEST(PlaneExtraction, ALatticeIsAsNarrowAsItsBars) {
  // Half a metre wide in all, as a ladder's front is.
  Parameters parameters;
  parameters.occupancy.resolution = 0.01;
  for (const double bar : {0.02, 0.05}) {
    std::vector<Scan> bars;
    for (const double at : {0.0, 0.25, 0.5}) {
      bars.push_back(rectangle_scan(eye, {at, 0, 0.015}, {bar, 0, 0}, {0, 0.55, 0}, 0.004));
      bars.push_back(rectangle_scan(eye, {0, at, 0.015}, {0.55, 0, 0}, {0, bar, 0}, 0.004));
    }
    PendingPoints pending(bars, parameters);
    const Extracted result = extracted(pending);
    ASSERT_EQ(result.surfaces.size(), bar < 0.03 ? 0U : 1U) << bar;
    if (bar > 0.03) continue;
    const PlaneProposal* narrow = result.refusal(Reason::too_narrow);
    ASSERT_NE(narrow, nullptr);
    EXPECT_EQ(narrow->refusal->limit, 0.03);
    EXPECT_NEAR(narrow->refusal->measured, bar, 0.25 * bar);
  }
}

TEST(PlaneExtraction, ALineSpansNoPlane) {
  // A region of points in one line, as a laser that does not tilt would leave.
  Scan line;
  line.T_map_sensor.translation() = Eigen::Vector3d(0.51, 0.51, 0.51);
  for (double x = -1; x < 1; x += 0.02) line.points.emplace_back(static_cast<float>(x), 0.F, -0.5F);
  PendingPoints pending({line});
  ASSERT_GE(pending.all.size(), 90U);
  const Extracted result = extracted(pending);
  EXPECT_THAT(result.surfaces, IsEmpty());
  EXPECT_TRUE(result.refusal(Reason::too_few_points, surfaces::few::off_a_line) != nullptr ||
              result.refusal(Reason::too_narrow) != nullptr ||
              result.refusal(Reason::too_few_points, surfaces::few::on_plane) != nullptr);
}

TEST(PlaneExtraction, ScatterAboveTheNoiseIsNoPlane) {
  // Uniform within ±s of a plane: rms s/√3, against 1.7 σ. With s = 30 mm that is 17 mm: 8.7 σ of 2 mm, and
  // 0.87 σ of 20 mm.
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<float> uniform(-0.03F, 0.03F);
  Scan scan = rectangle_scan(eye, {0, 0, 0.05}, {0.8, 0, 0}, {0, 0.8, 0});
  for (Eigen::Vector3f& p : scan.points) p.z() += uniform(rng);
  for (const double sigma : {0.002, 0.02}) {
    Parameters parameters;
    parameters.surfaces.sensor_noise = sigma;
    parameters.surfaces.range_noise = 0;
    parameters.surfaces.surface_tolerance = 0.03;
    parameters.detection.aligned_angle = 1.4;  // rad: normals of such clutter point anywhere
    PendingPoints pending({scan}, parameters);
    const Extracted result = extracted(pending);
    const PlaneProposal* scattered = result.refusal(Reason::scattered);
    ASSERT_EQ(scattered != nullptr, sigma < 0.01);
    if (scattered == nullptr) continue;
    EXPECT_THAT(result.surfaces, IsEmpty());
    EXPECT_GT(scattered->refusal->measured, 4) << "in σ";
    EXPECT_EQ(scattered->refusal->limit, 1.7);
  }
}

TEST(PlaneExtraction, APillarsFacetIsBent) {
  Scan pillar;
  pillar.T_map_sensor.translation() = Eigen::Vector3d(1.5, 0, 0.5);
  for (double z = 0; z < 1; z += 0.009)
    for (double a = -1.2; a < 1.2; a += 0.03)
      pillar.points.push_back(
          (Eigen::Vector3d(0.25 * std::cos(a), 0.25 * std::sin(a), z) - pillar.T_map_sensor.translation())
              .cast<float>());
  PendingPoints pending({pillar});
  const Extracted result = extracted(pending);
  EXPECT_THAT(result.surfaces, IsEmpty());
  EXPECT_NE(result.refusal(Reason::bent), nullptr);
}

TEST(PlaneExtraction, ASheetInASurfacesNoiseIsNone) {
  // A wall that is known, and points 22 mm before it, where s is 20 mm: within 1.3 s they may be its noise.
  Parameters parameters;
  parameters.surfaces.sensor_noise = 0.01;
  const Eigen::Vector3d from(1.5, 0.5, 0.5);
  for (const bool near : {true, false}) {
    PendingPoints pending({rectangle_scan(from, {0.003, 0, 0}, {0, 1, 0}, {0, 0, 1}),
                           rectangle_scan(from, {near ? 0.0255 : 0.103, 0.2, 0.2}, {0, 0.6, 0}, {0, 0, 0.6})},
                          parameters);
    surfaces::SurfaceModel& wall =
        pending.state.surfaces.create({Eigen::Vector3d::UnitX(), 0.003}, {0.003, 0.5, 0.5});
    for (const Index i : pending.all)
      if (pending.position(i).x() < 0.015) pending.ledger.give(i, wall);
    std::erase_if(pending.all, [&](Index i) { return pending.ledger.window[i].surface != 0; });
    ASSERT_GT(pending.all.size(), 500U);
    const Extracted result = extracted(pending);
    EXPECT_EQ(result.surfaces.size(), near ? 0U : 1U);
    EXPECT_EQ(result.refusal(Reason::noise_sheet) != nullptr, near);
  }
}

TEST(PlaneExtraction, WhatIsSeenAlongItselfIsMixedAtAnEdge) {
  // The sensor stands so far before the plane that its views meet it, in the middle, at 1° and at 10°.
  for (const double degrees : {1.0, 10.0}) {
    const double before = 2.3 * std::tan(degrees * std::numbers::pi / 180);
    PendingPoints pending({rectangle_scan({-2, 0.2, before}, {0, 0, 0.003}, {0.6, 0, 0}, {0, 0.4, 0})});
    const Extracted result = extracted(pending);
    EXPECT_EQ(result.surfaces.size(), degrees < 4 ? 0U : 1U);
    const PlaneProposal* refused = result.refusal(Reason::seen_edge_on);
    ASSERT_EQ(refused != nullptr, degrees < 4);
    if (refused != nullptr) {
      EXPECT_LT(refused->refusal->measured, 0.5);
    }
  }
}

TEST(PlaneExtraction, EveryPointIsTakenOrRefused) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 6; ++round) {
    std::vector<Scan> scans;
    for (int i = 0; i < 4; ++i)
      scans.push_back(rectangle_scan(eye, {uniform(rng), uniform(rng), 0.4 * uniform(rng)},
                                     {0.05 + 0.4 * uniform(rng), 0, 0.2 * uniform(rng)},
                                     {0, 0.05 + 0.4 * uniform(rng), 0.2 * uniform(rng)}));
    PendingPoints pending(scans);
    const Extracted result = extracted(pending);
    std::set<Index> refused;
    for (const PlaneProposal& r : result.refused) refused.insert(r.points.begin(), r.points.end());
    for (const Index i : pending.all)
      EXPECT_NE(pending.ledger.window[i].surface != 0, refused.contains(i))
          << pending.position(i).transpose();
    for (const surfaces::SurfaceModel* s : result.surfaces) EXPECT_GE(s->size(), 50U);
  }
}

/// As the header says, in double precision; nothing where it is a matter of rounding.
struct SlowCount {
  std::size_t surely = 0, maybe = 0;
};
SlowCount counted_slowly(PendingPoints& pending, const Plane& plane, double cos_aligned) {
  constexpr double rounding = 1e-5;
  SlowCount count;
  for (const Index i : pending.all) {
    const occupancy::VoxelPoint& p = pending.ledger.window[i];
    const double off = std::fabs(plane.signed_distance(pending.position(i)));
    const double room = pending.state.noise.tolerance(p, plane) - off;
    const double turned = pending.ledger.normals.at(i).normal.cast<double>().dot(plane.normal) - cos_aligned;
    count.surely += room > rounding && turned > rounding;
    count.maybe += room > -rounding && turned > -rounding;
  }
  return count;
}

TEST(RegionPoints, CountsAsTheSlowTwinDoes) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  Parameters parameters;
  parameters.surfaces.range_noise = 0.004;  // tolerances that differ from point to point
  for (int round = 0; round < 5; ++round) {
    std::vector<Scan> scans;
    for (int i = 0; i < 3; ++i)
      scans.push_back(rectangle_scan({uniform(rng), uniform(rng), 1 + 3 * uniform(rng)},
                                     {uniform(rng), uniform(rng), 0.4 * uniform(rng)},
                                     {0.5, 0, 0.3 * uniform(rng)}, {0, 0.5, 0.3 * uniform(rng)}, 0.015));
    PendingPoints pending(scans, parameters);
    for (const double cos_aligned : {-1.0, 0.9}) {
      const RegionPoints points(pending.ledger, pending.all, 1, static_cast<float>(cos_aligned));
      ASSERT_EQ(points.size(), pending.all.size());
      for (int k = 0; k < 20; ++k) {
        Plane plane;
        plane.normal = Eigen::Vector3d(uniform(rng) - 0.5, uniform(rng) - 0.5, 1).normalized();
        plane.offset = plane.normal.dot(pending.position(pending.all[rng() % pending.all.size()]));
        const SlowCount slow = counted_slowly(pending, plane, cos_aligned);
        const std::size_t all = points.count(plane, 0);
        EXPECT_GE(all, slow.surely);
        EXPECT_LE(all, slow.maybe);
        std::size_t visited = 0, belong = 0;
        points.for_each(plane, [&](std::size_t i, bool belongs) {
          EXPECT_EQ(i, visited++);
          belong += belongs;
        });
        EXPECT_EQ(visited, points.size());
        EXPECT_EQ(belong, all);
        // It may give up, but only on what cannot win.
        const std::size_t to_beat = rng() % (points.size() + 1), found = points.count(plane, to_beat);
        EXPECT_TRUE(found == all || (all <= to_beat && found <= all))
            << found << " of " << geometry::all << ", " << to_beat;
      }
    }
  }
}

}  // namespace
}  // namespace octosurf::detection
