#include "evaluation/labels.hpp"
#include "io/readers/cloud_file.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <spng.h>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double icl_units_per_metre = 5000;
constexpr std::uint32_t largest_image = 16384;  // pixels a side

[[noreturn]] void refuse(const fs::path& file, const std::string& what, const std::string& mend = {}) {
  throw Error(Error::Kind::data, file.string(), what, mend);
}

LabelledCloud load_pcd(const fs::path& file) {
  const auto [cloud, labels] = io::read_labelled_pcd(file);
  require_rigid(cloud.T_map_sensor, file.string());
  if (labels.field.empty())
    refuse(file, "has no labels", "they are expected in a 4-byte field label or intensity");
  // mOSD's clouds are coloured; labels without colours are planes, e.g. of a simulated recording.
  const bool support = labels.field == "label" && labels.colored;
  const Eigen::Isometry3f T_map_sensor = cloud.T_map_sensor.cast<float>();
  LabelledCloud result;
  result.kind = support ? LabelledCloud::Kind::support : LabelledCloud::Kind::planes;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const std::uint32_t id = labels.of_points[i];
    result.points.push_back(T_map_sensor * cloud.points[i]);
    result.labels.push_back(support && id >= 1 && id <= 9 ? 1 : id);  // parts of one table
  }
  return result;
}

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint16_t> pixels;
};

Image read_png(const fs::path& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream) refuse(file, "cannot be opened");
  const std::unique_ptr<spng_ctx, void (*)(spng_ctx*)> context(spng_ctx_new(0), &spng_ctx_free);
  const auto check = [&file](int code) {
    if (code != 0) refuse(file, std::string("is not a readable PNG: ") + spng_strerror(code));
  };
  spng_ihdr header{};
  std::size_t bytes = 0;
  check(spng_set_image_limits(context.get(), largest_image, largest_image));
  check(spng_set_png_file(context.get(), stream.get()));
  check(spng_get_ihdr(context.get(), &header));
  if (header.bit_depth != 16 || header.color_type != SPNG_COLOR_TYPE_GRAYSCALE) {
    refuse(file, "is not a 16-bit grey image");
  }
  check(spng_decoded_image_size(context.get(), SPNG_FMT_PNG, &bytes));
  Image image{header.width, header.height, std::vector<std::uint16_t>(bytes / 2)};
  check(spng_decode_image(context.get(), image.pixels.data(), bytes, SPNG_FMT_PNG, 0));  // host byte order
  return image;
}

struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

Intrinsics read_intrinsics(const fs::path& file) {
  std::ifstream stream(file);
  std::array<double, 9> k{};
  for (double& value : k) stream >> value;
  if (!stream || !(std::abs(k[0]) > 1 && std::abs(k[4]) > 1))
    refuse(file, "is not a 3×3 matrix of intrinsics");
  return {k[0], k[4], k[2], k[5]};
}

fs::path only(const fs::path& folder, const std::string& part, const std::string& ending) {
  fs::path match;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(ending) || name.find(part) == std::string::npos) continue;
    if (!match.empty()) refuse(folder, "holds more than one *" + part + "*" + ending);
    match = entry.path();
  }
  if (match.empty()) {
    refuse(folder, "holds no *" + part + "*" + ending, "depth*.png, *labels*.png and *.K are expected");
  }
  return match;
}

LabelledCloud load_depth_folder(const fs::path& folder) {
  const Image depth = read_png(only(folder, "depth", ".png"));
  const fs::path label_file = only(folder, "labels", ".png");
  const Image labels = read_png(label_file);
  const Intrinsics k = read_intrinsics(only(folder, "", ".K"));
  if (labels.width != depth.width || labels.height != depth.height) {
    refuse(label_file, "has another size than the depth image");
  }
  LabelledCloud result;
  for (std::uint32_t row = 0; row < depth.height; ++row) {
    for (std::uint32_t column = 0; column < depth.width; ++column) {
      const std::size_t i = std::size_t{row} * depth.width + column;
      if (depth.pixels[i] == 0) continue;
      const double z = depth.pixels[i] / icl_units_per_metre;
      result.points.push_back(
          Eigen::Vector3d((column - k.cx) / k.fx * z, (row - k.cy) / k.fy * z, z).cast<float>());
      result.labels.push_back(labels.pixels[i]);
    }
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
