// What scans saw again in a surface's voxels, against sums over each reading.
#include "support/map_state.hpp"
#include "surfaces/blobs.hpp"
#include "update/retract.hpp"

namespace octosurf::update {
namespace {

constexpr double d = 0.02;
const Eigen::Vector3d z(0, 0, 1);

void expect_same(const geometry::Moments& a, const geometry::Moments& b, double slack = 1e-9) {
  EXPECT_NEAR(a.count, b.count, slack * (1 + std::fabs(b.count)));
  EXPECT_LE((a.sum - b.sum).norm(), slack * (1 + b.sum.norm()));
  EXPECT_LE((a.outer - b.outer).norm(), slack * (1 + b.outer.norm()));
}

/// A square of 20 × 20 voxels about `centre`, its points at height `height` over it.
surfaces::SurfaceModel square(const Eigen::Vector3d& centre, double height, SurfaceId id = 1) {
  surfaces::SurfaceModel model(id, {z, centre.z()}, centre, d);
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 20; ++u) {
      const Eigen::Vector3d at = centre + Eigen::Vector3d((u - 9.5) * d, (v - 9.5) * d, height);
      model.add({{static_cast<std::uint16_t>(100 + u), static_cast<std::uint16_t>(100 + v), 7},
                 8,
                 at.cast<float>()});
    }
  return model;
}

/// `n` readings spread over the square, at a height, with random weights.
void see(surfaces::SurfaceModel& model, const Eigen::Vector3d& centre, double height, int n,
         std::mt19937_64& rng, geometry::Moments* sum = nullptr) {
  std::uniform_real_distribution<double> side(-0.19, 0.19), weights(0.2, 3);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3f p = (centre + Eigen::Vector3d(side(rng), side(rng), height)).cast<float>();
    const double weight = weights(rng);
    model.observe(p, weight);
    if (sum != nullptr) sum->add(p.cast<double>() - model.reference(), weight);
  }
}

double height_of(const surfaces::SurfaceModel& model, const sensing::NoiseModel& noise,
                 const Eigen::Vector3d& centre) {
  const geometry::PlaneFit fit = geometry::fit_plane(model.moments(&noise));
  return fit.normal.dot(model.reference() + fit.centroid - centre) / fit.normal.z();
}

TEST(Evidence, IsTheSumOfItsReadings) {
  std::mt19937_64 rng = test::rng();
  const sensing::NoiseModel noise{Parameters{}};
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(80, -60, 3)}) {
    surfaces::SurfaceModel model = square(centre, 0);
    const geometry::Moments inliers = model.moments(&noise), unweighted = model.moments(nullptr);
    geometry::Moments sum;
    see(model, centre, 0.004, 500, rng, &sum);
    EXPECT_EQ(model.evidence().readings, 500);
    EXPECT_EQ(model.readings(), 900);
    expect_same(model.evidence().moments, sum);
    geometry::Moments both = inliers;
    both.add(sum);
    expect_same(model.moments(&noise), both);
    expect_same(model.moments(nullptr), unweighted);
    EXPECT_EQ(model.size(), 400U);
    model.add({{300, 300, 7}, 8, {0.25F, 0, 0}});
    EXPECT_EQ(model.evidence().readings, 500) << "new inliers take nothing";
    expect_same(model.evidence().moments, sum);
    ASSERT_TRUE(model.remove({300, 300, 7}, {0.25F, 0, 0}));
    model.forget_evidence();
    EXPECT_EQ(model.evidence().readings, 0);
    expect_same(model.moments(&noise), inliers);
  }
}

TEST(Evidence, InliersThatGoTakeTheirShare) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Vector3d centre(0, 0, 0);
  surfaces::SurfaceModel model = square(centre, 0);
  geometry::Moments sum;
  see(model, centre, 0.004, 800, rng, &sum);
  const std::vector<surfaces::Inlier> all = model.sorted_inliers();
  for (std::size_t i = 0; i < 100; ++i) ASSERT_TRUE(model.remove(all[i].key, all[i].position));
  // 300 of 400 are left, and so are three quarters of what was seen again.
  EXPECT_NEAR(model.evidence().readings, 600, 1e-6);
  geometry::Moments left;
  left.add(sum, 0.75);
  expect_same(model.evidence().moments, left);
  EXPECT_FALSE(model.remove(all[0].key, all[0].position)) << "no longer one";
  EXPECT_NEAR(model.evidence().readings, 600, 1e-6);
  for (std::size_t i = 100; i < 400; ++i) ASSERT_TRUE(model.remove(all[i].key, all[i].position));
  EXPECT_EQ(model.size(), 0U);
  EXPECT_NEAR(model.evidence().readings, 0, 1e-9);
  EXPECT_NEAR(model.evidence().moments.count, 0, 1e-9);
}

TEST(Evidence, OldReadingsFade) {
  // More than a hundred for each inlier: the older ones lose weight, so a plane that moves is followed.
  std::mt19937_64 rng = test::rng();
  const sensing::NoiseModel noise{Parameters{}};
  surfaces::SurfaceModel model = square({0, 0, 0}, 0);
  for (int round = 0; round < 100; ++round) {
    see(model, {0, 0, 0}, 0, 400, rng);
    EXPECT_LE(model.evidence().readings, 40000);
  }
  see(model, {0, 0, 0}, 0.004, 40000, rng);
  EXPECT_LE(model.evidence().readings, 40000);
  EXPECT_GE(model.evidence().readings, 20000);
  EXPECT_GT(height_of(model, noise, {0, 0, 0}), 0.0022) << "the newer half weighs more";
}

TEST(Evidence, TakenOverIsAsIfEachReadingWereAdded) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Vector3d here(80, -60, 3), there(80.4, -60.1, 3.002);
  surfaces::SurfaceModel into = square(here, 0, 1), from = square(there, 0, 2), slow = square(here, 0, 3);
  ASSERT_NE(into.reference(), from.reference());
  std::uniform_real_distribution<double> side(-0.19, 0.19), weights(0.2, 3);
  for (int i = 0; i < 600; ++i) {
    const bool second = i % 3 == 0;
    const Eigen::Vector3f p =
        ((second ? there : here) + Eigen::Vector3d(side(rng), side(rng), 0.003 * side(rng))).cast<float>();
    const double weight = weights(rng);
    (second ? from : into).observe(p, weight);
    slow.observe(p, weight);
  }
  into.take_evidence(from);
  EXPECT_EQ(into.evidence().readings, slow.evidence().readings);
  expect_same(into.evidence().moments, slow.evidence().moments);
}

TEST(Evidence, ScansThatSeeAFloorAgainMoveItsPlane) {
  // First 3 mm too low, then right, often: the voxels keep their first points, the plane comes right.
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> gauss(0, 0.001);
  surfaces::MapState state{Parameters{}};
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  const auto floor = [&](double height) {
    Scan scan = test::rectangle_scan(eye, {0.1, 0.1, height}, {0.8, 0, 0}, {0, 0.8, 0});
    for (Eigen::Vector3f& p : scan.points) p.z() += static_cast<float>(gauss(rng));
    return scan;
  };
  {
    const auto points = test::occupy(state, floor(0.009)).appeared;
    surfaces::Ledger ledger(state);
    test::make_surface(ledger, points, {z, 0.009}, [](const Eigen::Vector3d&) { return true; });
  }
  std::size_t readings = 0;
  for (int i = 0; i < 20; ++i) {
    sensing::Downsampler downsample(state.occupancy.grid());
    const sensing::VoxelScan voxels = downsample(floor(0.012), 0, 100);
    const occupancy::OccupancyDelta delta = state.occupancy.insert(voxels, downsample, &state.surfaces);
    readings += delta.confirmed.size();
    surfaces::Ledger ledger(state);
    observe_again(ledger, voxels, delta.confirmed);
  }
  surfaces::SurfaceModel& surface = *state.surfaces.find(1);
  surface.set_plane(
      geometry::fitted_plane(surface.moments(&state.noise), surface.reference(), surface.plane().normal));
  EXPECT_GT(readings, 20000U);
  EXPECT_LE(surface.evidence().readings, static_cast<double>(readings));
  EXPECT_GE(surface.evidence().readings, 0.8 * static_cast<double>(readings)) << "all but the boundary's";
  EXPECT_NEAR(surface.plane().signed_distance({0.5, 0.5, 0.012}), 0, 4e-4);
  EXPECT_GT(surface.plane().normal.z(), std::cos(0.001));
}

}  // namespace
}  // namespace octosurf::update
