// Recognises a sensor by the directions of its readings.
#include "geometry/degrees.hpp"
#include "geometry/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <octosurf/sensor.hpp>

namespace octosurf {
namespace {

/// Least number of readings that can show a raster or rings.
constexpr std::size_t least_readings = 100;
/// A camera's pixels at most, 4096 × 4096.
constexpr std::size_t most_pixels = std::size_t{1} << 24U;
/// Slope of the widest pinhole's rays against its axis: a field of view of 120°.
constexpr float widest_slope = 1.7321F;
/// Share of the readings that must lie in a field of view; the rest is damage.
constexpr double nearly_all = 0.99;

/// A ray's slopes against the axis of view.
using Slopes = Eigen::Vector2f;

/// Of the rays around an axis, 2: z, as of a camera's optical frame, 0: x, as of a body's; empty if they
/// leave a pinhole's field.
std::vector<Slopes> slopes_around(int axis, const std::vector<Eigen::Vector3f>& points) {
  std::vector<Slopes> slopes;
  for (const Eigen::Vector3f& p : points) {
    const float ahead = p[axis];
    const Slopes s(p[(axis + 1) % 3] / ahead, p[(axis + 2) % 3] / ahead);
    if (ahead > 0 && s.cwiseAbs().maxCoeff() <= widest_slope) slopes.push_back(s);
  }
  if (static_cast<double>(slopes.size()) < nearly_all * static_cast<double>(points.size())) slopes.clear();
  return slopes;
}

/// The line of a raster that each value is on, and the number of lines.
struct Lines {
  std::vector<std::uint32_t> of_values;
  std::size_t count = 0;
  bool even = false;  ///< equally spaced
};

Lines lines_of(const std::vector<Slopes>& slopes, int side) {
  // A fiftieth of the distance of pixels at 2,000 to the focal length; ten times the error of a quotient.
  constexpr float same_line = 1e-5F;
  std::vector<std::uint32_t> order(slopes.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return slopes[i][side]; });
  Lines lines{std::vector<std::uint32_t>(slopes.size()), 1, false};
  std::vector<float> gaps;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const float gap = i == 0 ? 0 : slopes[order[i]][side] - slopes[order[i - 1]][side];
    if (gap > same_line) {
      gaps.push_back(gap);
      ++lines.count;
    }
    lines.of_values[order[i]] = static_cast<std::uint32_t>(lines.count);
  }
  if (gaps.empty()) return lines;
  const float pitch = geometry::median_of(gaps);
  // Lines without readings leave multiples of the pitch; a tenth of it is rounding to a sixth of a pixel.
  const auto fits = std::ranges::count_if(gaps, [&](float gap) {
    const float pitches = gap / pitch;
    return std::round(pitches) >= 1 && std::abs(pitches - std::round(pitches)) < 0.1F;
  });
  lines.even = static_cast<double>(fits) >= 0.8 * static_cast<double>(gaps.size());
  return lines;
}

/// Rays on equally spaced columns and rows, of which any may be missing.
bool is_lattice(const std::vector<Slopes>& slopes) {
  const Lines columns = lines_of(slopes, 0), rows = lines_of(slopes, 1);
  if (!columns.even || !rows.even) return false;
  std::vector<std::uint64_t> pixels;
  for (std::size_t i = 0; i < slopes.size(); ++i)
    pixels.push_back(std::uint64_t{columns.of_values[i]} << 32U | rows.of_values[i]);
  std::ranges::sort(pixels);
  const auto repeated = std::ranges::unique(pixels);
  // Without a raster each ray has lines of its own, or shares them with a few by symmetry.
  return pixels.size() - repeated.size() >= 3 * std::max(columns.count, rows.count);
}

/// Distances of rays to their neighbours at the side and above.
struct Spacing {
  std::vector<float> across, up;
};

/// Share of the values within a quarter of their median; a third for random points.
bool alike(std::vector<float> values) {
  const float usual = geometry::median_of(values);
  const auto near = std::ranges::count_if(values, [&](float v) { return std::abs(v - usual) < usual / 4; });
  return static_cast<double>(near) >= 0.7 * static_cast<double>(values.size());
}

/// Rays with even distances to their neighbours beside and above: a raster bent by lens distortion or blurred
/// by rounding.
bool is_even(std::vector<Slopes> slopes) {
  constexpr std::size_t looked_at = 1000;
  std::ranges::sort(slopes, [](const Slopes& a, const Slopes& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  });
  Slopes low = slopes.front(), high = low;
  for (const Slopes& s : slopes) {
    low = low.cwiseMin(s);
    high = high.cwiseMax(s);
  }
  const Slopes field = high - low, centre = (low + high) / 2;
  const float mean = std::sqrt(field.prod() / static_cast<float>(slopes.size()));
  const float reach = 4 * mean;
  Spacing inner, outer;
  const std::size_t step = std::max<std::size_t>(1, slopes.size() / looked_at);
  for (std::size_t i = step / 2; i < slopes.size(); i += step) {
    const Slopes& at = slopes[i];
    float across = reach, up = reach;
    const auto look = [&](const Slopes& other) {
      const Slopes d = other - at;
      if (d.x() > 0 && std::abs(d.y()) < d.x() / 2) across = std::min(across, d.x());
      if (d.y() > 0 && std::abs(d.x()) < d.y() / 2) up = std::min(up, d.y());
    };
    for (std::size_t k = i; k-- > 0 && at.x() - slopes[k].x() < reach / 2;) look(slopes[k]);
    for (std::size_t k = i + 1; k < slopes.size() && slopes[k].x() - at.x() < reach; ++k) look(slopes[k]);
    Spacing& part = std::abs(at.x() - centre.x()) < field.x() / 4 ? inner : outer;
    if (across < reach) part.across.push_back(across);
    if (up < reach) part.up.push_back(up);
  }
  const std::size_t least = slopes.size() / step / 8;  // a quarter of what a half should have
  if (std::min({inner.across.size(), outer.across.size(), inner.up.size(), outer.up.size()}) <
      std::max<std::size_t>(least, 1))
    return false;
  // A lidar's equal angles are no equal slopes: within 90° they grow by half. A lens bends less than a fifth.
  const float widening = geometry::median_of(outer.across) / geometry::median_of(inner.across);
  if (widening > 1.2F || widening < 1 / 1.2F) return false;
  for (const auto& [from, to] : {std::pair(&outer.across, &inner.across), std::pair(&outer.up, &inner.up)})
    to->insert(to->end(), from->begin(), from->end());
  // 1, or 2 where every other row is left out.
  const float shape = geometry::median_of(inner.up) / geometry::median_of(inner.across);
  return shape > 0.4F && shape < 2.5F && alike(inner.across) && alike(inner.up);
}

template <class... Values>
std::string text(const char* format, Values... values) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

std::string raster_text(const std::vector<Slopes>& slopes) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(90), high = -low;
  for (const Slopes& s : slopes) {
    const Eigen::Vector2d angles = s.cast<double>().array().atan() / rad_per_deg;
    low = low.cwiseMin(angles);
    high = high.cwiseMax(angles);
  }
  return text("a depth camera, by its rays: an even raster of %.0f x %.0f°", high.x() - low.x(),
              high.y() - low.y());
}

/// Rays by elevation and azimuth, about z.
class Directions {
 public:
  explicit Directions(const std::vector<Eigen::Vector3f>& points) : points_(points) {
    for (const Eigen::Vector3f& p : points) {
      const auto [azimuth, elevation] = angles_of(p);
      sectors_[std::min<std::size_t>(71, static_cast<std::size_t>((azimuth + 180) / 5))] = true;
      ++heights_[std::min<std::size_t>(heights_.size() - 1,
                                       static_cast<std::size_t>((elevation + 90) / height))];
      low_ = std::min(low_, elevation);
      high_ = std::max(high_, elevation);
    }
  }

  int around_deg() const { return 5 * static_cast<int>(std::ranges::count(sectors_, true)); }
  double between_deg() const { return high_ - low_; }

  /// Rings: nine of ten readings are within half of the elevations.
  bool on_rings() const {
    auto counts = heights_;
    std::ranges::sort(counts, std::greater());
    std::size_t covered = 0, bins = 0;
    while (covered < points_.size() / 10 * 9 && bins < counts.size()) covered += counts[bins++];
    return static_cast<double>(bins) * height < between_deg() / 2 + height;
  }

  /// Share of readings that lie behind others in their direction by a quarter: none of a sensor's own but at
  /// edges, 6 % at most in the clouds measured.
  double hidden() const {
    std::vector<float> nearest(std::size_t{360} * 180, std::numeric_limits<float>::infinity());
    const auto bin = [](const Eigen::Vector3f& p) {
      const auto [azimuth, elevation] = angles_of(p);
      const auto column = std::clamp(static_cast<int>(azimuth + 180), 0, 359);
      return static_cast<std::size_t>(std::clamp(static_cast<int>(elevation + 90), 0, 179) * 360 + column);
    };
    for (const Eigen::Vector3f& p : points_) nearest[bin(p)] = std::min(nearest[bin(p)], p.norm());
    const auto behind = std::ranges::count_if(
        points_, [&](const Eigen::Vector3f& p) { return p.norm() > 1.25F * nearest[bin(p)]; });
    return static_cast<double>(behind) / static_cast<double>(points_.size());
  }

 private:
  static constexpr double height = 0.05;  // °, a seventh of the distance of 128 rings

  static std::pair<double, double> angles_of(const Eigen::Vector3f& p) {
    const double level = std::hypot(p.x(), p.y());
    return {std::atan2(p.y(), p.x()) / rad_per_deg,
            std::atan2(static_cast<double>(p.z()), level) / rad_per_deg};
  }

  const std::vector<Eigen::Vector3f>& points_;
  std::array<bool, 72> sectors_{};
  std::array<std::size_t, 3600> heights_{};
  double low_ = 90, high_ = -90;
};

std::string lidar_text(const std::vector<Eigen::Vector3f>& points) {
  const Directions rays(points);
  const double hidden = rays.hidden();
  if (hidden > 0.25) return text("a composed cloud: %.0f %% of its readings lie behind others", 100 * hidden);
  if (rays.on_rings() && rays.around_deg() > 120)
    return text("a spinning lidar, by its rays: on rings, around %d°", rays.around_deg());
  if (rays.on_rings())
    return text("a lidar, by its rays: on rings, no even raster, around %d°", rays.around_deg());
  return text("a solid-state lidar or a filtered cloud, by its rays: no even raster, no rings, %d x %.0f°",
              rays.around_deg(), rays.between_deg());
}

}  // namespace

SensorGuess guess_sensor(std::span<const Eigen::Vector3f> points) {
  std::vector<Eigen::Vector3f> finite;
  const std::size_t step = points.size() / most_pixels + 1;
  for (std::size_t i = 0; i < points.size(); i += step)
    if (points[i].allFinite() && !points[i].isZero(0)) finite.push_back(points[i]);
  if (finite.size() < least_readings) return {};
  if (step == 1)
    for (const int axis : {2, 0}) {
      const std::vector<Slopes> slopes = slopes_around(axis, finite);
      if (slopes.empty()) continue;
      // A part of a fine lidar's turn is as even, but its rows are level.
      if (is_lattice(slopes) || (is_even(slopes) && (axis == 2 || !Directions(finite).on_rings())))
        return {SensorKind::depth_camera, axis, raster_text(slopes)};
    }
  return {SensorKind::lidar, 2, lidar_text(finite)};
}

}  // namespace octosurf
