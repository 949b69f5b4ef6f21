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

/// Where a .bt that is not the map's own is kept: NAME.edited.bt, NAME.edited-2.bt …, whichever is free or
/// the same.
fs::path place_aside(const MapPaths& files) {
  const std::optional<io::FileSum> sum = io::sum_of(files.bt);
  std::error_code ignored;
  fs::path kept = io::file_of_map(files.bt, ".edited.bt");
  for (int n = 2; fs::exists(kept, ignored) && io::sum_of(kept) != sum; ++n)
    kept = io::file_of_map(files.bt, (".edited-" + std::to_string(n) + ".bt").c_str());
  return kept;
}

/// Empty if the .bt is the one that was written with the map.
std::string warning_of(const MapPaths& files, const io::FileSum& expected) {
  std::error_code ignored;
  if (!fs::exists(files.bt, ignored))
    return files.bt.string() + ": is missing; saving the map writes it again";
  if (is_own(files.bt, expected)) return {};
  const std::string kept = place_aside(files).string();
  return files.bt.string() +
         ": is not the one that was saved with the .surfaces, which alone is read; when the map is saved "
         "there "
         "it is kept as " +
         kept + ", and octosurf map " + kept + " --resume " + io::file_of_map(files.bt, "").string() +
         " takes over its occupancy";
}

/// Keeps a .bt that is not the map's own, such as one that another tool has edited.
void set_aside_foreign_octree(const MapPaths& files) {
  std::error_code failure;
  if (!fs::is_regular_file(files.bt, failure)) return;
  const std::optional<io::FileSum> own = io::octree_sum_of(files.surfaces);
  if (!own || is_own(files.bt, *own)) return;
  const fs::path kept = place_aside(files);
  if (!fs::exists(kept, failure)) fs::copy_file(files.bt, kept, failure);
  if (failure)
    throw Error(Error::Kind::output, kept.string(), "cannot be written: " + failure.message(),
                "move " + files.bt.string() + ", which is not the map's own, elsewhere");
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

void save_map(const Map& map, const fs::path& stem, const KeptScans& scans) {
  if (stem.filename().empty())
    throw Error(Error::Kind::usage, stem.string(), "names no map", "give its path, as in maps/office");
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
  set_aside_foreign_octree(files);
  bt.commit();
  surfaces.commit();
  io::sync_folder(files.surfaces);
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
