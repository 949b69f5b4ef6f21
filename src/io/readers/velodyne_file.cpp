#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/text_file.hpp"

#include <octosurf/error.hpp>

namespace octosurf::io {

Cloud read_velodyne(const std::filesystem::path& file) {
  constexpr std::size_t step = 4 * sizeof(float);
  const std::string bytes = read_bytes(file, largest_cloud_file);
  if (bytes.empty() || bytes.size() % step != 0)
    throw Error(Error::Kind::data, file.string(),
                bytes.empty() ? "is empty" : "is not a list of float32 x y z reflectance",
                "the file is truncated or foreign");
  return {binary_points(bytes, {{{0, step}, {4, step}, {8, step}}}, bytes.size() / step, false),
          Eigen::Isometry3d::Identity(), false};
}

}  // namespace octosurf::io
