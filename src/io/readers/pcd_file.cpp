#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/readers/pose_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <lzf.h>
#include <map>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::uint64_t lzf_ratio = 100;  // LZF writes at most 264 bytes for 3 read
// Memory limit for a compressed cloud, without its file.
constexpr std::uint64_t pcd_free_bytes = std::uint64_t{64} << 20, pcd_bytes_per_file_byte = 7;

constexpr std::array<std::string_view, 10> keywords{"VERSION", "FIELDS", "SIZE",      "TYPE",   "COUNT",
                                                    "WIDTH",   "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};

/// None: not a type.
Scalar scalar_of(std::string_view type, std::size_t size) {
  static const std::map<std::string, Scalar> all{
      {"I1", Scalar::int8},    {"I2", Scalar::int16},  {"I4", Scalar::int32},  {"I8", Scalar::int64},
      {"U1", Scalar::uint8},   {"U2", Scalar::uint16}, {"U4", Scalar::uint32}, {"U8", Scalar::uint64},
      {"F4", Scalar::float32}, {"F8", Scalar::float64}};
  const auto found = all.find(std::string(type.substr(0, 2)) + std::to_string(size));
  return found == all.end() ? Scalar::none : found->second;
}

class PcdReader {
 public:
  PcdReader(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {}

  Cloud read() {
    read_header();
    check_points();
    const auto& data = header("DATA");
    const std::string_view format = data.size() == 2 ? data[1] : "";
    lay_out(1);
    const std::size_t step_of_ones = step_, columns_of_ones = columns_;
    lay_out(0);
    const Eigen::Isometry3d T_map_sensor = viewpoint();
    Cloud cloud;
    if (format == "ascii") {
      Lines rows = lines_;
      if (columns_ != columns_of_ones && columns_in(rows) == columns_of_ones) lay_out(1);
      cloud = text_points(lines_, xyz_, points_, columns_, file_);
      labels_.values = text_times(rows, label_, points_, file_).values;
      cloud.times = text_times(rows, time_, points_, file_);
    } else if (format == "binary") {
      std::string_view bytes = lines_.rest();
      if (bytes.size() == points_ * step_of_ones) lay_out(1);
      cloud = binary(rows_of(bytes));
    } else if (format == "binary_compressed") {
      cloud = binary(decompressed(lines_.rest(), step_of_ones));
    } else {
      refuse("PCD DATA is none of ascii, binary, binary_compressed");
    }
    cloud.T_map_sensor = T_map_sensor;
    cloud.labels = std::move(labels_);
    return cloud;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), what, "write the PCD file again");
  }

  void read_header() {
    while (!header_.contains("DATA")) {
      std::string_view line;
      if (!lines_.next(line)) refuse("truncated or damaged PCD header");
      const Words words = words_of(line);
      if (words.empty() || words[0].starts_with('#')) continue;
      const bool known = std::ranges::find(keywords, words[0]) != keywords.end();
      if (!known || !header_.emplace(words[0], words).second)
        refuse("PCD header line '" + printable(std::string(words[0].substr(0, 20))) +
               "' is not expected here");
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

  /// Some writers give a field that takes no room a COUNT of 0, others one of one value: `zero_counts`.
  void lay_out(std::size_t zero_counts) {
    const auto& names = header("FIELDS");
    const Words &sizes = header("SIZE"), &types = header("TYPE"), &counts = header("COUNT");
    if (sizes.size() != names.size() || types.size() != names.size() || counts.size() != names.size())
      refuse("PCD header lines FIELDS, SIZE, TYPE and COUNT differ in length");
    step_ = columns_ = 0;
    label_ = {};
    time_ = {};
    labels_ = {};
    std::array<int, 3> found{};
    for (std::size_t i = 1; i < names.size(); ++i) {
      const std::size_t size = count_in_header(sizes[i], file_);
      std::size_t count = count_in_header(counts[i], file_);
      const Scalar type = scalar_of(types[i], size);
      const auto axis = axis_of(names[i]);
      if (count == 0) count = axis ? 1 : zero_counts;
      if ((type == Scalar::none && names[i] != "_") || size > largest_step || count > largest_step)
        refuse(std::string("PCD field '").append(names[i].substr(0, 20)) +
               "' has no usable SIZE, TYPE or COUNT");
      if (axis) {
        found[*axis] += is_real(type) && count == 1 ? 1 : 2;
        xyz_[*axis] = {step_, 0, columns_, type};
      }
      note_label(names[i], type, count);
      if (count == 1) time_.note(names[i], {step_, 0, columns_, type});
      step_ += size * count;
      columns_ += count;
      if (step_ > largest_step) refuse("a PCD with more than 65536 bytes per point");
    }
    if (found != std::array{1, 1, 1})
      refuse("a PCD without one each of x, y and z as real numbers, which are in metres");
  }

  static std::size_t columns_in(Lines rows) {
    std::string_view line;
    while (rows.next(line))
      if (const Words words = words_of(line); !words.empty()) return words.size();
    return 0;
  }

  void note_label(std::string_view name, Scalar type, std::size_t count) {
    if (name == "rgba") labels_.colored = true;
    const bool better = name == "label" || (name == "intensity" && labels_.field.empty());
    if (!better || size_of(type) != 4 || count != 1) return;
    labels_.field = name;
    label_.place = {step_, 0, columns_, type};
  }

  void check_points() {
    const bool sized = header_.contains("WIDTH");
    const std::uint64_t height = header_.contains("HEIGHT") ? value("HEIGHT") : 1;
    points_ = header_.contains("POINTS") || !sized ? value("POINTS") : value("WIDTH") * height;
    if (sized && value("WIDTH") * height != points_) refuse("PCD header says WIDTH x HEIGHT is not POINTS");
    if (points_ == 0) refuse("a cloud without points");
  }

  [[noreturn]] void refuse_truncated() const {
    refuse("truncated or damaged PCD: " + std::to_string(points_) + " points announced");
  }

  std::string_view rows_of(std::string_view bytes) {
    if (bytes.size() / step_ < points_) refuse_truncated();
    for_each_column([&](Field& c) { c.step = step_; });
    return bytes;
  }

  /// All x, then all y, and so on, as one LZF block after its two sizes.
  std::string decompressed(std::string_view bytes, std::size_t step_of_ones) {
    if (bytes.size() < 8) refuse_truncated();
    const auto size = number_at<std::uint32_t>(bytes.data(), false);
    const auto plain_size = number_at<std::uint32_t>(bytes.data() + 4, false);
    bytes.remove_prefix(8);
    if (plain_size == points_ * step_of_ones) lay_out(1);
    if (size > bytes.size() || plain_size != points_ * step_ || plain_size > lzf_ratio * size)
      refuse_truncated();
    if (plain_size + sizeof(Eigen::Vector3f) * points_ >
        pcd_free_bytes + pcd_bytes_per_file_byte * bytes.size())
      refuse("a PCD that is compressed to less than a seventh and has over 64 MiB of points");
    std::string columns(plain_size, '\0');
    if (lzf_decompress(bytes.data(), size, columns.data(), plain_size) != plain_size) refuse_truncated();
    for_each_column([&](Field& c) {
      c.offset *= points_;
      c.step = size_of(c.type);
    });
    return columns;
  }

  template <class Change>
  void for_each_column(const Change& change) {
    for (Field& c : xyz_) change(c);
    if (label_.place) change(*label_.place);
    if (time_.place) change(*time_.place);
  }

  Cloud binary(std::string_view bytes) {
    Cloud cloud = binary_points(bytes, xyz_, !little_endian_host, points_);
    cloud.times = binary_times(bytes, time_, !little_endian_host, points_);
    labels_.values = binary_times(bytes, label_, !little_endian_host, points_).values;
    return cloud;
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
  TimeField label_, time_;
  PcdLabels labels_;
  std::size_t step_ = 0, columns_ = 0, points_ = 0;
};

}  // namespace

Cloud read_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  return PcdReader(file, bytes).read();
}

bool is_column(const std::filesystem::path& pcd) {
  std::string head(1024, '\0');  // of a kept scan's some 200
  std::ifstream(pcd, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.find("\nWIDTH 1\n") != std::string::npos && head.find("\nHEIGHT 1\n") == std::string::npos;
}

}  // namespace octosurf::io
