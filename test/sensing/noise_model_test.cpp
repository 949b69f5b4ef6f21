#include "sensing/noise_model.hpp"

#include "sensing/reading_code.hpp"
#include "support/random_scans.hpp"
#include "support/scene.hpp"

namespace octosurf::sensing {
namespace {

/// A camera in front of a wall at `range`, readings scattered by sensor_noise + range_noise·z².
Scan wall(double range, double sensor_noise, double range_noise, std::mt19937_64& rng) {
  test::Scene scene;
  scene.rectangle({-20, -20, range}, {40, 0, 0}, {0, 40, 0});
  test::Camera camera;
  camera.noise = sensor_noise + range_noise * range * range;
  return test::camera_scan(scene, Eigen::Isometry3d::Identity(), rng, camera);
}

TEST(NoiseModel, FollowsTheFormulaItIsGiven) {
  Parameters parameters;
  parameters.surfaces.sensor_noise = 0.004;
  parameters.surfaces.range_noise = 0.0015;
  const NoiseModel noise(parameters);
  EXPECT_EQ(noise.range_noise(), 0.0015);
  for (unsigned c = 1; c < NoiseModel::classes; ++c) {
    const double z = range_of_class(c);
    EXPECT_NEAR(noise.sigma(c), 0.004 + 0.0015 * z * z, 1e-9);
    EXPECT_GE(noise.tolerance(c), parameters.surface_tolerance());
    if (c > 1) {
      EXPECT_GT(noise.tolerance(c), noise.tolerance(c - 1));
    }
  }
}

/// Readings of a sphere around the sensor: of one distance, scattered by `sigma` each for itself.
Scan sphere(double range, double sigma, std::size_t readings, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  Scan scan;
  for (std::size_t i = 0; i < readings; ++i) {
    const double a = 0.001 * static_cast<double>(i);
    scan.points.push_back(
        (Eigen::Vector3d(std::cos(a), std::sin(a), 0) * (range + sigma * gauss(rng))).cast<float>());
  }
  return scan;
}

// One in seven of them is looked at.
constexpr std::size_t looked_at_once = 7;

TEST(NoiseModel, MeasuresEachDistanceByItself) {
  // Of n = 40,000 differences the estimate of σ errs by 0.44 % (a trimmed rms: 1.24/√(2n)), bins of 1.5 mm
  // add 0.1 % to a σ of 5 mm: 2.5 % is more than five deviations.
  std::mt19937_64 rng = test::rng();
  const Parameters parameters;
  const double s = parameters.surfaces.sensor_noise;
  NoiseModel noise(parameters);
  const std::array<double, 4> truth{s, 1.4 * s, 2.5 * s, 1.8 * s};  // no formula of the distance
  const std::array<unsigned, 4> seen{3, 5, 8, 10};
  for (std::size_t k = 0; k < seen.size(); ++k)
    noise.observe(sphere(range_of_class(seen[k]), truth[k], 40000 * looked_at_once, rng));
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_NEAR(noise.measured_sigma(seen[k]), truth[k], 0.025 * truth[k]) << "class " << seen[k];
    EXPECT_NEAR(noise.sigma(seen[k]), truth[k], 0.025 * truth[k]) << "class " << seen[k];
    EXPECT_NEAR(noise.tolerance(seen[k]), parameters.surface_tolerance() + 4 * (noise.sigma(seen[k]) - s),
                1e-12);
  }
  // What was not seen takes over from the nearest below that was.
  for (const auto& [unseen, from] : {std::pair{4U, 3U}, {6U, 5U}, {7U, 5U}, {9U, 8U}, {15U, 10U}})
    EXPECT_EQ(noise.sigma(unseen), noise.sigma(from)) << "class " << unseen;
  EXPECT_EQ(noise.sigma(1), s);
  EXPECT_EQ(noise.sigma(2), s);
}

TEST(NoiseModel, AClassHasNoSayBeforeAThousandReadings) {
  std::mt19937_64 rng = test::rng();
  const Parameters parameters;
  const double s = parameters.surfaces.sensor_noise;
  const unsigned c = range_class_of(2);
  NoiseModel few(parameters), enough(parameters);
  few.observe(sphere(2, 2 * s, 999 * looked_at_once, rng));
  enough.observe(sphere(2, 2 * s, 1002 * looked_at_once, rng));
  EXPECT_EQ(few.sigma(c), s);
  EXPECT_EQ(few.measured_sigma(c), s);
  EXPECT_GT(enough.sigma(c), 1.5 * s);
}

TEST(NoiseModel, EdgesDoNotCount) {
  // One triple in thirty across an edge of up to 0.1 m. The trim leaves out the largest 5 %: these, and of
  // the noise what is beyond 2.386 σ instead of 1.96 σ, so that an rms of 0.942 σ is taken for one of 0.871
  // σ.
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<float> edge(0.05F, 0.1F);
  const Parameters parameters;
  const double truth = 2 * parameters.surfaces.sensor_noise;
  NoiseModel noise(parameters);
  Scan scan = sphere(4, truth, 40000 * looked_at_once, rng);
  for (std::size_t i = 1; i + 1 < scan.points.size(); i += 30 * looked_at_once)
    scan.points[i] *= 1 + edge(rng) / scan.points[i].norm();
  noise.observe(scan);
  EXPECT_NEAR(noise.measured_sigma(range_class_of(4)), 1.081 * truth, 0.025 * truth);
}

TEST(NoiseModel, NearReadingsDoNotSpoilTheFarOnes) {
  // Near the sensor its noise is a tenth more than is said: half a millimetre, which over z² would be up to
  // eight times the truth. From 2 m on the largest of three estimates decides, each of 40,000 differences:
  // 0.44 % of σ are 1 % of truth·z² at 2 m, 0.6 % at 4 m. Six of these.
  std::mt19937_64 rng = test::rng();
  const Parameters parameters;
  for (const double truth : {0.001, 0.0025}) {
    NoiseModel noise(parameters);
    for (unsigned c = 1; c <= 9; ++c) {
      const double z = range_of_class(c);
      const double near_sensor = (z < 1.9 ? 1.1 : 1) * parameters.surfaces.sensor_noise;
      noise.observe(sphere(z, near_sensor + truth * z * z, 40000 * looked_at_once, rng));
    }
    EXPECT_GT(noise.range_noise(), 0.96 * truth);
    EXPECT_LT(noise.range_noise(), 1.06 * truth);
  }
}

TEST(NoiseModel, CornersOfTrianglesTellNothing) {
  // An exact ramp of 45°, as the corners of one triangle after another: three in a row turn a corner, so that
  // their second difference is the ramp's slope.
  NoiseModel noise{Parameters{}};
  constexpr float edge = 0.02F;
  const auto on_ramp = [](int u, int v) {
    return Eigen::Vector3f(edge * static_cast<float>(u), edge * static_cast<float>(v),
                           3 + edge * static_cast<float>(u));
  };
  Scan scan;
  for (int u = -50; u < 50; ++u)
    for (int v = -50; v < 50; ++v)
      for (const auto& [du, dv] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 0}, {1, 1}, {0, 1}})
        scan.points.push_back(on_ramp(u + du, v + dv));
  noise.observe(scan);
  for (unsigned c = 1; c < NoiseModel::classes; ++c)
    EXPECT_EQ(noise.measured_sigma(c), Parameters{}.surfaces.sensor_noise) << "class " << c;
}

TEST(NoiseModel, SpreadIsWhatWasMeasured) {
  // Half of what the parameter expects: sigma stays, for tolerances; weights know better.
  std::mt19937_64 rng = test::rng();
  const Parameters parameters;
  const double truth = parameters.surfaces.sensor_noise / 2;
  NoiseModel noise(parameters);
  const unsigned c = range_class_of(2);
  EXPECT_EQ(noise.measured_sigma(c), noise.sigma(c)) << "nothing is known yet";
  for (int i = 0; i < 4; ++i) noise.observe(wall(2, truth, 0, rng));
  EXPECT_NEAR(noise.measured_sigma(c), truth, 0.25 * truth);
  EXPECT_EQ(noise.sigma(c), parameters.surfaces.sensor_noise);
  EXPECT_EQ(noise.measured_sigma(15), noise.sigma(15)) << "never seen";
  EXPECT_EQ(noise.range_noise(), 0);

  Parameters given = parameters;
  given.surfaces.range_noise = 0.001;
  NoiseModel fixed(given);
  for (int i = 0; i < 4; ++i) fixed.observe(wall(2, truth, 0, rng));
  EXPECT_EQ(fixed.measured_sigma(c), fixed.sigma(c));
  EXPECT_EQ(fixed.range_noise(), 0.001);
}

TEST(NoiseModel, ShuffledScansDoNotRaiseIt) {
  // A camera in a room, and a narrow one before a wall, with 1 mm of noise, each scan's points in any order;
  // exact ones of a box room all around.
  std::mt19937_64 rng = test::rng();
  test::Scene room, flat;
  room.rectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}).rectangle({2, -2, 0}, {0, 4, 0}, {0, 0, 2.5});
  room.rectangle({-2, 2, 0}, {4, 0, 0}, {0, 0, 2.5}).box({0.5, 0.5, 0}, {1.2, 1, 0.8});
  flat.rectangle({-20, -20, 3}, {40, 0, 0}, {0, 40, 0});
  const Parameters parameters;
  NoiseModel in_room(parameters), before_wall(parameters), all_around(parameters);
  test::Camera wide, narrow;
  wide.noise = narrow.noise = 0.001;
  narrow.focal = 400;
  const auto shuffled = [&](Scan scan) {
    std::shuffle(scan.points.begin(), scan.points.end(), rng);
    return scan;
  };
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d eye(-1.5 + 0.1 * i, -1.5, 1.2);
    in_room.observe(shuffled(test::camera_scan(room, test::look_at(eye, {1, 1, 0.6}), rng, wide)));
    before_wall.observe(shuffled(test::camera_scan(flat, Eigen::Isometry3d::Identity(), rng, narrow)));
    all_around.observe(shuffled(test::room_scan(rng, 30000, {3, 3, 3}, {0, 0, 0}, 1e-6)));
  }
  for (unsigned c = 1; c < NoiseModel::classes; ++c)
    for (const NoiseModel* noise : {&in_room, &before_wall, &all_around}) {
      EXPECT_NEAR(noise->sigma(c), parameters.surfaces.sensor_noise, 0.001) << "class " << c;
      EXPECT_NEAR(noise->tolerance(c), parameters.surface_tolerance(), 0.004) << "class " << c;
    }
}

TEST(NoiseModel, StandsWhatIsNotFinite) {
  NoiseModel noise{Parameters{}};
  Scan scan;
  noise.observe(scan);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 0.0F}) {
    scan.points.assign(1000, Eigen::Vector3f::Constant(bad));
    noise.observe(scan);
  }
  EXPECT_EQ(noise.range_noise(), 0);
  const float far = 1e19F;  // whose second difference is no number of bins that fits an integer
  for (int i = 0; i < 999; ++i)
    scan.points[i] =
        Eigen::Vector3f(1, 0.02F * static_cast<float>(i % 3), 0) * (i % 3 == 1 ? far : 0.97F * far);
  noise.observe(scan);
  EXPECT_EQ(noise.histogram(), NoiseModel::Histogram{});
}

/// Means of readings whose own noise is `noise`, with an error of `shared` in common; a fifth is clutter, or
/// none.
std::vector<NoiseModel::Residual> residuals_of(std::uint8_t range_class, double shared, double noise,
                                               std::mt19937_64& rng, int count = 2000, bool clutter = true) {
  std::normal_distribution<double> off(0, std::hypot(shared, noise));
  std::uniform_real_distribution<double> anywhere(-0.03, 0.03);
  std::vector<NoiseModel::Residual> residuals;
  for (int i = 0; i < count; ++i)
    residuals.push_back({range_class, 0, clutter && i % 5 == 0 ? anywhere(rng) : off(rng), noise * noise, 1});
  return residuals;
}

TEST(NoiseModel, ResidualsTellWhatReadingsErrBeyondTheirNoiseAndNothingElse) {
  std::mt19937_64 rng = test::rng();
  NoiseModel noise{Parameters{}};
  const double before = noise.reading_variance(8);
  EXPECT_EQ(before, noise.measured_sigma(8) * noise.measured_sigma(8));
  for (int scan = 0; scan < 40; ++scan)
    noise.observe(NoiseModel::shared_variances(residuals_of(8, 0.006, 0.002, rng)));
  // The clutter moves the median by a fifth.
  EXPECT_NEAR(std::sqrt(noise.reading_variance(8) - before), 0.006, 0.25 * 0.006);
  // Gates of the stages are by the noise alone.
  EXPECT_EQ(noise.tolerance(8), NoiseModel{Parameters{}}.tolerance(8));
  // A median of 1,600 that are noise is sure to 3 %, its square to 6: what is above, 2 % in the mean, is 1e-7
  // m². A mean of 30 scans' leaves that by more than 1.5e-7 in one world of a thousand millions.
  NoiseModel alone{Parameters{}};
  for (int scan = 0; scan < 40; ++scan)
    alone.observe(NoiseModel::shared_variances(residuals_of(8, 0, 0.002, rng, 1600, false)));
  EXPECT_LT(alone.reading_variance(8) - alone.measured_sigma(8) * alone.measured_sigma(8), 2.5e-7);
}

/// m, that a scan's readings of a surface are known to have in common, if they lie off by that much.
double shared_by_surfaces(double offset, int surfaces, std::mt19937_64& rng) {
  std::normal_distribution<double> off(0, offset), noise(0, 0.003);
  NoiseModel model{Parameters{}};
  for (int scan = 0; scan < 100; ++scan) {
    std::vector<NoiseModel::Residual> residuals;
    for (int surface = 0; surface < surfaces; ++surface) {
      const double of_surface = off(rng), cos_incidence = 0.6;
      for (int i = 0; i < 100; ++i)
        residuals.push_back({8, static_cast<std::uint32_t>(surface),
                             (of_surface + noise(rng)) / cos_incidence, 0, cos_incidence});
    }
    model.observe(NoiseModel::shared_variances(residuals));
  }
  return std::sqrt(model.surface_variance());
}

TEST(NoiseModel, WhatAScansReadingsOfASurfaceShareIsTold) {
  std::mt19937_64 rng = test::rng();
  // The square of 15 surfaces' median is sure to six tenths, 30 scans' mean to a ninth, its root to 6 %.
  EXPECT_NEAR(shared_by_surfaces(0.005, 15, rng), 0.005, 0.0015);
  EXPECT_LT(shared_by_surfaces(0, 15, rng), 0.0004);
  EXPECT_EQ(shared_by_surfaces(0.005, 2, rng), 0) << "two surfaces";
}

TEST(NoiseModel, AnotherMapsSharedErrorsCountByTheirScans) {
  std::mt19937_64 rng = test::rng();
  NoiseModel one{Parameters{}}, other{Parameters{}}, nothing{Parameters{}};
  one.observe(NoiseModel::shared_variances(residuals_of(6, 0.004, 0, rng)));
  for (int scan = 0; scan < 3; ++scan)
    other.observe(NoiseModel::shared_variances(residuals_of(6, 0.008, 0, rng)));
  NoiseModel both = one, taken = nothing;
  both.add(other);
  taken.add(other);
  const auto error = [](const NoiseModel& noise) { return noise.shared_errors().of_class[6]; };
  EXPECT_NEAR(error(both).variance, (error(one).variance + 3 * error(other).variance) / 4, 1e-15);
  EXPECT_EQ(error(both).scans, 4U);
  EXPECT_DOUBLE_EQ(taken.reading_variance(6), other.reading_variance(6));
  const double before = both.reading_variance(6);
  both.add(nothing);
  EXPECT_EQ(both.reading_variance(6), before);
}

TEST(NoiseModel, WhatNoScanHasToldOfErrsAsTheClassBelow) {
  std::mt19937_64 rng = test::rng();
  NoiseModel noise{Parameters{}};
  noise.observe(NoiseModel::shared_variances(residuals_of(6, 0.004, 0, rng)));
  noise.observe(NoiseModel::shared_variances(residuals_of(9, 0.01, 0, rng)));
  noise.observe(NoiseModel::shared_variances(residuals_of(12, 0.1, 0, rng, 20)));  // too few
  const auto shared = [&](unsigned c) {
    return noise.reading_variance(c) - noise.measured_sigma(c) * noise.measured_sigma(c);
  };
  EXPECT_NEAR(shared(1), shared(6), 1e-15);
  EXPECT_NEAR(shared(8), shared(6), 1e-15);
  EXPECT_NEAR(shared(15), shared(9), 1e-15);
  EXPECT_GT(shared(9), 3 * shared(6));
}

}  // namespace
}  // namespace octosurf::sensing
