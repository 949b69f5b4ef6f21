// The model of a consumer depth camera, each effect by itself against the figure it is said to have.
#include "simulation/real_camera.hpp"

#include "simulation/sensor.hpp"
#include "support/testing.hpp"

namespace octosurf::simulation {
namespace {

constexpr std::size_t pixels = depth_width * depth_height;
constexpr double degree = std::numbers::pi / 180;
constexpr double focal_baseline = 525 * 0.075;  // px·m

// Samples of correlated noise are worth fewer independent ones. For means it is the sum of the window's
// correlation over all lags that counts, 9² = 81; for squares and products the sum of its squares, 6.04².
constexpr double pixels_a_mean = 81, pixels_a_square = 36.5;
constexpr double sigmas = 5;  // of what is estimated: once in two million checks by chance

RealCamera camera_of(std::uint64_t seed, double noise_scale = 1) {
  return {Random(seed, 1), Random(seed, 2), noise_scale};
}

/// A wall before the camera that covers several disparity steps: depth z (1 ± 3 %) from left to right.
Readings wall(double z, double incidence_rad = 0) {
  Readings readings;
  for (std::size_t k = 0; k < pixels; ++k)
    readings.t.push_back(
        static_cast<float>(z * (1 + 0.06 * (static_cast<double>(k % depth_width) / depth_width - 0.5))));
  readings.labels.assign(pixels, 1);
  readings.incidence_rad.assign(pixels, static_cast<float>(incidence_rad));
  return readings;
}

/// Bars 40 pixels wide, 1 m and 2 m away by turns.
Readings bars(bool upright) {
  Readings readings;
  for (std::size_t k = 0; k < pixels; ++k) {
    const bool far = (upright ? k % depth_width : k / depth_width) / 40 % 2 == 1;
    readings.t.push_back(far ? 2.0f : 1.0f);
    readings.labels.push_back(far ? 2 : 1);
  }
  readings.incidence_rad.assign(pixels, 0);
  return readings;
}

double column(std::size_t k) { return static_cast<double>(k % depth_width); }
double row(std::size_t k) { return static_cast<double>(k / depth_width); }

double disparity(float depth) { return focal_baseline / depth; }

/// The running test's camera.
class RealCameraTest : public testing::Test {
 protected:
  Readings measured(const Readings& ideal, std::uint64_t stream) const {
    return camera_.measured(ideal, Random(seed_, stream));
  }
  double bias(std::size_t k) const { return camera_.bias(column(k), row(k)); }

  const std::uint64_t seed_ = test::seed();
  const RealCamera camera_ = camera_of(seed_);
};

TEST(CorrelatedNoise, HasUnitVarianceAndTheWindowsCorrelation) {
  constexpr int fields = 8;
  constexpr std::size_t window = RealCamera::matching_window;
  Random random(test::seed(), 1);
  const std::vector<std::pair<std::size_t, std::size_t>> lags{{0, 0}, {1, 0}, {0, 4}, {5, 3}, {8, 8}, {9, 0}};
  std::vector<double> products(lags.size()), counts(lags.size());
  double sum = 0;
  for (int field = 0; field < fields; ++field) {
    const auto noise = correlated_noise(depth_width, depth_height, window, random);
    ASSERT_EQ(noise.size(), pixels);
    for (const double value : noise) sum += value;
    for (std::size_t i = 0; i < lags.size(); ++i)
      for (std::size_t y = 0; y + lags[i].second < depth_height; ++y)
        for (std::size_t x = 0; x + lags[i].first < depth_width; ++x) {
          products[i] +=
              noise[y * depth_width + x] * noise[(y + lags[i].second) * depth_width + x + lags[i].first];
          ++counts[i];
        }
  }
  EXPECT_NEAR(sum / (fields * pixels), 0, sigmas * std::sqrt(pixels_a_mean / (fields * pixels)));
  for (std::size_t i = 0; i < lags.size(); ++i) {
    const auto [dx, dy] = lags[i];
    const double expected =
        std::max(0.0, 1 - static_cast<double>(dx) / 9) * std::max(0.0, 1 - static_cast<double>(dy) / 9);
    EXPECT_NEAR(products[i] / counts[i], expected, sigmas * std::sqrt(2 * pixels_a_square / counts[i]))
        << "lag " << dx << ", " << dy;
  }
}

TEST_F(RealCameraTest, DepthsDeviateAsPublished) {
  struct Case {
    double z, incidence_deg, sigma;
  };
  // By hand from 0.0012 + 0.0019 (z − 0.4)², beyond 60° with 0.0001 θ² / (√z (π/2 − θ)²) more.
  for (const auto& [z, incidence_deg, sigma] :
       {Case{0.8, 0, 0.001504}, Case{1.5, 45, 0.003499}, Case{2, 0, 0.006064}, Case{3, 0, 0.014044},
        Case{4, 0, 0.025824}, Case{2, 75, 0.006064 + 0.0001 * 25 / std::numbers::sqrt2}}) {
    const Readings ideal = wall(z, incidence_deg * degree), readings = measured(ideal, 100);
    double squares = 0, expected = 0;
    for (std::size_t k = 0; k < pixels; ++k) {
      const double depth = ideal.t[k];
      const double error = disparity(readings.t[k]) - disparity(ideal.t[k]) - bias(k);
      squares += std::pow(error * depth * depth / focal_baseline, 2);
      // The model of the depth in the middle, carried to this pixel's.
      expected += std::pow(sigma + 0.0019 * (std::pow(depth - 0.4, 2) - std::pow(z - 0.4, 2)), 2);
    }
    EXPECT_NEAR(std::sqrt(squares / expected), 1, sigmas * std::sqrt(pixels_a_square / (2.0 * pixels)))
        << z << " m, " << incidence_deg << "°";
  }
}

TEST_F(RealCameraTest, DisparityComesInEighthsOfAPixel) {
  std::set<long> steps;
  for (const float t : measured(wall(2), 7).t) {
    const double eighths = 8 * disparity(t);
    ASSERT_NEAR(eighths, std::round(eighths), 1e-3);
    steps.insert(std::lround(eighths));
  }
  // 1.94 to 2.06 m are 162.4 to 152.9 eighths; noise of half an eighth reaches a little further.
  EXPECT_GE(steps.size(), 10u);
  EXPECT_LE(steps.size(), 20u);
}

TEST_F(RealCameraTest, OutlinesStrayByEightTenthsOfAPixelWithAFlyingPixelEach) {
  constexpr unsigned scans = 6;
  for (const bool upright : {true, false}) {
    const Readings ideal = bars(upright);
    const std::size_t length = upright ? depth_height : depth_width;
    const std::size_t edges = (upright ? depth_width : depth_height) / 40 - 1;
    double mixed = 0, between = 0;
    std::vector<double> strayed(3);
    for (unsigned scan = 0; scan < scans; ++scan) {
      const Readings readings = measured(ideal, 200 + scan);
      for (std::size_t k = 0; k < pixels; ++k) {
        mixed += readings.labels[k] == 0;
        between += readings.t[k] > 1.1f && readings.t[k] < 1.8f;
        const std::size_t across = upright ? k % depth_width : k / depth_width;
        // Pixels j off the border after them, which is half a pixel beyond the last one's centre.
        const std::size_t j = 39 - across % 40;
        if (j < strayed.size() && across / 40 < edges)
          strayed[j] += (readings.t[k] > 1.5f) != (ideal.t[k] > 1.5f);
      }
    }
    const double edge_pixels = static_cast<double>(scans * edges * length);
    // Along an edge the window makes 9 pixels one sample; a place's count varies by less than 1.
    const double uncertainty = sigmas * std::sqrt(9 / edge_pixels);
    EXPECT_NEAR(mixed / edge_pixels, 1, uncertainty);
    EXPECT_NEAR(between / edge_pixels, 0.7, uncertainty) << "depths are spread evenly between";
    for (std::size_t j = 0; j < strayed.size(); ++j) {
      const double expected = std::erfc((static_cast<double>(j) + 0.5) / 0.8 / std::numbers::sqrt2) / 2;
      EXPECT_NEAR(strayed[j] / edge_pixels, expected, uncertainty * std::sqrt(expected * (1 - expected)))
          << j << " pixels off";
    }
  }
}

}  // namespace
}  // namespace octosurf::simulation
