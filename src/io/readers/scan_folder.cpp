#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* what_is_read =
    "a folder of scans holds depth images (PNG, PGM), clouds (PCD, PLY, velodyne .bin), a bag (.bag, .db3, "
    ".mcap) or a .graph";

struct Family {
  FileKind kind;
  std::vector<std::string> subfolders;
};
const std::vector<Family>& families() {
  static const std::vector<Family> instance{{FileKind::image, {"", "frames", "depth"}},
                                            {FileKind::pcd, {"", "scans", "clouds"}},
                                            {FileKind::velodyne, {"", "velodyne"}},
                                            {FileKind::graph, {""}},
                                            {FileKind::bag, {""}}};
  return instance;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Removes and returns the number at the front of `text`, without leading zeros.
std::string_view take_number(std::string_view& text) {
  const auto length =
      static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_digit) - text.begin());
  std::string_view digits = text.substr(0, length);
  text.remove_prefix(length);
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

std::vector<ListedScan> files_of(const fs::path& folder, FileKind family) {
  std::vector<ListedScan> scans;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (!entry->is_regular_file() || !whole_of_part(entry->path()).empty()) continue;
    const FileKind kind = kind_of(entry->path());
    if (same_family(kind, family)) scans.push_back({entry->path(), kind});
  }
  if (error) throw Error(Error::Kind::data, folder.string(), "cannot be read (" + error.message() + ")");
  std::sort(scans.begin(), scans.end(), [](const ListedScan& a, const ListedScan& b) {
    return natural_less(a.file.filename().string(), b.file.filename().string());
  });
  return scans;
}

/// Many data sets have colour pictures beside depth images: keeps those named depth, or else those not known
/// to be pictures.
void keep_depth_images(std::vector<ListedScan>& images, std::string& first_picture) {
  const auto called_depth = [](const ListedScan& scan) {
    return scan.file.filename().string().find("depth") != std::string::npos;
  };
  if (std::any_of(images.begin(), images.end(), called_depth)) {
    std::erase_if(images, [&](const ListedScan& scan) { return !called_depth(scan); });
    return;
  }
  std::erase_if(images, [&](const ListedScan& scan) {
    const bool picture = is_picture(scan.file);
    if (picture && first_picture.empty()) first_picture = scan.file.string();
    return picture;
  });
}

bool has_tum_index(const fs::path& folder) { return fs::is_regular_file(folder / "depth.txt"); }

ListedRecording list_tum(const fs::path& folder) {
  ListedRecording recording;
  recording.folder = folder;
  const fs::path index = folder / "depth.txt";
  for (const auto& line : read_text(index)) {
    if (line.words.size() != 2)
      throw Error(Error::Kind::data, at_line(index, line.number), "not 'time stamp, file name'");
    recording.scans.push_back({folder / line.words[1], FileKind::image});
    recording.scans.back().stamp_s = time_stamp(line.words[0], index, line.number);
  }
  if (recording.scans.empty()) throw Error(Error::Kind::data, index.string(), "lists no depth images");
  return recording;
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  std::string_view left = a, right = b;
  while (!left.empty() && !right.empty()) {
    if (is_digit(left[0]) && is_digit(right[0])) {
      const auto x = take_number(left), y = take_number(right);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else if (left[0] != right[0]) {
      return left[0] < right[0];
    } else {
      left.remove_prefix(1);
      right.remove_prefix(1);
    }
  }
  if (left.empty() != right.empty()) return left.empty();
  return a < b;  // equal except for leading zeros
}

bool same_family(FileKind a, FileKind b) {
  const auto family = [](FileKind kind) { return kind == FileKind::ply ? FileKind::pcd : kind; };
  return family(a) == family(b);
}

bool is_tum(const fs::path& folder) {
  const auto places = around(folder);
  return std::any_of(places.begin(), places.end(), has_tum_index);
}

std::vector<fs::path> around(const fs::path& folder) {
  fs::path whole = fs::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // a trailing slash
  std::vector<fs::path> folders{folder};
  for (const auto& family : families())
    for (const auto& name : family.subfolders)
      if (!name.empty() && whole.filename() == name) folders.push_back(whole.parent_path());
  return folders;
}

ListedRecording list_folder(const fs::path& folder) {
  if (has_tum_index(folder)) return list_tum(folder);
  ListedRecording found;
  if (is_bag(folder)) {  // of ROS 2
    found.folder = folder;
    for (const fs::path& file : files_of_bag(folder)) found.scans.push_back({file, FileKind::bag});
    return found;
  }
  std::string first_picture;
  for (const auto& family : families()) {
    for (const auto& subfolder : family.subfolders) {
      const fs::path place = subfolder.empty() ? folder : folder / subfolder;
      if (!fs::is_directory(place)) continue;
      auto scans = files_of(place, family.kind);
      if (family.kind == FileKind::image) keep_depth_images(scans, first_picture);
      if (scans.empty()) continue;
      if (!found.scans.empty() && found.folder == place)
        throw Error(Error::Kind::data, place.string(),
                    "holds depth images and clouds, or clouds of two kinds", "name the files that are meant");
      if (!found.scans.empty()) continue;
      found.folder = place;
      found.scans = std::move(scans);
    }
  }
  if (!found.scans.empty()) return found;
  if (!first_picture.empty())
    throw Error(Error::Kind::data, first_picture, "not a 16-bit depth image (8 bits or colour)",
                "depth images are 16-bit gray PNG or PGM");
  throw Error(Error::Kind::data, folder.string(), "holds no scans", what_is_read);
}

fs::path find_beside(const std::vector<fs::path>& folders, const std::vector<std::string>& names,
                     const char* option) {
  for (const auto& folder : folders) {
    std::vector<fs::path> found;
    for (const auto& name : names)
      if (fs::is_regular_file(folder / name)) found.push_back(folder / name);
    if (found.size() > 1)
      throw Error(Error::Kind::data, folder.string(),
                  "holds both " + found[0].filename().string() + " and " + found[1].filename().string(),
                  std::string("choose one with ") + option);
    if (!found.empty()) return found[0];
  }
  return {};
}

void fail_count(const fs::path& file, std::size_t scans, std::size_t others, const char* what,
                const char* or_else) {
  throw Error(Error::Kind::data, file.string(), count_of(others, what) + " for " + count_of(scans, "scan"),
              std::string("give one ") + what + " per scan, in the order of the scans" + or_else);
}

std::optional<double> stamp_in_name(const fs::path& file) {
  constexpr const char* digit = "0123456789";
  const std::string stem = file.stem().string();
  // The number at the end, after a word, or after another number and '_'.
  const std::size_t before = stem.find_last_not_of("0123456789.");
  std::string_view text = std::string_view(stem).substr(before == std::string::npos ? 0 : before + 1);
  const auto number_of = [](std::string_view word) -> std::optional<double> {
    double value = 0;
    const auto [stop, error] =
        std::from_chars(word.data(), word.data() + word.size(), value, std::chars_format::fixed);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(value)) return {};
    return value;
  };
  const auto value = number_of(text);
  if (!value) return {};
  // "000002_-7.5": before 1970, as of a simulated clock.
  const bool negative =
      before != std::string::npos && before > 0 && stem[before] == '-' && stem[before - 1] == '_';
  const std::size_t between = negative ? before - 1 : before;
  const bool only_numbers = before == std::string::npos ||
                            (stem[between] == '_' && between > 0 && stem.find_first_not_of(digit) == between);
  if (text.find('.') != std::string_view::npos) {
    constexpr double year_1973 = 1e8;  // after a word, smaller numbers are of other things
    if (only_numbers && negative) return -*value;
    if (only_numbers || *value >= year_1973) return value;
    return {};
  }
  // Whole seconds since 1970 and nanoseconds, as ROS has them.
  constexpr std::size_t seconds_digits = 10, ns_digits = 9;
  if (before != std::string::npos && text.size() <= ns_digits) {
    const std::string_view head = std::string_view(stem).substr(0, before);
    const std::size_t word = head.find_last_not_of(digit);
    const std::string_view seconds = head.substr(word == std::string_view::npos ? 0 : word + 1);
    if (seconds.size() == seconds_digits && seconds[0] != '0') return *number_of(seconds) + 1e-9 * *value;
  }
  // One number without a point is a time if it has as many digits as one since 1970 in s, ms, us or ns.
  if (text[0] == '0') return {};
  for (const auto& [more, per_s] : {std::pair(0U, 1.0), {3U, 1e3}, {6U, 1e6}, {9U, 1e9}})
    if (text.size() == seconds_digits + more) return *value / per_s;
  return {};
}

namespace {

void convert_stamps(std::vector<ListedScan>& scans) {
  std::vector<double> stamps;
  for (const ListedScan& scan : scans) stamps.push_back(*scan.stamp_s);
  to_seconds(stamps);
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].stamp_s = stamps[i];
}

}  // namespace

void find_stamps(ListedRecording& recording) {
  auto& scans = recording.scans;
  if (recording.bag) return;
  if (scans.front().stamp_s) return convert_stamps(scans);  // of depth.txt
  if (scans.front().kind == FileKind::graph) return;
  const fs::path times = find_beside(around(recording.folder), {"times.txt"}, "--rate");
  if (!times.empty()) {
    const auto lines = read_text(times);
    if (lines.size() != scans.size()) fail_count(times, scans.size(), lines.size(), "time stamp");
    for (std::size_t i = 0; i < scans.size(); ++i)
      scans[i].stamp_s = time_stamp(lines[i].words[0], times, lines[i].number);
    return convert_stamps(scans);
  }
  if (!std::all_of(scans.begin(), scans.end(), [](const auto& s) { return stamp_in_name(s.file); })) return;
  for (auto& scan : scans) scan.stamp_s = stamp_in_name(scan.file);
}

}  // namespace octosurf::io
