// Recordings: rays against planes computed by hand, noise against its model, determinism, change.
#include "simulation/recording.hpp"

#include "simulation/faces.hpp"
#include "simulation/fixture.hpp"
#include "simulation/random.hpp"
#include "simulation/ray_caster.hpp"
#include "simulation/scene.hpp"
#include "simulation/sensor.hpp"

namespace octosurf::simulation {
namespace {

TEST(RayCaster, DepthOfAFloorSeenFromAbove) {
  Scene scene;
  add_box(scene, add_object(scene, "floor"), {-50, -50, -1}, {50, 50, 0});
  add_box(scene, add_object(scene, "box"), {1, -0.5, 0}, {2, 0.5, 0.4});
  const RayCaster caster(scene, {}, 0);
  const std::vector<Eigen::Vector3f> rays{{0, 0, -1}, {1, 0, -1}, {0, 3, -1}, {0, 0, 1}};
  // The second ray ends on the box's top; t counts in units of the ray; there is nothing above.
  const std::vector<double> expected{1.5, 1.1, 1.5, 0};
  const auto hits = caster.cast({0, 0, 1.5}, rays, 5);
  ASSERT_EQ(hits.size(), rays.size());
  for (std::size_t i = 0; i < hits.size(); ++i) EXPECT_NEAR(hits[i].t, expected[i], 1e-6);
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
      ASSERT_TRUE(toward >= -0.05 || std::abs(readings.t[k] - expected) <= 2e-4) << face.name;
      outside += !contains(face.polygons[0], (face.T_map_face.inverse() * p).head<2>());
    }
  }
  EXPECT_GT(labelled, all / 2) << "most of a scene is planar";
  // What is covered at the end was open before in `change`; elsewhere only edges can fall outside.
  EXPECT_TRUE(scene == "change" || static_cast<double>(outside) < 2e-4 * static_cast<double>(labelled) + 2);
}

INSTANTIATE_TEST_SUITE_P(
    All, EveryRecording,
    testing::Combine(testing::Values("room", "office", "stairs", "stones", "corridor", "change", "flight",
                                     "landing", "spiral", "open", "storeys"),
                     testing::Values("depth", "tilting", "spinning")),
    [](const auto& test) { return std::get<0>(test.param) + "_" + std::get<1>(test.param); });

// A scene of a stair is as large as it says, an office is scaled.
TEST(Truth, StairsStandWhereTheirFacesAre) {
  for (const char* scene : {"office", "stairs", "flight"}) {
    SCOPED_TRACE(scene);
    const evaluation::Truth truth = Recording(options_of(scene, "spinning", 1)).visibility().truth();
    ASSERT_EQ(truth.stairs.size(), 1u);
    const evaluation::TrueStair& stair = truth.stairs[0];
    const auto floor = std::ranges::find(truth.faces, "floor/top", &evaluation::TrueFace::name);
    ASSERT_NE(floor, truth.faces.end());
    const Eigen::Vector3d up = floor->plane.normal;
    double height = 0;
    for (const auto& [left, right] : stair.edges) {
      height += stair.riser_m;
      EXPECT_NEAR(floor->plane.signed_distance(left), height, 1e-9);
      EXPECT_NEAR(floor->plane.signed_distance(right), height, 1e-9);
      const Eigen::Vector3d ahead = (left + right) / 2 + 0.05 * (left - right).cross(up).normalized();
      const auto holds_ahead = [&](const evaluation::TrueFace& face) {
        const Eigen::Vector3d at = face.T_map_face.inverse() * ahead;
        return face.plane.normal.dot(up) > 0.99 && std::abs(at.z()) < 1e-6 &&
               contains(face.polygons[0], at.head<2>());
      };
      EXPECT_TRUE(std::ranges::any_of(truth.faces, holds_ahead)) << "no tread at " << height;
    }
    EXPECT_NEAR((stair.edges[1][0] - stair.edges[0][0])
                    .dot((stair.edges[0][0] - stair.edges[0][1]).cross(up).normalized()),
                stair.tread_m, 1e-9);
  }
}

// Recordings are quoted by seed: what a seed gave must not change. Restated: one normal value a reading, in
// order, out of the scan's own stream.
TEST(Noise, IsDrawnReadingByReadingFromTheScansStream) {
  for (const std::string sensor : {"depth", "tilting", "spinning"})
    for (const double scale : {1.0, 2.0, 0.0}) {
      SimulationOptions options = options_of("stones", sensor, 3, 11);
      options.noise_scale = scale;
      const Recording recording(options);
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
        const double noisy = t + scale * sigma * random.normal();
        const double low = sensor == "depth" ? 0.4 : sensor == "tilting" ? 0.1 : 0.3;
        const double high = sensor == "depth" ? 5 : sensor == "tilting" ? 30 : 50;
        const double kept = noisy < low || noisy > high ? 0 : noisy;
        const double written = sensor == "depth" ? std::round(kept * 1000) / 1000 : kept;
        ASSERT_EQ(measured.t[k], static_cast<float>(written)) << sensor << " × " << scale << ", " << k;
      }
    }
}

TEST(Recording, ScansHoldWhatIsMeasuredAndTheirLabels) {
  for (const std::string sensor : {"depth", "depth-real"}) {
    SCOPED_TRACE(sensor);
    const Recording recording(options_of("office", sensor, 3));
    const Readings ideal = recording.ideal(1), measured = recording.measured(1, ideal);
    const LabelledScan labelled = recording.labelled_scan(1);
    ASSERT_EQ(labelled.scan.points.size(), labelled.labels.size());
    std::size_t p = 0, flying = 0;
    for (std::size_t k = 0; k < measured.t.size(); ++k) {
      ASSERT_TRUE(ideal.t[k] > 0 || measured.t[k] == 0);
      ASSERT_TRUE(measured.t[k] > 0 || measured.labels[k] == 0);
      if (measured.t[k] == 0) continue;
      ASSERT_LT(p, labelled.labels.size());
      ASSERT_EQ(labelled.labels[p], measured.labels[k]);
      ASSERT_FLOAT_EQ(labelled.scan.points[p++].z(), measured.t[k]);
      ASSERT_NEAR(measured.t[k] * 1000, std::round(measured.t[k] * 1000), 1e-3);
      ASSERT_GE(measured.t[k], 0.4f);
      ASSERT_LE(measured.t[k], 5.0f);
      flying += measured.labels[k] == 0 && ideal.labels[k] != 0;
    }
    EXPECT_EQ(p, labelled.labels.size());
    EXPECT_GT(p, measured.t.size() / 2);
    EXPECT_EQ(flying > 100, sensor == "depth-real");
    EXPECT_LT(flying, p / 20);
    EXPECT_EQ(labelled.scan.sensor, SensorKind::depth_camera);
    EXPECT_NO_THROW(require_rigid(labelled.scan.T_map_sensor, "pose"));
  }
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
      ASSERT_TRUE(dropped || (kept.t[k] == all.t[k] && kept.labels[k] == all.labels[k]));
      if (all.labels[k] == 0) continue;
      const Eigen::Vector3d ray = R * perfect.rays()[k].cast<double>().normalized();
      const double angle = std::acos(-perfect.faces()[all.labels[k] - 1].plane.normal.dot(ray));
      behind += angle > std::numbers::pi / 2;
      if (angle > std::numbers::pi / 2) continue;
      ASSERT_NEAR(kept.incidence_rad[k], angle, 1e-3);
      const double degrees = angle * 180 / std::numbers::pi;
      ASSERT_TRUE(dropped || degrees <= 86.1) << degrees;
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

TEST(Recording, SameOptionsSameScansInAnyOrder) {
  for (const std::string sensor : {"depth", "depth-real", "tilting", "spinning"}) {
    const Recording a(options_of("stones", sensor, 4)), b(options_of("stones", sensor, 4));
    const Scan last = b.scan(3), first = b.scan(0);
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
    EXPECT_TRUE(!leaves || after[f] == 0) << face.name;
    EXPECT_TRUE(!comes || before[f] == 0) << face.name;
    gone += leaves && before[f] > 1000;
    come += comes && after[f] > 1000;
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
    const Error error = refusal(Error::Kind::usage, [&] { const Recording recording(options); });
    EXPECT_EQ(error.where(), name);
    EXPECT_TRUE(name != "scene" || error.hint().find("office") != std::string::npos) << "names those known";
  }
}

// Visible cells: inside their polygons, and each really in sight of some scan.

TEST(VisibleCells, LieInPolygonsInOrderAndSumUp) {
  for (const auto& [sensor, scene, scans] :
       {std::tuple("depth", "office", 6u), std::tuple("tilting", "stones", 60u),
        std::tuple("spinning", "change", 6u)}) {
    const evaluation::Truth truth = Recording(options_of(scene, sensor, scans)).truth();
    EXPECT_EQ(truth.scene, scene);
    EXPECT_EQ(truth.sensor, sensor);
    EXPECT_EQ(truth.cell, truth.sensor == "depth" ? 0.01 : 0.05);
    std::size_t seen = 0;
    for (const auto& face : truth.faces) {
      std::size_t cells = 0;
      auto last = std::pair(std::numeric_limits<int>::min(), 0);  // row, and the column behind it
      for (const auto& run : face.visible) {
        ASSERT_GT(run.count, 0);
        ASSERT_GT(std::pair(run.row, run.column), last);
        last = {run.row, run.column + run.count};
        cells += run.count;
        for (int c = run.column; c < run.column + run.count; ++c)
          ASSERT_TRUE(contains(face.polygons[0], truth.cell * Eigen::Vector2d(c + 0.5, run.row + 0.5)))
              << face.name;
      }
      EXPECT_NEAR(face.visible_area_m2, static_cast<double>(cells) * truth.cell * truth.cell, 1e-9);
      if (face.visible_area_m2 >= 0.05) ++seen;
    }
    EXPECT_GE(seen, 8u) << scene << " " << sensor;
  }
}

/// True if some scan of the camera has a reading of this face right at `point`'s pixel or beside it.
bool in_sight(const Recording& recording, const std::vector<Readings>& readings,
              const evaluation::TrueFace& face, const Eigen::Vector3d& point) {
  using namespace simulation;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Eigen::Vector3d p = recording.true_pose(i).inverse() * point;
    if (p.z() < 0.4 || p.norm() > 4.05) continue;
    const int u = static_cast<int>(std::lround(depth_focal * p.x() / p.z() + depth_center_x));
    const int v = static_cast<int>(std::lround(depth_focal * p.y() / p.z() + depth_center_y));
    // A cell 0.4 m away spans 13 pixels, its centre may be off the ray by half of them.
    const int reach = 1 + static_cast<int>(std::ceil(depth_focal * 0.0071 / p.z()));
    for (int y = std::max(0, v - reach); y <= std::min<int>(depth_height - 1, v + reach); ++y)
      for (int x = std::max(0, u - reach); x <= std::min<int>(depth_width - 1, u + reach); ++x)
        if (readings[i].labels[y * depth_width + x] == face.id) return true;
  }
  return false;
}

TEST(VisibleCells, EachIsInSightOfSomeScan) {
  const Recording recording(options_of("office", "depth", 5));
  std::vector<Readings> readings;
  for (std::size_t i = 0; i < recording.size(); ++i) readings.push_back(recording.ideal(i));
  const evaluation::Truth truth = recording.truth();
  std::size_t cells = 0, checked = 0;
  for (const auto& face : truth.faces)
    for (const auto& run : face.visible)
      for (int c = run.column; c < run.column + run.count; ++c) {
        if (++cells % 97 != 0) continue;
        ++checked;
        const Eigen::Vector3d point =
            face.T_map_face * Eigen::Vector3d((c + 0.5) * truth.cell, (run.row + 0.5) * truth.cell, 0);
        ASSERT_TRUE(in_sight(recording, readings, face, point))
            << face.name << " cell " << c << ", " << run.row;
      }
  EXPECT_GT(checked, 500u);
}

}  // namespace
}  // namespace octosurf::simulation
