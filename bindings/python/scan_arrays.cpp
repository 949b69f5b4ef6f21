// Points and depth images as NumPy has them, copied into what a Scan owns.
#include "scan_arrays.hpp"

#include "io/readers/depth_image.hpp"

#include <cmath>
#include <cstdint>
#include <pybind11/eigen.h>
#include <string>

#include <octosurf/error.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

constexpr auto dense = py::array::c_style | py::array::forcecast;
constexpr int largest_image = 1 << 16;  ///< pixels a side

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& mend) {
  throw Error(Error::Kind::data, where, what, mend);
}

std::string shape_of(const py::array& array) { return py::str(array.attr("shape")); }

io::Intrinsics camera_of(const py::object& given) {
  const auto numbers = py::array_t<double, dense>::ensure(given);
  if (!numbers) throw py::error_already_set();
  const double* k = numbers.data();
  io::Intrinsics camera;
  if (numbers.ndim() == 1 && numbers.size() == 4)
    camera = {k[0], k[1], k[2], k[3]};
  else if (numbers.ndim() == 2 && numbers.shape(0) == 3 && numbers.shape(1) == 3) {
    const bool pinhole = k[1] == 0 && k[3] == 0 && k[6] == 0 && k[7] == 0 && k[8] == 1;
    if (!pinhole) refuse("intrinsics", "are no K without skew", "give [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]");
    camera = {k[0], k[4], k[2], k[5]};
  } else {
    refuse("intrinsics", "have shape " + shape_of(numbers), "give (fx, fy, cx, cy) or K, (3, 3)");
  }
  const bool usable = std::isfinite(camera.cx) && std::isfinite(camera.cy) && std::isfinite(camera.fx) &&
                      std::isfinite(camera.fy) && camera.fx != 0 && camera.fy != 0;
  if (!usable) refuse("intrinsics", "are not finite, or a focal length is 0", "give them in pixels");
  return camera;
}

std::vector<Eigen::Vector3f> points_of_units(const py::array_t<std::uint16_t, dense>& depth,
                                             const io::Intrinsics& camera, double scale) {
  if (!(scale > 0) || !std::isfinite(scale)) refuse("depth_scale", "is not positive", "give units per metre");
  io::DepthImage image{static_cast<int>(depth.shape(1)),
                       static_cast<int>(depth.shape(0)),
                       {depth.data(), depth.data() + depth.size()}};
  const py::gil_scoped_release others_run;
  return io::back_project(image, camera, scale);
}

std::vector<Eigen::Vector3f> points_of_metres(const py::array_t<float, dense>& depth,
                                              const io::Intrinsics& camera) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(static_cast<std::size_t>(depth.size()));
  const float* z = depth.data();
  for (py::ssize_t v = 0; v < depth.shape(0); ++v) {
    const auto slope_y = static_cast<float>((static_cast<double>(v) - camera.cy) / camera.fy);
    for (py::ssize_t u = 0; u < depth.shape(1); ++u, ++z) {
      if (!(*z > 0) || !std::isfinite(*z)) continue;
      const auto slope_x = static_cast<float>((static_cast<double>(u) - camera.cx) / camera.fx);
      points.emplace_back(slope_x * *z, slope_y * *z, *z);
    }
  }
  return points;
}

}  // namespace

void require_shape(const Points& points) {
  if (points.ndim() == 2 && points.shape(0) == 3 && points.shape(1) != 3)
    refuse("points", "are columns, " + shape_of(points), "give rows: points.T");
  if (points.ndim() < 1 || points.shape(points.ndim() - 1) != 3)
    refuse("points", "have shape " + shape_of(points), "give x, y, z in the last dimension");
}

void copy_points(const Points& points, std::vector<Eigen::Vector3f>& to) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const auto* const first = reinterpret_cast<const Eigen::Vector3f*>(points.data());
  to.assign(first, first + points.size() / 3);
}

std::vector<Eigen::Vector3f> points_of_depth(const py::array& depth, const py::object& intrinsics,
                                             double depth_scale) {
  if (depth.ndim() != 2 || depth.shape(0) > largest_image || depth.shape(1) > largest_image)
    refuse("depth", "has shape " + shape_of(depth), "give an image, (H, W)");
  const io::Intrinsics camera = camera_of(intrinsics);
  if (depth.dtype().kind() == 'f') return points_of_metres(depth, camera);
  if (depth.dtype().kind() == 'u' && depth.itemsize() == 2)
    return points_of_units(depth, camera, depth_scale);
  refuse("depth", "is of " + std::string(py::str(depth.dtype())),
         "give uint16 units, or float32 or float64 metres");
}

}  // namespace octosurf::python
