#include "io/map_file/map_file.hpp"

#include "alignment/alignment_state.hpp"
#include "io/map_lock.hpp"
#include "io/new_file.hpp"
#include "io/text_file.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

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

bool is_own(const fs::path& bt, const io::MapFiles& files) {
  return std::ranges::any_of(files.bt, [&](const io::FileSum& sum) { return is_own(bt, sum); });
}

/// Empty if the .bt is the one that was written with the map.
std::string warning_of(const MapPaths& files, const io::MapFiles& expected, std::uint64_t revision) {
  std::error_code ignored;
  const std::string bt = files.bt.string();
  if (!fs::exists(files.bt, ignored)) return bt + ": is missing; saving the map writes it again";
  if (!is_own(files.bt, expected))
    return bt + ": is not the one that was saved with the .surfaces, which alone is read" +
           hint_of(bt, files);
  if (expected.bt_revision != revision || !is_own(files.bt, expected.bt.front()))
    return bt + ": is older than the .surfaces, which alone is read; saving the map writes it again";
  return {};
}

/// Keeps a .bt that was not written with a whole .surfaces beside it, such as one that another tool has made
/// or edited, as it may be somebody else's only copy: as NAME.edited.bt, NAME.edited-2.bt …, the first that
/// is free or the same, but no link to it. Returns a warning, empty if there is none.
std::string set_aside_foreign_octree(const MapPaths& files, const io::MapFiles& own) {
  std::error_code failure;
  if (const std::uintmax_t bytes = fs::file_size(files.bt, failure); failure || bytes == 0) return {};
  if (is_own(files.bt, own)) return {};
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

fs::path resolved(const fs::path& file) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(file, ignored), ignored);
}

/// `path` relative to `folder`; absolute if there is no relative path.
fs::path seen_from(const fs::path& folder, const fs::path& path) {
  const fs::path relative = resolved(path).lexically_relative(resolved(folder.empty() ? "." : folder));
  return relative.empty() ? resolved(path) : relative;
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

struct io::MapSave::State {
  State(const Map& saved_map, const fs::path& stem, const KeptScans& scans, bool bt)
      : files(stem), with_bt(bt), path(resolved(files.surfaces)) {
    const surfaces::MapState& map = surfaces::state_of(saved_map);
    saved_of(map);
    saved = std::static_pointer_cast<SavedMap>(map.saved);
    saved->turn.acquire();
    turn.reset(&saved->turn);
    kept = files_of(files.surfaces);
    in_place = kept.sum != 0 && saved->file == path && kept.sum == saved->rows.files_sum();
    for (const auto block : alignment::record_of(map).patches.take_changed_blocks())
      saved->changed_blocks.insert(static_cast<std::int64_t>(block));
    head.emplace(map, saved_map.octree(), in_place ? saved.get() : nullptr);
    next = kept;
    next.scans = scans;
    if (!scans.folder.empty()) next.scans.folder = seen_from(files.surfaces.parent_path(), scans.folder);
  }

  std::string run() {
    const MapLock lock(files.surfaces);
    NewFile bt(files.bt, true), surfaces(files.surfaces, true);
    if (with_bt) {
      bt.write([&](std::ostream& out) { occupancy::write_bt(head->octree(), out); });
      const std::optional<FileSum> sum = sum_of(bt.temporary());
      if (!sum) fail_to_write(files.bt, "cannot be read back", errno);
      next.bt.insert(next.bt.begin(), *sum);
      next.bt.erase(std::unique(next.bt.begin(), next.bt.end()), next.bt.end());
      if (next.bt.size() > 2) next.bt.resize(2);
      next.bt_revision = head->revision();
      bt.sync();
    }
    RowSums rows = in_place ? change() : write_anew(surfaces);
    saved->rows = std::move(rows);
    saved->file = path;
    saved->history = head->octree().tree()->history();
    saved->shares = head->octree().tree()->shares();
    saved->changed_blocks.clear();
    std::string warning;
    if (with_bt) {
      warning = set_aside_foreign_octree(files, kept);
      bt.commit();
    }
    sync(files.surfaces.parent_path());
    return warning;
  }

  /// In one transaction: until it is complete, SQLite's journal takes back what is written.
  RowSums change() {
    const Database base(files.surfaces, Database::Access::write);
    base.run("BEGIN IMMEDIATE");
    Database::Statement sum(base, "SELECT sum FROM state WHERE key = " + std::to_string(files_key));
    if (!sum.step() || static_cast<std::uint64_t>(sum.integer(0)) != kept.sum)
      throw Error(Error::Kind::output, files.surfaces.string(), "was written by another meanwhile",
                  "save it again");
    return write(base, saved->rows);
  }

  RowSums write_anew(NewFile& surfaces) {
    surfaces.create();
    RowSums rows;
    {
      const Database base(surfaces.temporary(), Database::Access::fill);
      base.run("BEGIN");
      make_tables(base);
      rows = write(base, {});
    }
    surfaces.sync();
    // One of the file that was here before must not be taken for this one's.
    std::error_code ignored;
    fs::remove(files.surfaces.string() + "-journal", ignored);
    surfaces.commit();
    return rows;
  }

  RowSums write(const Database& base, RowSums before) {
    RowWriter rows(&base, std::move(before), head->revision());
    head->write(rows, next);
    rows.pad(map_memory.least_file(head->memory(next.scans)));
    base.run("COMMIT");
    return std::move(rows.sums());
  }

  const MapPaths files;
  const bool with_bt;
  const fs::path path;
  std::shared_ptr<SavedMap> saved;
  struct Release {
    void operator()(std::binary_semaphore* turn) const { turn->release(); }
  };
  std::unique_ptr<std::binary_semaphore, Release> turn;
  bool in_place = false;
  MapFiles kept, next;  // in the file of before, and in this one
  std::optional<MapHead> head;
};

io::MapSave::MapSave(const Map& map, const fs::path& stem, const KeptScans& scans, bool with_bt) {
  const MapLock lock(stem);
  state_ = std::make_unique<State>(map, stem, scans, with_bt);
}
io::MapSave::~MapSave() = default;
std::string io::MapSave::operator()() { return std::exchange(state_, nullptr)->run(); }

std::string save_map(const Map& map, const fs::path& stem, const KeptScans& scans) {
  return io::MapSave(map, stem, scans, true)();
}

std::string digest_of(const Map& map) {
  const surfaces::MapState& state = surfaces::state_of(map);
  io::RowWriter rows(nullptr, {}, 0);
  io::MapHead(state, state.occupancy.now(), nullptr).write(rows, {});
  return io::formatted("%016llx", static_cast<unsigned long long>(rows.sums().total().digest));
}

LoadedMap load_map(const fs::path& stem) {
  const MapPaths files(stem);
  require_map(files);
  io::MapFile file = io::read_map(files.surfaces);
  KeptScans& scans = file.files.scans;
  if (!scans.folder.empty()) scans.folder = files.surfaces.parent_path() / scans.folder;
  const std::uint64_t revision = file.state->revision;
  LoadedMap loaded{surfaces::map_of(std::move(file.state)), warning_of(files, file.files, revision),
                   std::move(scans)};
  io::SavedMap& saved = io::saved_of(surfaces::state_of(std::as_const(loaded.map)));
  const OccupancyView octree = loaded.map.octree();
  saved.file = resolved(files.surfaces);
  saved.history = octree.tree()->history();
  saved.shares = octree.tree()->shares();
  return loaded;
}

}  // namespace octosurf
