#include "scan_keeper.hpp"

#include "output_files.hpp"
#include "surfaces/map_state.hpp"

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr const char* keep_option = "--keep-scans ";

/// The first archive of a map that has no scan yet.
KeptScans new_archive(const KeepingWish& wish, const Map& map) {
  if (map.size().scans > 0)
    throw Error(Error::Kind::usage, keep_option + wish.folder,
                "the map has " + std::to_string(map.size().scans) + " scans that no archive holds",
                "map them anew with --keep-scans");
  if (map.size().nodes > 0)
    throw Error(Error::Kind::usage, keep_option + wish.folder,
                "the map begins with an octree, which has no scans", "leave it out");
  io::require_room_for_archive(wish.folder, wish.force);
  return {wish.folder};
}

}  // namespace

ScanKeeper::ScanKeeper(KeptScans kept, Mapper& mapper) : kept_(std::move(kept)), mapper_(mapper) {
  if (kept_.folder.empty()) return;
  archive_ = std::make_unique<io::ScanArchiveWriter>(kept_.folder, mapper.map().size().scans);
  noise_ = mapper.map().state().noise.histogram();
  mapper.round_scans();
}

template <class Work>
void ScanKeeper::keep(const Work& work) {
  if (!archive_) return;
  try {
    work(*archive_);
  } catch (...) {
    std::fprintf(stderr, "warning: %s: misses a scan from now on, the map is saved without it\n",
                 kept_.folder.c_str());
    kept_ = {};
    archive_.reset();
    throw;
  }
}

void ScanKeeper::add(const Scan& scan, const ScanReport& report) {
  keep([&](io::ScanArchiveWriter& archive) {
    const surfaces::MapState& state = mapper_.map().state();
    io::ArchivedHeader header;
    header.name = scan.name;
    header.stamp_s = scan.stamp_s;
    header.sensor = scan.sensor;
    header.resolution = state.parameters.occupancy.resolution;
    header.T_given = scan.T_map_sensor;
    header.T_used = report.alignment.T_map_sensor;
    header.noise = state.noise.seen_since(noise_);
    noise_ = state.noise.histogram();
    header.shared_variances = mapper_.last_shared_variances();
    archive.add(std::move(header), mapper_.last_voxels());
  });
}

void ScanKeeper::finish() {
  keep([](io::ScanArchiveWriter& archive) { archive.finish(); });
}

KeptScans choose_archive(const KeepingWish& wish, const Map& map, const KeptScans& before,
                         std::vector<std::string>& warnings) {
  if (before.folder.empty()) return wish.folder.empty() ? KeptScans{} : new_archive(wish, map);
  const std::string there = before.folder.string();
  if (!wish.folder.empty() && !same_file(wish.folder, there)) {
    io::require_room_for_archive(wish.folder, wish.force);
    io::copy_archive(there, wish.folder, map.size().scans);
    return {wish.folder, false, before.poses};
  }
  if (!wish.in_place || before.shared) {
    if (!wish.folder.empty())
      throw Error(Error::Kind::usage, keep_option + wish.folder, "is the archive of another map, too",
                  "name a new folder, which begins with its scans");
    warnings.push_back(there +
                       ": holds the scans up to here, not those that come now; --keep-scans NEW gives the " +
                       "map an archive of its own");
    return {};
  }
  std::error_code ignored;
  if (wish.folder.empty() && !fs::is_directory(before.folder, ignored)) {
    warnings.push_back(there + ": the archive of the map's scans is not there, the map goes on without");
    return {};
  }
  return before;
}

}  // namespace octosurf
