#include "io/cloud_file.hpp"
#include "io/cloud_rows.hpp"
#include "io/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <pcl/io/lzf.h>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::uint64_t lzf_ratio = 100;  // LZF writes at most 264 bytes for 3 read
// What a compressed cloud may take, its file not counted.
constexpr std::uint64_t free_bytes = std::uint64_t{64} << 20, bytes_per_file_byte = 7;

/// In the order the format prescribes.
constexpr std::array<std::string_view, 10> keywords{"VERSION", "FIELDS", "SIZE",      "TYPE",   "COUNT",
                                                    "WIDTH",   "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};

class PcdReader {
 public:
  PcdReader(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {}

  Cloud read() {
    read_header();
    check_fields();
    check_points();
    Cloud cloud{{}, viewpoint(), value("HEIGHT") > 1};
    const auto& data = header("DATA");
    const std::string_view format = data.size() == 2 ? data[1] : "";
    if (format == "ascii")
      cloud.points = text_points(lines_, xyz_, points_, columns_, file_);
    else if (format == "binary")
      cloud.points = binary(lines_.rest());
    else if (format == "binary_compressed")
      cloud.points = compressed(lines_.rest());
    else
      refuse("PCD DATA is none of ascii, binary, binary_compressed");
    return cloud;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), what, "write the PCD file again");
  }

  void read_header() {
    auto expected = keywords.begin();
    for (std::string_view line; expected != keywords.end();) {
      if (!lines_.next(line)) refuse("truncated or damaged PCD header");
      Words words = words_of(line);
      if (words.empty() || words[0].starts_with('#')) continue;
      if (words[0] == "COLUMNS") words[0] = "FIELDS";  // its old name
      const auto found = std::find(expected, keywords.end(), words[0]);
      if (found == keywords.end())
        refuse(std::string("PCD header line '").append(words[0].substr(0, 20)) + "' is not expected here");
      expected = found + 1;
      header_.emplace(words[0], words);
    }
  }

  const Words& header(std::string_view keyword) const {
    const auto found = header_.find(keyword);
    if (found == header_.end()) refuse(std::string("PCD header has no ").append(keyword));
    return found->second;
  }

  std::uint64_t value(std::string_view keyword) const {
    const auto& words = header(keyword);
    if (words.size() != 2) refuse(std::string("PCD header needs one value for ").append(keyword));
    return count_in_header(words[1], file_);
  }

  void check_fields() {
    const auto& names = header("FIELDS");
    const auto& sizes = header("SIZE");
    const auto& types = header("TYPE");
    const Words ones(names.size(), "1");
    const auto& counts = header_.contains("COUNT") ? header("COUNT") : ones;
    if (sizes.size() != names.size() || types.size() != names.size() || counts.size() != names.size())
      refuse("PCD header lines FIELDS, SIZE, TYPE and COUNT differ in length");
    std::array<int, 3> found{};
    for (std::size_t i = 1; i < names.size(); ++i) {
      const std::size_t size = count_in_header(sizes[i], file_), count = count_in_header(counts[i], file_);
      const bool real = types[i] == "F" && (size == 4 || size == 8);
      const bool integer =
          (types[i] == "I" || types[i] == "U") && (size == 1 || size == 2 || size == 4 || size == 8);
      if ((!real && !integer) || count == 0 || count > largest_step)
        refuse(std::string("PCD field '").append(names[i].substr(0, 20)) +
               "' has no usable SIZE, TYPE or COUNT");
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (names[i] != std::string_view("xyz").substr(axis, 1)) continue;
        found[axis] += real && count == 1 ? 1 : 2;
        xyz_[axis] = {step_, 0, columns_, size == 8};
      }
      step_ += size * count;
      columns_ += count;
      if (step_ > largest_step) refuse("a PCD with more than 65536 bytes per point");
    }
    if (found != std::array{1, 1, 1}) refuse("a PCD without one each of x, y and z as real numbers");
  }

  void check_points() {
    points_ = value("POINTS");
    if (value("WIDTH") * value("HEIGHT") != points_) refuse("PCD header says WIDTH x HEIGHT is not POINTS");
    if (points_ == 0) refuse("a cloud without points");
  }

  [[noreturn]] void refuse_truncated() const {
    refuse("truncated or damaged PCD: " + std::to_string(points_) + " points announced");
  }

  std::vector<Eigen::Vector3f> binary(std::string_view bytes) {
    if (bytes.size() / step_ < points_) refuse_truncated();
    for (auto& c : xyz_) c.step = step_;
    return binary_points(bytes, xyz_, points_, false);
  }

  /// All x, then all y, and so on, as one LZF block behind its two sizes.
  std::vector<Eigen::Vector3f> compressed(std::string_view bytes) {
    std::array<std::uint32_t, 2> sizes{};  // compressed, uncompressed
    if (bytes.size() < sizeof sizes) refuse_truncated();
    std::memcpy(sizes.data(), bytes.data(), sizeof sizes);
    bytes.remove_prefix(sizeof sizes);
    if (sizes[0] > bytes.size() || sizes[1] != points_ * step_ || sizes[1] > lzf_ratio * sizes[0])
      refuse_truncated();
    if (sizes[1] + sizeof(Eigen::Vector3f) * points_ > free_bytes + bytes_per_file_byte * bytes.size())
      refuse("a PCD that is compressed to less than a seventh and has over 64 MiB of points");
    std::string columns(sizes[1], '\0');
    if (pcl::lzfDecompress(bytes.data(), sizes[0], columns.data(), sizes[1]) != sizes[1]) refuse_truncated();
    for (auto& c : xyz_) {
      c.offset *= points_;
      c.step = c.is_double ? sizeof(double) : sizeof(float);
    }
    return binary_points(columns, xyz_, points_, false);
  }

  Eigen::Isometry3d viewpoint() const {
    if (!header_.contains("VIEWPOINT")) return Eigen::Isometry3d::Identity();
    const auto& words = header("VIEWPOINT");
    if (words.size() != 8) refuse("PCD VIEWPOINT needs tx ty tz qw qx qy qz");
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = number(words[i + 1], file_, lines_.number());
    return pose_from({v[0], v[1], v[2]}, Eigen::Quaterniond(v[3], v[4], v[5], v[6]));
  }

  const std::filesystem::path& file_;
  Lines lines_;
  std::map<std::string_view, Words> header_;
  Coordinates xyz_;
  std::size_t step_ = 0, columns_ = 0, points_ = 0;
};

}  // namespace

Cloud read_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  return PcdReader(file, bytes).read();
}

}  // namespace octosurf
