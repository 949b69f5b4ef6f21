#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <regex>
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
const std::vector<Family> families{{FileKind::image, {"", "frames", "depth"}},
                                   {FileKind::pcd, {"", "scans", "clouds"}},
                                   {FileKind::velodyne, {"", "velodyne"}},
                                   {FileKind::graph, {""}},
                                   {FileKind::bag, {""}}};

std::vector<ListedScan> files_of(const fs::path& folder, FileKind family) {
  std::vector<ListedScan> scans;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const bool lost = entry->is_symlink() && !entry->exists();  // listed: its turn comes among the poses
    if (!(entry->is_regular_file() || lost) || is_hidden(entry->path()) || is_part(entry->path())) continue;
    const FileKind kind = kind_of(entry->path());
    if (same_family(kind, family)) scans.push_back({entry->path(), kind});
  }
  if (error) throw Error(Error::Kind::data, folder.string(), "cannot be read (" + error.message() + ")");
  std::ranges::sort(scans, natural_less,
                    [](const ListedScan& scan) { return scan.file.filename().string(); });
  return scans;
}

/// Many data sets have colour pictures beside depth images: keeps those named depth, or else those not known
/// to be pictures.
void keep_depth_images(std::vector<ListedScan>& images, std::string& first_picture) {
  const auto called_depth = [](const ListedScan& scan) {
    return scan.file.filename().string().find("depth") != std::string::npos;
  };
  if (std::ranges::any_of(images, called_depth)) {
    std::erase_if(images, [&](const ListedScan& scan) { return !called_depth(scan); });
    return;
  }
  std::erase_if(images, [&](const ListedScan& scan) {
    const bool picture = is_picture(scan.file);
    if (picture && first_picture.empty()) first_picture = scan.file.string();
    return picture;
  });
}

/// " but folders: a, b, …; name one of them"; empty: none.
std::string folders_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_directory() && !is_hidden(entry->path()))
      names.push_back(entry->path().filename().string());
  if (names.empty()) return {};
  std::ranges::sort(names, natural_less);
  constexpr std::size_t named = 3;
  std::string list;
  for (std::size_t i = 0; i < std::min(named, names.size()); ++i) list += (i == 0 ? "" : ", ") + names[i];
  return " but " + count_of(names.size(), "folder") + ": " + list + (names.size() > named ? ", …" : "") +
         "; name one of them";
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

/// Seconds and nanoseconds with a point between, and these without leading zeros: .4 would be 4 ns. A decimal
/// fraction begins with 0 now and then.
void refuse_unpadded(const ListedRecording& recording) {
  constexpr std::size_t whole = 9;  // digits of nanoseconds
  const ListedScan *longest = nullptr, *shorter = nullptr;
  for (const ListedScan& scan : recording.scans) {
    const std::string stem = scan.file.stem().string();
    const std::size_t point = stem.rfind('.');
    if (point == std::string::npos || stem.find('_') != std::string::npos) return;
    const std::string digits = stem.substr(point + 1);
    if (digits.size() > 1 && digits[0] == '0') return;
    (digits.size() == whole ? longest : shorter) = &scan;
  }
  if (longest != nullptr && shorter != nullptr)
    throw Error(Error::Kind::data, recording.folder.string(),
                "called by nanoseconds without their leading zeros, such as " +
                    shorter->file.filename().string() + " beside " + longest->file.filename().string(),
                "write nine digits behind the point, or give times.txt");
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) { return strverscmp(a.c_str(), b.c_str()) < 0; }

bool same_family(FileKind a, FileKind b) {
  const auto family = [](FileKind kind) { return kind == FileKind::ply ? FileKind::pcd : kind; };
  return family(a) == family(b);
}

bool is_tum(const fs::path& folder) {
  const auto places = around(folder);
  return std::ranges::any_of(places, has_tum_index);
}

std::vector<fs::path> around(const fs::path& folder) {
  fs::path whole = fs::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // a trailing slash
  std::vector<fs::path> folders{folder};
  for (const auto& family : families)
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
  for (const auto& family : families) {
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
  throw Error(Error::Kind::data, folder.string(), "holds no scans" + folders_in(folder), what_is_read);
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
  std::string stem = file.stem().string();
  // Of ten digits of seconds and nine of nanoseconds.
  if (static const std::regex both("(^|.*[^0-9])[1-9][0-9]{9}_[0-9]{9}"); std::regex_match(stem, both))
    stem[stem.size() - 10] = '.';
  // The number at the end, after a word, or after another number and '_'; "000002_-7.5" is before 1970.
  std::size_t begin = stem.find_last_not_of("0123456789.") + 1;  // npos + 1 is 0
  const std::size_t digits = begin;
  if (begin > 1 && stem[begin - 1] == '-' && stem[begin - 2] == '_') --begin;
  const std::string_view text = std::string_view(stem).substr(begin);
  double value = 0;
  const auto [stop, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc() || stop != text.data() + text.size() || !std::isfinite(value)) return {};
  if (text.find('.') != std::string_view::npos) {
    const bool only_numbers =
        begin == 0 || (stem[begin - 1] == '_' && stem.find_first_not_of("0123456789") == begin - 1);
    constexpr double year_1973 = 1e8;  // after a word, smaller numbers are of other things
    return only_numbers || value >= year_1973 ? std::optional(value) : std::nullopt;
  }
  // Without a point, a time since 1970 has 10 digits in s, 13 in ms, 16 in us, 19 in ns. A counter of as many
  // is padded with zeros: no time since 2001, from when on seconds have ten.
  constexpr double year_2001 = 1e9, year_2100 = 4102444800;
  for (const auto& [size, unit] : {std::pair(10U, 1e0), {13U, 1e3}, {16U, 1e6}, {19U, 1e9}})
    if (digits == begin && text.size() == size && value >= unit * year_2001 && value < unit * year_2100)
      return value / unit;
  return {};
}

void find_stamps(ListedRecording& recording) {
  auto& scans = recording.scans;
  if (recording.bag) return;
  if (scans.front().stamp_s) return void(convert_stamps(scans));  // of depth.txt
  if (scans.front().kind == FileKind::graph) return;
  const fs::path times = find_beside(around(recording.folder), {"times.txt"}, "");
  if (!times.empty()) {
    const auto lines = read_text(times);
    if (lines.size() != scans.size()) fail_count(times, scans.size(), lines.size(), "time stamp");
    for (std::size_t i = 0; i < scans.size(); ++i)
      scans[i].stamp_s = time_stamp(lines[i].words[0], times, lines[i].number);
    return void(convert_stamps(scans));
  }
  if (!std::ranges::all_of(scans, [](const auto& s) { return stamp_in_name(s.file).has_value(); })) return;
  refuse_unpadded(recording);
  for (auto& scan : scans) scan.stamp_s = stamp_in_name(scan.file);
}

}  // namespace octosurf::io
