#include "io/readers/lens.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

namespace octosurf::io {
namespace {

struct RayTable {
  Intrinsics camera;
  Lens lens;
  std::size_t width = 0, height = 0;
  RaySlopes slopes;
};

RayTable table_of(const Intrinsics& camera, const Lens& lens, std::size_t width, std::size_t height) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  RayTable table{camera, lens, width, height, {}};
  const double reach = reach_of(lens);
  table.slopes.reserve(width * height);
  for (std::size_t v = 0; v < height; ++v)
    for (std::size_t u = 0; u < width; ++u) {
      const Eigen::Vector2d seen((static_cast<double>(u) - camera.cx) / camera.fx,
                                 (static_cast<double>(v) - camera.cy) / camera.fy);
      const auto ray = undistorted(lens, seen, reach);
      table.slopes.push_back(ray.value_or(Eigen::Vector2d::Constant(nan)).cast<float>());
    }
  return table;
}

}  // namespace

bool Lens::bends() const {
  return std::ranges::any_of(d, [](double k) { return k != 0; });
}

bool is_known(const Lens& lens) {
  return lens.model == "plumb_bob" || lens.model == "rational_polynomial" || lens.model == "equidistant";
}

Eigen::Vector2d distorted(const Lens& lens, const Eigen::Vector2d& slopes) {
  std::array<double, 8> k{};
  std::copy_n(lens.d.begin(), std::min(lens.d.size(), k.size()), k.begin());
  const double r2 = slopes.squaredNorm();
  if (lens.model == "equidistant") {
    const double r = std::sqrt(r2), a = std::atan(r), a2 = a * a;
    const double seen = a * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
    return r > 0 ? Eigen::Vector2d(seen / r * slopes) : slopes;
  }
  const double x = slopes.x(), y = slopes.y();
  const double radial =
      (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  return radial * slopes + Eigen::Vector2d(2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
                                           k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y);
}

double reach_of(Lens lens) {
  constexpr double step = 0.01;
  constexpr int most_steps = 1000;                                                  // to 84° off the axis
  if (lens.model != "equidistant" && lens.d.size() > 3) lens.d[2] = lens.d[3] = 0;  // radially
  double seen = 0;
  for (int i = 1; i <= most_steps; ++i) {
    const double next = distorted(lens, {i * step, 0}).x();
    if (!(next > seen)) return (i - 1) * step;
    seen = next;
  }
  return most_steps * step;
}

std::optional<Eigen::Vector2d> undistorted(const Lens& lens, const Eigen::Vector2d& seen, double reach) {
  constexpr int most_steps = 20;
  constexpr double exact = 1e-9, step = 1e-6;  // of the focal length
  Eigen::Vector2d slopes = seen;
  for (int i = 0; i < most_steps; ++i) {  // Newton's method
    const Eigen::Vector2d off = distorted(lens, slopes) - seen;
    if (!off.allFinite()) break;
    if (off.norm() < exact) return slopes;
    Eigen::Matrix2d change;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d by = step * Eigen::Vector2d::Unit(axis);
      change.col(axis) = (distorted(lens, slopes + by) - distorted(lens, slopes - by)) / (2 * step);
    }
    slopes -= change.inverse() * off;
    if (slopes.norm() > reach) slopes *= reach / slopes.norm();
  }
  return std::nullopt;
}

std::shared_ptr<const RaySlopes> slopes_of(const Intrinsics& camera, const Lens& lens, std::size_t width,
                                           std::size_t height) {
  static std::mutex mutex;
  static std::shared_ptr<const RayTable> last;
  const std::lock_guard lock(mutex);
  if (!last || last->camera != camera || last->lens != lens || last->width != width || last->height != height)
    last = std::make_shared<const RayTable>(table_of(camera, lens, width, height));
  return {last, &last->slopes};
}

}  // namespace octosurf::io
