// Recordings: rays against planes computed by hand, noise against its model, determinism, change.
#include "simulation/recording.hpp"

#include "simulation/faces.hpp"
#include "simulation/fixture.hpp"
#include "simulation/random.hpp"
#include "simulation/ray_caster.hpp"
#include "simulation/scene.hpp"
#include "simulation/sensor.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

TEST(RayCaster, DepthOfAFloorSeenFromAbove) {
  Scene scene;
  add_box(scene, add_object(scene, "floor"), {-50, -50, -1}, {50, 50, 0});
  add_box(scene, add_object(scene, "box"), {1, -0.5, 0}, {2, 0.5, 0.4});
  const RayCaster caster(scene, {}, 0);
  const std::vector<Eigen::Vector3f> rays{{0, 0, -1}, {1, 0, -1}, {0, 3, -1}, {0, 0, 1}, {0, 9, -1}};
  const auto hits = caster.cast({0, 0, 1.5}, rays, 5);
  ASSERT_EQ(hits.size(), rays.size());
  EXPECT_NEAR(hits[0].t, 1.5, 1e-6);
  EXPECT_NEAR(hits[1].t, 1.1, 1e-6) << "the box's top, 0.4 m up";
  EXPECT_NEAR(hits[2].t, 1.5, 1e-6) << "t counts in units of the ray";
  EXPECT_EQ(hits[3].t, 0) << "nothing above";
  EXPECT_NEAR(hits[4].t, 1.5, 1e-6);
  EXPECT_EQ(caster.cast({0, 0, 6}, rays, 5)[0].t, 0) << "out of reach";
}

class EveryRecording : public testing::TestWithParam<std::tuple<std::string, std::string>> {};

// The faces' planes and the ray caster's triangles come from one scene by different ways.
TEST_P(EveryRecording, NoiseFreeReadingsAreRayPlaneIntersectionsOnTheFacesTheyName) {
  const auto& [scene, sensor] = GetParam();
  const Recording recording(options_of(scene, sensor, 5));
  std::size_t outside = 0, labelled = 0, all = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Readings readings = recording.ideal(i);
    const Eigen::Isometry3d T = recording.true_pose(i);
    ASSERT_EQ(readings.t.size(), recording.rays().size());
    for (std::size_t k = 0; k < readings.t.size(); k += 11) {
      if (readings.t[k] > 0) ++all;
      if (readings.labels[k] == 0) continue;
      ++labelled;
      const evaluation::TrueFace& face = recording.faces()[readings.labels[k] - 1];
      const Eigen::Vector3d direction = T.linear() * recording.rays()[k].cast<double>();
      const Eigen::Vector3d p = T.translation() + static_cast<double>(readings.t[k]) * direction;
      const double toward = face.plane.normal.dot(direction);
      ASSERT_LT(toward, 0) << "seen from behind: " << face.name;
      ASSERT_NEAR(face.plane.signed_distance(p), 0, 2e-5) << face.name;
      const double expected = -face.plane.signed_distance(T.translation()) / toward;
      if (toward < -0.05) {
        ASSERT_NEAR(readings.t[k], expected, 2e-4) << face.name;
      }
      outside += !contains(face.polygons[0], (face.T_map_face.inverse() * p).head<2>());
    }
  }
  EXPECT_GT(labelled, all / 2) << "most of a scene is planar";
  // What is covered at the end was open before in `change`; elsewhere only edges can fall outside.
  if (scene != "change") {
    EXPECT_LT(static_cast<double>(outside), 2e-4 * static_cast<double>(labelled) + 2);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryRecording,
                         testing::Combine(testing::Values("room", "office", "stairs", "stones", "corridor",
                                                          "change", "flight", "landing", "spiral", "open"),
                                          testing::Values("depth", "tilting", "spinning")),
                         [](const auto& test) {
                           return std::get<0>(test.param) + "_" + std::get<1>(test.param);
                         });

// A scene of a stair is as large as it says, an office is scaled.
TEST(Truth, StairsStandWhereTheirFacesAre) {
  for (const char* scene : {"office", "stairs", "flight"}) {
    SCOPED_TRACE(scene);
    const evaluation::Truth truth = Recording(options_of(scene, "spinning", 1)).visibility().truth();
    ASSERT_EQ(truth.stairs.size(), 1u);
    const evaluation::TrueStair& stair = truth.stairs[0];
    const auto floor =
        std::find_if(truth.faces.begin(), truth.faces.end(),
                     [](const evaluation::TrueFace& face) { return face.name == "floor/top"; });
    ASSERT_NE(floor, truth.faces.end());
    const Eigen::Vector3d up = floor->plane.normal;
    double height = 0;
    for (const auto& [left, right] : stair.edges) {
      height += stair.riser_m;
      EXPECT_NEAR(floor->plane.signed_distance(left), height, 1e-9);
      EXPECT_NEAR(floor->plane.signed_distance(right), height, 1e-9);
      const Eigen::Vector3d ahead = (left + right) / 2 + 0.05 * (left - right).cross(up).normalized();
      EXPECT_TRUE(std::any_of(truth.faces.begin(), truth.faces.end(),
                              [&](const evaluation::TrueFace& face) {
                                const Eigen::Vector3d at = face.T_map_face.inverse() * ahead;
                                return face.plane.normal.dot(up) > 0.99 && std::abs(at.z()) < 1e-6 &&
                                       contains(face.polygons[0], at.head<2>());
                              }))
          << "no tread at " << height;
    }
    EXPECT_NEAR((stair.edges[1][0] - stair.edges[0][0])
                    .dot((stair.edges[0][0] - stair.edges[0][1]).cross(up).normalized()),
                stair.tread_m, 1e-9);
  }
}

struct Moments {
  double n = 0, sum = 0, squares = 0;
  void add(double x) { n += 1, sum += x, squares += x * x; }
  double mean() const { return sum / n; }
  double deviation() const { return std::sqrt(squares / n - mean() * mean()); }
};

/// Errors of the readings with ideal t in [low, high].
Moments errors(const Recording& recording, double low, double high) {
  Moments moments;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Readings ideal = recording.ideal(i);
    const Readings noisy = recording.measured(i, ideal);
    for (std::size_t k = 0; k < ideal.t.size(); ++k)
      if (ideal.t[k] >= low && ideal.t[k] <= high && noisy.t[k] > 0)
        moments.add(static_cast<double>(noisy.t[k]) - ideal.t[k]);
  }
  return moments;
}

TEST(Noise, OfTheDepthCameraGrowsAsItsModelSays) {
  const Recording recording(options_of("room", "depth", 8));
  for (const double z : {1.2, 2.0, 3.0}) {
    const Moments moments = errors(recording, z - 0.02, z + 0.02);
    ASSERT_GT(moments.n, 2000);
    const double sigma = 0.0008 + 0.0016 * (z - 0.4) * (z - 0.4);
    const double expected = std::sqrt(sigma * sigma + 1e-6 / 12);  // rounding to millimetres
    EXPECT_NEAR(moments.deviation(), expected, expected * (0.03 + 4 / std::sqrt(2 * moments.n))) << z;
    EXPECT_NEAR(moments.mean(), 0, 5 * expected / std::sqrt(moments.n) + 1e-5) << z;
  }
}

// Recordings are quoted by seed: what a seed gave must not change. Restated: one normal value a reading, in
// order, out of the scan's own stream.
TEST(Noise, IsDrawnReadingByReadingFromTheScansStream) {
  for (const std::string sensor : {"depth", "tilting", "spinning"}) {
    const Recording recording(options_of("stones", sensor, 3, 11));
    const Readings ideal = recording.ideal(2), measured = recording.measured(2, ideal);
    Random random(11, 1002);
    for (std::size_t k = 0; k < ideal.t.size(); ++k) {
      const double t = ideal.t[k];
      if (t == 0) {
        ASSERT_EQ(measured.t[k], 0);
        continue;
      }
      const double sigma = sensor == "depth"     ? 0.0008 + 0.0016 * (t - 0.4) * (t - 0.4)
                           : sensor == "tilting" ? 0.006 + 0.001 * t
                                                 : 0.008;
      const double noisy = t + sigma * random.normal();
      const double low = sensor == "depth" ? 0.4 : sensor == "tilting" ? 0.1 : 0.3;
      const double high = sensor == "depth" ? 5 : sensor == "tilting" ? 30 : 50;
      const double kept = noisy < low || noisy > high ? 0 : noisy;
      const double written = sensor == "depth" ? std::round(kept * 1000) / 1000 : kept;
      ASSERT_EQ(measured.t[k], static_cast<float>(written)) << sensor << " " << k;
    }
  }
}

TEST(Noise, OfTheLidars) {
  const Moments tilting = errors(Recording(options_of("room", "tilting", 20)), 1.9, 2.1);
  ASSERT_GT(tilting.n, 1000);
  EXPECT_NEAR(tilting.deviation(), 0.008, 0.008 * 4 / std::sqrt(2 * tilting.n));
  const Moments spinning = errors(Recording(options_of("room", "spinning", 3)), 1, 3);
  ASSERT_GT(spinning.n, 1000);
  EXPECT_NEAR(spinning.deviation(), 0.008, 0.008 * 4 / std::sqrt(2 * spinning.n));
}

TEST(Noise, ScalesAndVanishes) {
  SimulationOptions options = options_of("room", "depth", 2);
  const double once = errors(Recording(options), 2.5, 3).deviation();
  options.noise_scale = 2;
  EXPECT_NEAR(errors(Recording(options), 2.5, 3).deviation(), 2 * once, 0.05 * once);
  options.noise_scale = 0;
  EXPECT_LE(errors(Recording(options), 0.5, 4.9).deviation(), 0.00031) << "rounding alone: 1 mm / √12";
}

TEST(Recording, ScansHoldWhatIsMeasuredAndTheirLabels) {
  const Recording recording(options_of("office", "depth", 3));
  const Readings readings = recording.measured(1, recording.ideal(1));
  const LabelledScan labelled = recording.labelled_scan(1);
  ASSERT_EQ(labelled.scan.points.size(), labelled.labels.size());
  std::size_t p = 0;
  for (std::size_t k = 0; k < readings.t.size(); ++k) {
    if (readings.t[k] == 0) {
      EXPECT_EQ(readings.labels[k], 0);
      continue;
    }
    ASSERT_LT(p, labelled.labels.size());
    EXPECT_EQ(labelled.labels[p], readings.labels[k]);
    EXPECT_FLOAT_EQ(labelled.scan.points[p].z(), readings.t[k]);
    EXPECT_GE(readings.t[k], 0.4f);
    EXPECT_LE(readings.t[k], 5.0f);
    ++p;
  }
  EXPECT_EQ(p, labelled.labels.size());
  EXPECT_EQ(labelled.scan.sensor, SensorKind::depth_camera);
  EXPECT_NO_THROW(require_rigid(labelled.scan.T_map_sensor, "pose"));
}

// The same scene by both cameras: what the real one does not drop it sees where it is, at an incidence that
// follows from the faces' planes.
TEST(Recording, TheRealCameraDropsOfWhatThePerfectOneSees) {
  const Recording perfect(options_of("office", "depth", 3)), real(options_of("office", "depth-real", 3));
  std::size_t facing = 0, facing_dropped = 0, grazing = 0, grazing_dropped = 0, behind = 0;
  for (std::size_t i = 0; i < perfect.size(); ++i) {
    const Readings all = perfect.ideal(i), kept = real.ideal(i);
    const Eigen::Matrix3d R = perfect.true_pose(i).linear();
    ASSERT_EQ(kept.incidence_rad.size(), kept.t.size());
    for (std::size_t k = 0; k < all.t.size(); ++k) {
      const bool dropped = kept.t[k] == 0;
      if (!dropped) {
        ASSERT_EQ(kept.t[k], all.t[k]);
        ASSERT_EQ(kept.labels[k], all.labels[k]);
      }
      if (all.labels[k] == 0) continue;
      const Eigen::Vector3d ray = R * perfect.rays()[k].cast<double>().normalized();
      const double angle = std::acos(-perfect.faces()[all.labels[k] - 1].plane.normal.dot(ray));
      if (angle > std::numbers::pi / 2) {
        ++behind;
        continue;
      }
      ASSERT_NEAR(kept.incidence_rad[k], angle, 1e-3);
      const double degrees = angle * 180 / std::numbers::pi;
      if (degrees > 86.1) {
        ASSERT_TRUE(dropped) << degrees;
      }
      if (degrees > 78 && degrees < 86) ++grazing, grazing_dropped += dropped;
      if (degrees < 60 && all.t[k] < 1.5) ++facing, facing_dropped += dropped;
    }
  }
  EXPECT_LT(behind, 10u) << "rays that slipped between two solids onto the back of a face";
  ASSERT_GT(grazing, 1000u);
  ASSERT_GT(facing, 10000u);
  EXPECT_GT(grazing_dropped, grazing / 2) << "half at 78°, all at 86°";
  EXPECT_LT(facing_dropped, facing / 10) << "dark patches and the darkest faces alone";
}

TEST(Recording, TheRealCamerasReadingsAreWholeMillimetresInReach) {
  const Recording recording(options_of("office", "depth-real", 3));
  const Readings ideal = recording.ideal(1), measured = recording.measured(1, ideal);
  std::size_t readings = 0, flying = 0;
  for (std::size_t k = 0; k < measured.t.size(); ++k) {
    if (ideal.t[k] == 0) {
      ASSERT_EQ(measured.t[k], 0);
    }
    if (measured.t[k] == 0) {
      ASSERT_EQ(measured.labels[k], 0);
      continue;
    }
    ++readings;
    flying += measured.labels[k] == 0 && ideal.labels[k] != 0;
    ASSERT_NEAR(measured.t[k] * 1000, std::round(measured.t[k] * 1000), 1e-3);
    ASSERT_GE(measured.t[k], 0.4f);
    ASSERT_LE(measured.t[k], 5.0f);
  }
  EXPECT_GT(readings, measured.t.size() / 2);
  EXPECT_GT(flying, 100u);
  EXPECT_LT(flying, readings / 20);
}

TEST(Recording, SameOptionsSameScansInAnyOrder) {
  for (const std::string sensor : {"depth", "depth-real", "tilting", "spinning"}) {
    const Recording a(options_of("stones", sensor, 4));
    const Recording b(options_of("stones", sensor, 4));
    const Scan last = b.scan(3);
    const Scan first = b.scan(0);
    EXPECT_EQ(a.scan(0).points, first.points);
    EXPECT_EQ(a.scan(3).points, last.points);
    EXPECT_EQ(a.T_map_sensor(3).matrix(), last.T_map_sensor.matrix());
  }
  const Recording one(options_of("stones", "spinning", 4, 3)), other(options_of("stones", "spinning", 4, 4));
  EXPECT_NE(one.scan(0).points, other.scan(0).points);
  EXPECT_FALSE(one.faces()[0].plane.normal.isApprox(other.faces()[0].plane.normal, 1e-4));
}

// Readers refuse empty clouds and images; no default recording may hold one.
TEST(Recording, NoScanIsEmpty) {
  for (const auto& scene : scene_names())
    for (const std::string sensor : {"tilting", "spinning"}) {
      SimulationOptions options = options_of(scene, sensor, 1);
      options.frames.reset();
      const Recording recording(options);
      // Of the laser that nods each fifth: from one to the next it turns by a degree or two.
      for (std::size_t i = 0; i < recording.size(); i += sensor == "tilting" ? 5 : 2) {
        const Readings readings = recording.ideal(i);
        ASSERT_GT(readings.t.size() - std::count(readings.t.begin(), readings.t.end(), 0.0f), 100u)
            << scene << " " << sensor << " scan " << i;
      }
    }
}

TEST(Recording, NoFaceIsAlignedWithTheOctree) {
  for (const std::uint64_t seed : test::seeds(5)) {
    const Recording recording(options_of("office", "depth", 1, seed));
    ASSERT_GT(recording.faces().size(), 100u);
    for (const auto& face : recording.faces())
      EXPECT_LT(face.plane.normal.cwiseAbs().maxCoeff(), std::cos(1e-4)) << face.name << " seed " << seed;
  }
}

TEST(Recording, TiltingLaserSeesThinStrips) {
  SimulationOptions options = options_of("room", "tilting", 120);
  options.noise_scale = 0;
  const Recording recording(options);
  const double widest = std::sin(0.26 * std::numbers::pi / 180);
  double lowest = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    for (const auto& p : recording.scan(i).points) ASSERT_LE(std::abs(p.z()), widest * p.norm() + 1e-6);
    // The fan nods: its forward axis dips over the scans.
    lowest = std::min(lowest, recording.true_pose(i).linear()(2, 0));
  }
  EXPECT_LT(lowest, -0.8);
}

TEST(Recording, ChangeHappensMidway) {
  const Recording recording(options_of("change", "depth", 20));
  std::size_t gone = 0, come = 0;
  std::vector<std::size_t> before(recording.faces().size()), after(recording.faces().size());
  for (std::size_t i = 0; i < recording.size(); ++i)
    for (const auto label : recording.ideal(i).labels)
      if (label > 0) ++(i < recording.size() / 2 ? before : after)[label - 1];
  for (std::size_t f = 0; f < recording.faces().size(); ++f) {
    const evaluation::TrueFace& face = recording.faces()[f];
    const bool leaves = face.name.starts_with("removed/") || face.name.starts_with("moved_from/");
    const bool comes = face.name.starts_with("added/") || face.name.starts_with("moved_to/");
    EXPECT_EQ(face.gone, leaves) << face.name;
    if (leaves) {
      EXPECT_EQ(after[f], 0u) << face.name;
      gone += before[f] > 1000;
    }
    if (comes) {
      EXPECT_EQ(before[f], 0u) << face.name;
      come += after[f] > 1000;
    }
  }
  EXPECT_GE(gone, 4u) << "both objects must have been seen before they went";
  EXPECT_GE(come, 4u);
}

TEST(Recording, DriftGrowsToWhatIsAskedPerLap) {
  SimulationOptions options = options_of("corridor", "spinning", 41);
  options.laps = 2;
  options.drift_m = 0.1;
  options.drift_rad = 0.02;
  const Recording recording(options);
  EXPECT_TRUE(recording.T_map_sensor(0).isApprox(recording.true_pose(0), 1e-12));
  const auto error = [&](std::size_t i) {
    return Eigen::Isometry3d(recording.T_map_sensor(i) * recording.true_pose(i).inverse());
  };
  EXPECT_NEAR(Eigen::AngleAxisd(error(20).linear()).angle(), 0.02, 1e-9) << "after one lap";
  EXPECT_NEAR(Eigen::AngleAxisd(error(40).linear()).angle(), 0.04, 1e-9) << "after two";
  const Eigen::Vector3d start = recording.true_pose(0).translation();
  EXPECT_NEAR((error(40) * start - start).norm(), 0.2, 1e-9);
  EXPECT_NO_THROW(require_rigid(recording.T_map_sensor(40), "pose"));
}

TEST(Recording, CorridorIsAsLongAsAskedAndWalkedThereAndBack) {
  SimulationOptions options = options_of("corridor", "spinning", 40);
  options.length = 30;
  const Recording recording(options);
  double farthest = 0;
  const Eigen::Vector3d start = recording.true_pose(0).translation();
  for (std::size_t i = 0; i < recording.size(); ++i)
    farthest = std::max(farthest, (recording.true_pose(i).translation() - start).norm());
  EXPECT_GT(farthest, 0.9 * 26);
  EXPECT_LT(farthest, 1.1 * 30);
  EXPECT_LT((recording.true_pose(39).translation() - start).norm(), 0.5);
}

TEST(SimulationOptions, NonsenseIsRefusedByName) {
  using Options = SimulationOptions;
  const std::vector<std::pair<std::string, std::function<void(Options&)>>> nonsense{
      {"scene", [](Options& o) { o.scene = "moon"; }},
      {"sensor", [](Options& o) { o.sensor = "sonar"; }},
      {"frames", [](Options& o) { o.frames = 0; }},
      {"frames", [](Options& o) { o.frames = 10'000'000; }},
      {"noise-scale", [](Options& o) { o.noise_scale = -1; }},
      {"noise-scale", [](Options& o) { o.noise_scale = std::nan(""); }},
      {"length", [](Options& o) { o.length = 1; }},
      {"length", [](Options& o) { o.length = INFINITY; }},
      {"laps", [](Options& o) { o.laps = 0; }},
      {"drift-m", [](Options& o) { o.drift_m = -0.1; }},
      {"drift-deg", [](Options& o) { o.drift_rad = 7; }}};
  for (const auto& [name, spoil] : nonsense) {
    Options options;
    spoil(options);
    try {
      const Recording recording(options);
      ADD_FAILURE() << name << " was taken";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), Error::Kind::usage);
      EXPECT_EQ(e.where(), name);
    }
  }
}

}  // namespace
}  // namespace octosurf::simulation
