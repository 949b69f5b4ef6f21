#include "simulation/real_camera.hpp"

#include "simulation/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

constexpr double focal_baseline = depth_focal * RealCamera::baseline;  // px·m

// How many readings are lost is nowhere published as a formula; these figures are chosen. [N]'s deviations
// diverge at 90°: none are lost up to 70°, where they have hardly grown, all from 86° on, where an outline
// strays by two of its usual deviations.
constexpr double grazing_begins_rad = 70 * degree;
constexpr double grazing_ends_rad = 86 * degree;

// The projector's light that comes back goes with albedo · cos(incidence) / z²; half of the readings are
// lost where this is 0.01/m²: black things (0.04) from 2 m on, a light floor (0.6) from 4.5 m
// on, seen from 1.5 m above it. By the fourth power a tenth is lost at 1.7 times as much light, nine tenths
// at 0.6 times.
constexpr double return_at_half = 0.01;
constexpr double return_power = 4;

double disparity(double z) { return focal_baseline / z; }

double standard_normal_cdf(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

/// Orthonormal over the image: mean 0, mean square 1, mean product 0. `u`, `v` run from −1 to 1.
std::array<double, 5> bias_shapes(double u, double v) {
  const double second = std::sqrt(5.0) / 2;
  return {std::sqrt(3.0) * u, std::sqrt(3.0) * v, 3 * u * v, second * (3 * u * u - 1),
          second * (3 * v * v - 1)};
}

/// px: what must be added for the deviation to be axial_sigma() once steps are added: the error of
/// rounding is uniform and, over depths that fall anywhere within a step, independent of the noise.
double added_sigma(double z, double incidence_rad) {
  const double all = RealCamera::axial_sigma(z, incidence_rad) * focal_baseline / (z * z);
  return std::sqrt(std::max(0.0, all * all - RealCamera::disparity_step * RealCamera::disparity_step / 12));
}

/// Four neighbouring pixels around a place in the image and the weights of their mixture.
struct Neighbours {
  std::array<std::size_t, 4> pixels;
  std::array<double, 4> weights;

  Neighbours(double x, double y, std::size_t width, std::size_t height) {
    const double left = std::clamp(std::floor(x), 0.0, static_cast<double>(width) - 2);
    const double top = std::clamp(std::floor(y), 0.0, static_cast<double>(height) - 2);
    const double right_share = std::clamp(x - left, 0.0, 1.0), lower_share = std::clamp(y - top, 0.0, 1.0);
    const std::size_t first = static_cast<std::size_t>(top) * width + static_cast<std::size_t>(left);
    pixels = {first, first + 1, first + width, first + width + 1};
    weights = {(1 - right_share) * (1 - lower_share), right_share * (1 - lower_share),
               (1 - right_share) * lower_share, right_share * lower_share};
  }
};

}  // namespace

std::vector<double> correlated_noise(std::size_t width, std::size_t height, std::size_t window,
                                     Random& random) {
  const std::size_t columns = width + window - 1, rows = height + window - 1;
  std::vector<double> along(rows * width);
  std::vector<double> row(columns);
  for (std::size_t y = 0; y < rows; ++y) {
    for (double& value : row) value = random.normal();
    for (std::size_t i = 0; i < window; ++i)
      for (std::size_t x = 0; x < width; ++x) along[y * width + x] += row[x + i];
  }
  // The sum of window² independent values has `window` times their deviation.
  for (double& value : along) value /= static_cast<double>(window);
  std::vector<double> noise(width * height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t i = 0; i < window; ++i)
      for (std::size_t x = 0; x < width; ++x) noise[y * width + x] += along[(y + i) * width + x];
  return noise;
}

RealCamera::RealCamera(Random bias, Random albedo, double noise_scale)
    : albedo_seed_(albedo.next()), noise_scale_(noise_scale) {
  double squares = 0;
  for (double& coefficient : bias_coefficients_) {
    coefficient = bias.normal();
    squares += coefficient * coefficient;
  }
  for (double& coefficient : bias_coefficients_) coefficient *= bias_rms / std::sqrt(squares);
}

double RealCamera::axial_sigma(double z, double incidence_rad) {
  const double facing = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);  // [N], up to 60°
  if (incidence_rad <= 60 * degree) return facing;
  const double angle = std::min(incidence_rad, grazing_ends_rad);
  const double ratio = angle / (std::numbers::pi / 2 - angle);
  return facing + 0.0001 / std::sqrt(z) * ratio * ratio;  // [N], beyond
}

double RealCamera::lateral_sigma(double incidence_rad) {
  const double angle = std::min(incidence_rad, grazing_ends_rad);
  return 0.8 + 0.035 * angle / (std::numbers::pi / 2 - angle);  // [N]
}

double RealCamera::drop_out(double z, double incidence_rad, double albedo) {
  const double grazing =
      std::clamp((incidence_rad - grazing_begins_rad) / (grazing_ends_rad - grazing_begins_rad), 0.0, 1.0);
  if (grazing == 1) return 1;
  const double returned = albedo * std::cos(incidence_rad) / (z * z);
  const double dark = 1 / (1 + std::pow(returned / return_at_half, return_power));
  return 1 - (1 - grazing) * (1 - dark);
}

double RealCamera::bias(double x, double y) const {
  const auto shapes = bias_shapes((2 * x + 1) / depth_width - 1, (2 * y + 1) / depth_height - 1);
  double sum = 0;
  for (std::size_t i = 0; i < shapes.size(); ++i) sum += bias_coefficients_[i] * shapes[i];
  return sum;
}

double RealCamera::albedo(std::uint16_t face, const Eigen::Vector2d& uv) const {
  const auto index = [](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / dark_patch))) & 0xfffffu;
  };
  const std::uint64_t patch = (face + 1ull) << 40 | index(uv.x()) << 20 | index(uv.y());
  if (Random(albedo_seed_, patch).uniform() < dark_patch_share) return dark_albedo;
  return Random(albedo_seed_, face).uniform(face_albedo[0], face_albedo[1]);
}

void RealCamera::drop(std::span<const double> albedos, Random random, Readings& readings) const {
  const std::vector<double> noise = correlated_noise(depth_width, depth_height, matching_window, random);
  for (std::size_t k = 0; k < readings.t.size(); ++k) {
    if (readings.t[k] == 0) continue;
    if (standard_normal_cdf(noise[k]) >= drop_out(readings.t[k], readings.incidence_rad[k], albedos[k]))
      continue;
    readings.t[k] = 0;
    readings.labels[k] = 0;
  }
}

Readings RealCamera::seen_beside(const Readings& ideal, Random& random) const {
  const std::vector<double> right = correlated_noise(depth_width, depth_height, matching_window, random);
  const std::vector<double> down = correlated_noise(depth_width, depth_height, matching_window, random);
  Readings seen = ideal;
  for (std::size_t k = 0; k < ideal.t.size(); ++k) {
    if (ideal.t[k] == 0) continue;
    const double sigma = noise_scale_ * lateral_sigma(ideal.incidence_rad[k]);
    const Neighbours near(static_cast<double>(k % depth_width) + sigma * right[k],
                          static_cast<double>(k / depth_width) + sigma * down[k], depth_width, depth_height);
    // Within a plane [N]'s axial figure says it all, whichever way the plane is turned.
    const bool one_face =
        ideal.labels[k] != 0 && std::all_of(near.pixels.begin(), near.pixels.end(),
                                            [&](auto p) { return ideal.labels[p] == ideal.labels[k]; });
    const bool all_read =
        std::all_of(near.pixels.begin(), near.pixels.end(), [&](auto p) { return ideal.t[p] > 0; });
    if (one_face || !all_read) continue;
    double z = 0;
    for (std::size_t i = 0; i < 4; ++i) z += near.weights[i] * ideal.t[near.pixels[i]];
    const std::size_t nearest =
        near.pixels[std::max_element(near.weights.begin(), near.weights.end()) - near.weights.begin()];
    bool mixed = false;
    for (std::size_t i = 0; i < 4; ++i)
      mixed = mixed || (near.weights[i] > 0 && ideal.labels[near.pixels[i]] != ideal.labels[nearest]);
    seen.t[k] = static_cast<float>(z);  // of depths, not of disparities, as in [B]
    seen.labels[k] = mixed ? 0 : ideal.labels[nearest];
    seen.incidence_rad[k] = ideal.incidence_rad[nearest];
  }
  return seen;
}

Readings RealCamera::measured(const Readings& ideal, Random random) const {
  Readings readings = seen_beside(ideal, random);
  const std::vector<double> noise = correlated_noise(depth_width, depth_height, matching_window, random);
  for (std::size_t k = 0; k < readings.t.size(); ++k) {
    const double z = readings.t[k];
    if (z == 0) continue;
    const double error = bias(static_cast<double>(k % depth_width), static_cast<double>(k / depth_width)) +
                         added_sigma(z, readings.incidence_rad[k]) * noise[k];
    const double steps = std::round((disparity(z) + noise_scale_ * error) / disparity_step);
    readings.t[k] = static_cast<float>(focal_baseline / (std::max(1.0, steps) * disparity_step));
  }
  return readings;
}

}  // namespace octosurf::simulation
