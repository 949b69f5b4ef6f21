#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
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
    if (same_family(kind, family)) {
      scans.emplace_back();
      scans.back().file = entry->path();
      scans.back().kind = kind;
    }
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
    ListedScan scan;
    scan.stamp_s = time_stamp(line.words[0], index, line.number);
    scan.file = folder / line.words[1];
    scan.kind = FileKind::image;
    recording.scans.push_back(std::move(scan));
  }
  if (recording.scans.empty()) throw Error(Error::Kind::data, index.string(), "lists no depth images");
  return recording;
}

/// A ROS 2 bag.
ListedRecording list_bag(const fs::path& folder) {
  ListedRecording recording;
  recording.folder = folder;
  for (const fs::path& file : files_of_bag(folder)) {
    recording.scans.emplace_back();
    recording.scans.back().file = file;
    recording.scans.back().kind = FileKind::bag;
  }
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
  if (is_bag(folder)) return list_bag(folder);
  std::string first_picture;
  ListedRecording found;
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

}  // namespace octosurf::io
