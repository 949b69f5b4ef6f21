#include "scan_keeper.hpp"

#include "output_files.hpp"

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
ScanKeeper::ScanKeeper(KeptScans kept, bool there) : kept_(std::move(kept)) {
  if (!there && !kept_.folder.empty())
    writer_ = std::make_unique<io::ScanWriter>(kept_.folder, kept_.poses.size(), kept_.marks);
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

void ScanKeeper::add(Scan scan, const Eigen::Isometry3d& T_map_sensor) {
  if (!kept_.folder.empty()) kept_.poses.push_back(T_map_sensor);
  keep([&] {
    scan.T_map_sensor = T_map_sensor;
    RunContext().warn(writer_->add(scan));
  });
}

void ScanKeeper::save() {
  keep([&] {
    writer_->finish();
    kept_.marks = writer_->marks();
  });
}

KeptScans choose_folder(const std::string& wish, bool in_place, const Map& map, const KeptScans& before,
                        RunContext& context) {
  const Map::Size size = map.size();
  const std::string option = "--keep-scans " + wish, there = before.folder.string();
  const bool own = in_place && !before.shared;
  if (!wish.empty()) {
    if (before.folder.empty() && size.scans > 0)
      throw Error(Error::Kind::usage, option,
                  "the map has " + std::to_string(size.scans) + " scans that were not kept",
                  "map them anew with --keep-scans");
    if (size.scans == 0 && size.nodes > 0)
      throw Error(Error::Kind::usage, option, "the map begins with an octree, which has no scans",
                  "leave it out");
    if (!own && !there.empty() && same_file(wish, there))
      throw Error(Error::Kind::usage, option, "holds the scans of another map, too",
                  "name a copy of it, as cp -al makes it of links");
    if (size.scans == 0) io::require_room_for_scans(wish);
    return {wish, false, before.poses, before.marks};
  }
  if (there.empty()) return {};
  std::error_code ignored;
  if (own && std::filesystem::is_directory(there, ignored)) return before;
  context.warn(there + (own ? ": the map's scans are not there; resuming without them"
                            : ": holds the scans up to here, not those that come now; --keep-scans COPY "
                              "goes on in a copy of it"));
  return {};
}

}  // namespace octosurf
