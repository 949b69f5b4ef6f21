#include "scan_keeper.hpp"

#include "output_files.hpp"

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr const char* keep_option = "--keep-scans ";

/// The folder of a map that has no scan yet.
KeptScans new_folder(const KeepingWish& wish, const Map& map) {
  if (map.size().scans > 0)
    throw Error(Error::Kind::usage, keep_option + wish.folder,
                "the map has " + std::to_string(map.size().scans) + " scans that were not kept",
                "map them anew with --keep-scans");
  if (map.size().nodes > 0)
    throw Error(Error::Kind::usage, keep_option + wish.folder,
                "the map begins with an octree, which has no scans", "leave it out");
  io::require_room_for_scans(wish.folder, wish.force);
  return {wish.folder};
}

}  // namespace

ScanKeeper::ScanKeeper(KeptScans kept) : kept_(std::move(kept)) {
  if (!kept_.folder.empty()) writer_ = std::make_unique<io::ScanWriter>(kept_.folder, kept_.poses.size());
}

template <class Work>
void ScanKeeper::keep(const Work& work) {
  if (!writer_) return;
  try {
    work();
  } catch (...) {
    std::fprintf(stderr, "warning: %s: misses a scan from now on, the map is saved without it\n",
                 kept_.folder.c_str());
    kept_ = {};
    writer_.reset();
    throw;
  }
}

void ScanKeeper::after(const InsertedScan& inserted) {
  keep([&] {
    Scan kept = inserted.scan;
    kept.T_map_sensor = inserted.report.alignment.T_map_sensor;
    kept_.poses.push_back(kept.T_map_sensor);
    writer_->add(std::move(kept));
  });
}

void ScanKeeper::save(Saving) {
  keep([&] { writer_->finish(); });
}

KeptScans choose_folder(const KeepingWish& wish, const Map& map, const KeptScans& before,
                        std::vector<std::string>& warnings) {
  if (before.folder.empty()) return wish.folder.empty() ? KeptScans{} : new_folder(wish, map);
  const std::string there = before.folder.string();
  if (!wish.folder.empty() && !same_file(wish.folder, there)) {
    io::require_room_for_scans(wish.folder, wish.force);
    io::copy_kept_scans(there, wish.folder, map.size().scans);
    return {wish.folder, false, before.poses};
  }
  if (!wish.in_place || before.shared) {
    if (!wish.folder.empty())
      throw Error(Error::Kind::usage, keep_option + wish.folder, "holds the scans of another map, too",
                  "name a new folder, which begins with its scans");
    warnings.push_back(there +
                       ": holds the scans up to here, not those that come now; --keep-scans NEW gives the " +
                       "map a folder of its own");
    return {};
  }
  std::error_code ignored;
  if (wish.folder.empty() && !fs::is_directory(before.folder, ignored)) {
    warnings.push_back(there + ": the map's scans are not there; resuming without them");
    return {};
  }
  return before;
}

}  // namespace octosurf
