#include "io/map_file/map_file.hpp"

#include "io/map_lock.hpp"
#include "io/new_file.hpp"
#include "io/text_file.hpp"

#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {

std::optional<io::FileSum> io::sum_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  FileSum sum;
  std::array<char, 65536> buffer;
  while (in.read(buffer.data(), buffer.size()), in.gcount() > 0) {
    const std::string_view bytes(buffer.data(), static_cast<std::size_t>(in.gcount()));
    sum.crc32 = crc32_of(bytes, sum.crc32);
    sum.bytes += bytes.size();
  }
  if (in.bad()) return {};
  return sum;
}

namespace {

namespace fs = std::filesystem;

struct MapPaths {
  explicit MapPaths(const fs::path& stem)
      : surfaces(io::file_of_map(stem, ".surfaces")), bt(io::file_of_map(stem, ".bt")) {}
  fs::path surfaces, bt;
};

bool is_own(const fs::path& bt, const io::FileSum& expected) {
  std::error_code failure;
  return fs::file_size(bt, failure) == expected.bytes && !failure && io::sum_of(bt) == expected;
}

/// What to do with a .bt that is not the map's own.
std::string hint_of(const fs::path& bt, const MapPaths& files) {
  return "; octosurf map " + bt.string() + " --resume " + io::file_of_map(files.bt, "").string() +
         " takes over its occupancy";
}

/// Empty if the .bt is the one that was written with the map.
std::string warning_of(const MapPaths& files, const io::FileSum& expected) {
  std::error_code ignored;
  const std::string bt = files.bt.string();
  if (!fs::exists(files.bt, ignored)) return bt + ": is missing; saving the map writes it again";
  if (is_own(files.bt, expected)) return {};
  return bt + ": is not the one that was saved with the .surfaces, which alone is read" + hint_of(bt, files);
}

/// Keeps a .bt that was not written with a whole .surfaces beside it, such as one that another tool has made
/// or edited, as it may be somebody else's only copy: as NAME.edited.bt, NAME.edited-2.bt …, the first that
/// is free or the same, but no link to it. Returns a warning, empty if there is none.
std::string set_aside_foreign_octree(const MapPaths& files) {
  std::error_code failure;
  if (const std::uintmax_t bytes = fs::file_size(files.bt, failure); failure || bytes == 0) return {};
  if (const auto own = io::octree_sum_of(files.surfaces); own && is_own(files.bt, *own)) return {};
  const std::optional<io::FileSum> sum = io::sum_of(files.bt);
  fs::path kept = io::file_of_map(files.bt, ".edited.bt");
  for (int n = 2; fs::exists(fs::symlink_status(kept, failure)); ++n) {
    if (sum && !fs::is_symlink(kept, failure) && io::sum_of(kept) == sum) break;
    kept = io::file_of_map(files.bt, (".edited-" + std::to_string(n) + ".bt").c_str());
  }
  if (!fs::exists(kept, failure)) {
    fs::create_hard_link(files.bt, kept, failure);
    if (failure) fs::rename(files.bt, kept, failure);  // not every file system has hard links
    if (failure) io::fail_to_write(kept, "cannot be written", failure.value());
  }
  io::sync(kept);  // whoever wrote it may not have
  io::sync(kept.parent_path());
  return files.bt.string() + ": was not the map's own, and is kept as " + kept.string() +
         hint_of(kept, files);
}

/// `path` relative to `folder`; absolute if there is no relative path.
fs::path seen_from(const fs::path& folder, const fs::path& path) {
  std::error_code failure;
  const fs::path from = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder, failure), failure);
  const fs::path to = fs::weakly_canonical(fs::absolute(path, failure), failure);
  const fs::path relative = to.lexically_relative(from);
  return failure || relative.empty() ? fs::absolute(path, failure) : relative;
}

void require_map(const MapPaths& files) {
  std::error_code ignored;
  if (fs::is_regular_file(files.surfaces, ignored)) return;
  const std::string where = files.surfaces.string();
  if (fs::exists(files.surfaces, ignored))
    throw Error(Error::Kind::data, where, "is not a file", "give the path of a saved map");
  if (fs::exists(files.bt, ignored))
    throw Error(Error::Kind::data, where, "is missing, only the .bt is there",
                "octosurf map " + files.bt.string() + " -o … makes surfaces out of an OctoMap");
  throw Error(Error::Kind::data, where, "there is no such map",
              "give the path of a saved map, as in maps/office");
}

}  // namespace

std::string save_map(const Map& map, const fs::path& stem, const KeptScans& scans) {
  const MapPaths files(stem);
  KeptScans from_there = scans;
  if (!scans.folder.empty()) from_there.folder = seen_from(files.surfaces.parent_path(), scans.folder);
  const io::MapLock lock(stem);
  io::NewFile bt(files.bt, true), surfaces(files.surfaces, true);
  bt.write([&](std::ostream& out) { surfaces::state_of(map).occupancy.write_bt(out); });
  const std::optional<io::FileSum> sum = io::sum_of(bt.temporary());
  if (!sum) io::fail_to_write(files.bt, "cannot be read back", errno);
  surfaces.write([&](std::ostream& out) { io::write_map(surfaces::state_of(map), *sum, out, from_there); });
  // Both are complete on disk before either is renamed. If the process dies between the two, the old
  // .surfaces is intact and detects that the .bt is not its own.
  bt.sync();
  surfaces.sync();
  std::string warning = set_aside_foreign_octree(files);
  bt.commit();
  surfaces.commit();
  io::sync(files.surfaces.parent_path());
  return warning;
}

LoadedMap load_map(const fs::path& stem) {
  const MapPaths files(stem);
  require_map(files);
  std::error_code failure;
  const std::uintmax_t bytes = fs::file_size(files.surfaces, failure);
  std::ifstream in(files.surfaces, std::ios::binary);
  if (failure || !in)
    throw Error(Error::Kind::data, files.surfaces.string(), "cannot be read", "check its rights");
  io::MapFile file = io::read_map(in, bytes, files.surfaces.string());
  if (!file.scans.folder.empty()) file.scans.folder = files.surfaces.parent_path() / file.scans.folder;
  return {surfaces::map_of(std::move(file.state)), warning_of(files, file.bt), std::move(file.scans)};
}

}  // namespace octosurf
