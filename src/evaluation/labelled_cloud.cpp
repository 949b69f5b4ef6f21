#include "evaluation/labels.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <pcl/PCLPointCloud2.h>
#include <pcl/common/io.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <spng.h>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr double icl_units_per_metre = 5000;
constexpr std::uint32_t largest_image = 16384;  // pixels a side
constexpr double most_points_per_byte = 100;    // LZF packs at most 88 bytes into one
constexpr int longest_header = 100;             // lines

[[noreturn]] void refuse(const fs::path& file, const std::string& what, const std::string& mend = {}) {
  throw Error(Error::Kind::data, file.string(), what, mend);
}

/// One field of a cloud whose elements are four bytes wide.
class Column {
 public:
  Column(const pcl::PCLPointCloud2& cloud, const std::string& name) : cloud_(cloud) {
    const int index = pcl::getFieldIndex(cloud, name);
    if (index < 0) return;
    const pcl::PCLPointField& field = cloud.fields[static_cast<std::size_t>(index)];
    offset_ = field.offset;
    floating_ = field.datatype == pcl::PCLPointField::FLOAT32;
    present_ = floating_ || field.datatype == pcl::PCLPointField::UINT32 ||
               field.datatype == pcl::PCLPointField::INT32;
  }
  bool present() const { return present_; }
  bool floating() const { return floating_; }
  float real(std::size_t row) const { return std::bit_cast<float>(bits(row)); }
  /// A label: a whole number, 0 for anything else.
  std::uint32_t label(std::size_t row) const {
    if (!floating_) return bits(row);
    const float value = real(row);
    return value >= 0.5F && value < 1e6F ? static_cast<std::uint32_t>(std::lround(value)) : 0;
  }

 private:
  std::uint32_t bits(std::size_t row) const {
    std::uint32_t value = 0;
    std::memcpy(&value, cloud_.data.data() + row * cloud_.point_step + offset_, sizeof value);
    return value;
  }

  const pcl::PCLPointCloud2& cloud_;
  std::size_t offset_ = 0;
  bool present_ = false, floating_ = false;
};

// PCL 1.13 crashes on a file without header and allocates whatever the header promises.
void require_header(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const auto most_points = static_cast<double>(fs::file_size(file)) * most_points_per_byte;
  std::string line;
  for (int i = 0; i < longest_header && std::getline(stream, line); ++i) {
    std::istringstream words(line);
    std::string key;
    double value = 0;
    words >> key;
    if (key == "DATA") return;
    if (key != "POINTS" && key != "WIDTH" && key != "HEIGHT") continue;
    if (!(words >> value) || value < 1 || value > most_points) {
      refuse(file, "its header promises points that it cannot hold");
    }
  }
  refuse(file, "is not a PCD file");
}

struct PosedCloud {
  pcl::PCLPointCloud2 cloud;
  Eigen::Isometry3f T_map_sensor = Eigen::Isometry3f::Identity();
};

PosedCloud read_pcd(const fs::path& file) {
  require_header(file);
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // the library never prints
  PosedCloud result;
  pcl::PCLPointCloud2& cloud = result.cloud;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  try {
    if (pcl::PCDReader().read(file.string(), cloud, origin, orientation, version) < 0) {
      refuse(file, "is not a readable PCD file");
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    refuse(file, std::string("is not a readable PCD file: ") + error.what());
  }
  if (cloud.data.size() < std::size_t{cloud.width} * cloud.height * cloud.point_step) {
    refuse(file, "holds fewer points than it says");
  }
  if (!origin.allFinite() || !(std::abs(orientation.norm() - 1) < 1e-3F)) {
    refuse(file, "its VIEWPOINT is no pose");
  }
  result.T_map_sensor.translate(origin.head<3>());
  result.T_map_sensor.rotate(orientation.normalized());
  return result;
}

LabelledCloud load_pcd(const fs::path& file) {
  const auto [cloud, T_map_sensor] = read_pcd(file);
  const Column x(cloud, "x"), y(cloud, "y"), z(cloud, "z"), label(cloud, "label");
  const Column intensity(cloud, "intensity");
  if (!(x.floating() && y.floating() && z.floating())) refuse(file, "has no float32 fields x, y, z");
  if (!label.present() && !intensity.present()) {
    refuse(file, "has no labels", "they are expected in a 4-byte field label or intensity");
  }
  // mOSD's clouds are coloured; labels without colours are planes, e.g. of a simulated recording.
  const bool support = label.present() && pcl::getFieldIndex(cloud, "rgba") >= 0;
  LabelledCloud result;
  result.kind = support ? LabelledCloud::Kind::support : LabelledCloud::Kind::planes;
  for (std::size_t i = 0; i < std::size_t{cloud.width} * cloud.height; ++i) {
    const Eigen::Vector3f point(x.real(i), y.real(i), z.real(i));
    if (!point.allFinite()) continue;
    const std::uint32_t id = label.present() ? label.label(i) : intensity.label(i);
    result.points.push_back(T_map_sensor * point);
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

}  // namespace octosurf
