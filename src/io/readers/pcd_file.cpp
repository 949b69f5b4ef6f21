#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/readers/pose_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <lzf.h>
#include <map>
#include <optional>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::uint64_t lzf_ratio = 100;  // LZF writes at most 264 bytes for 3 read
// Memory limit for a compressed cloud, without its file.
constexpr std::uint64_t pcd_free_bytes = std::uint64_t{64} << 20, pcd_bytes_per_file_byte = 7;

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
    if (format == "ascii") {
      Lines rows = lines_;
      cloud.points = text_points(lines_, xyz_, points_, columns_, file_);
      read_text_labels(rows);
    } else if (format == "binary") {
      read_binary(rows_of(lines_.rest()), cloud);
    } else if (format == "binary_compressed") {
      read_binary(decompressed(lines_.rest()), cloud);
    } else {
      refuse("PCD DATA is none of ascii, binary, binary_compressed");
    }
    return cloud;
  }

  /// After read().
  PcdLabels take_labels() { return std::move(labels_); }

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
      note_label(names[i], types[i], size, count);
      step_ += size * count;
      columns_ += count;
      if (step_ > largest_step) refuse("a PCD with more than 65536 bytes per point");
    }
    if (found != std::array{1, 1, 1}) refuse("a PCD without one each of x, y and z as real numbers");
  }

  void note_label(std::string_view name, std::string_view type, std::size_t size, std::size_t count) {
    if (name == "rgba") labels_.colored = true;
    const bool better = name == "label" || (name == "intensity" && labels_.field.empty());
    if (!better || size != 4 || count != 1) return;
    labels_.field = name;
    label_ = {{step_, 0, columns_, false}, type == "F"};
  }

  void check_points() {
    points_ = value("POINTS");
    if (value("WIDTH") * value("HEIGHT") != points_) refuse("PCD header says WIDTH x HEIGHT is not POINTS");
    if (points_ == 0) refuse("a cloud without points");
  }

  [[noreturn]] void refuse_truncated() const {
    refuse("truncated or damaged PCD: " + std::to_string(points_) + " points announced");
  }

  std::string_view rows_of(std::string_view bytes) {
    if (bytes.size() / step_ < points_) refuse_truncated();
    for_each_column([&](Coordinate& c) { c.step = step_; });
    return bytes;
  }

  /// All x, then all y, and so on, as one LZF block after its two sizes.
  std::string decompressed(std::string_view bytes) {
    if (bytes.size() < 8) refuse_truncated();
    const auto size = number_at<std::uint32_t>(bytes.data(), false);
    const auto plain_size = number_at<std::uint32_t>(bytes.data() + 4, false);
    bytes.remove_prefix(8);
    if (size > bytes.size() || plain_size != points_ * step_ || plain_size > lzf_ratio * size)
      refuse_truncated();
    if (plain_size + sizeof(Eigen::Vector3f) * points_ >
        pcd_free_bytes + pcd_bytes_per_file_byte * bytes.size())
      refuse("a PCD that is compressed to less than a seventh and has over 64 MiB of points");
    std::string columns(plain_size, '\0');
    if (lzf_decompress(bytes.data(), size, columns.data(), plain_size) != plain_size) refuse_truncated();
    for_each_column([&](Coordinate& c) {
      c.offset *= points_;
      c.step = c.is_double ? sizeof(double) : sizeof(float);
    });
    return columns;
  }

  template <class Change>
  void for_each_column(const Change& change) {
    for (Coordinate& c : xyz_) change(c);
    if (label_) change(label_->place);
  }

  void read_binary(std::string_view bytes, Cloud& cloud) {
    cloud.points = binary_points(bytes, xyz_, points_, false);
    if (!label_) return;
    for (std::size_t i = 0; i < points_; ++i) {
      const auto bits =
          number_at<std::uint32_t>(bytes.data() + label_->place.offset + i * label_->place.step, false);
      labels_.of_points.push_back(label_->is_float ? label_of(std::bit_cast<float>(bits)) : bits);
    }
  }

  /// Called after text_points() has checked the columns of all rows.
  void read_text_labels(Lines rows) {
    if (!label_) return;
    for (std::string_view line; labels_.of_points.size() < points_ && rows.next(line);)
      if (const Words words = words_of(line); !words.empty())
        labels_.of_points.push_back(label_of(number(words[label_->place.column], file_, rows.number())));
  }

  /// A whole number, 0 for anything else.
  static std::uint32_t label_of(double value) {
    return value >= 0.5 && value < 1e6 ? static_cast<std::uint32_t>(std::lround(value)) : 0;
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
  struct LabelColumn {
    Coordinate place;
    bool is_float;
  };
  std::optional<LabelColumn> label_;
  PcdLabels labels_;
  std::size_t step_ = 0, columns_ = 0, points_ = 0;
};

}  // namespace

Cloud read_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  return PcdReader(file, bytes).read();
}

LabelledPcd read_labelled_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  PcdReader reader(file, bytes);
  Cloud cloud = reader.read();
  return {std::move(cloud), reader.take_labels()};
}

}  // namespace octosurf::io
