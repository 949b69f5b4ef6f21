#include "evaluation/labels.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/depth_image.hpp"

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double icl_units_per_metre = 5000;

[[noreturn]] void refuse(const fs::path& file, const std::string& what, const std::string& hint = {}) {
  throw Error(Error::Kind::data, file.string(), what, hint);
}

LabelledCloud load_pcd(const fs::path& file) {
  const io::Cloud cloud = io::read_pcd(file);
  require_rigid(cloud.T_map_sensor, file.string());
  if (cloud.labels.field.empty())
    refuse(file, "has no labels", "they are expected in a 4-byte field label or intensity");
  // mOSD's clouds are coloured; labels without colours are planes, e.g. of a simulated recording.
  const bool support = cloud.labels.field == "label" && cloud.labels.colored;
  const Eigen::Isometry3f T_map_sensor = cloud.T_map_sensor.cast<float>();
  LabelledCloud result;
  result.kind = support ? LabelledCloud::Kind::support : LabelledCloud::Kind::planes;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const double label = cloud.labels.values[i];  // a whole number, and 0 for anything else
    const auto id = label >= 0.5 && label < 4294967295.0 ? static_cast<std::uint32_t>(label + 0.5) : 0U;
    result.points.push_back(T_map_sensor * cloud.points[i]);
    result.labels.push_back(support && id >= 1 && id <= 9 ? 1 : id);  // parts of one table
  }
  return result;
}

fs::path only(const fs::path& folder, const std::string& part, const std::string& ending) {
  fs::path match;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(ending) || name.find(part) == std::string::npos) continue;
    if (!match.empty()) refuse(folder, "holds more than one *" + part + "*" + ending);
    match = entry.path();
  }
  if (match.empty())
    refuse(folder, "holds no *" + part + "*" + ending, "depth*.png, *labels*.png and *.K are expected");
  return match;
}

LabelledCloud load_depth_folder(const fs::path& folder) {
  const io::DepthImage depth = io::read_depth_image(only(folder, "depth", ".png"));
  const fs::path label_file = only(folder, "labels", ".png");
  const io::DepthImage labels = io::read_depth_image(label_file);
  const io::Intrinsics k = io::read_intrinsics(only(folder, "", ".K"));
  if (labels.width != depth.width || labels.height != depth.height)
    refuse(label_file, "has another size than the depth image");
  LabelledCloud result;
  std::size_t i = 0;
  for (int row = 0; row < depth.height; ++row)
    for (int column = 0; column < depth.width; ++column, ++i) {
      if (depth.pixels[i] == 0) continue;
      const double z = depth.pixels[i] / icl_units_per_metre;
      result.points.push_back(
          Eigen::Vector3d((column - k.cx) / k.fx * z, (row - k.cy) / k.fy * z, z).cast<float>());
      result.labels.push_back(labels.pixels[i]);
    }
  return result;
}

}  // namespace

LabelledCloud load_labelled_cloud(const fs::path& path) {
  std::error_code failed;
  const bool folder = fs::is_directory(path, failed);
  if (!folder && !fs::is_regular_file(path, failed)) refuse(path, "is neither a file nor a folder");
  LabelledCloud cloud = folder ? load_depth_folder(path) : load_pcd(path);
  if (cloud.points.empty()) refuse(path, "holds no point");
  cloud.name = path.string();
  return cloud;
}

}  // namespace octosurf::evaluation
