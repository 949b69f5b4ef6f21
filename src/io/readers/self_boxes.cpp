#include "io/readers/self_boxes.hpp"

#include <limits>

namespace octosurf::io {

std::size_t erase_own(Scan& scan, std::span<const SelfBox> boxes,
                      const std::function<Eigen::Isometry3d(const std::string& frame)>& sensor_in) {
  std::size_t own = 0;
  for (const SelfBox& self : boxes) {
    const Eigen::Isometry3f T =
        (self.frame ? sensor_in(*self.frame) : Eigen::Isometry3d::Identity()).cast<float>();
    const Eigen::AlignedBox3f box = self.box.cast<float>();
    for (Eigen::Vector3f& point : scan.points) {
      if (!box.contains(T * point)) continue;  // nor does it contain NaN
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
      ++own;
    }
  }
  return own;
}

}  // namespace octosurf::io
