#pragma once

#include "io/map_file/map_file.hpp"
#include "map_file.pb.h"

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::test {

/// A map file's bytes in a file, for readers that take a path; removed at the end.
class MapBytes {
 public:
  explicit MapBytes(std::string_view bytes = {});
  MapBytes(const MapBytes&) = delete;
  MapBytes& operator=(const MapBytes&) = delete;
  ~MapBytes();
  const std::filesystem::path& path() const { return path_; }
  std::string bytes() const;

 private:
  std::filesystem::path path_;
};

/// A new map file of a map. Same map, same bytes.
std::string map_file_of(const surfaces::MapState& state, const io::MapFiles& files = {});

/// The rows of a map file, Records with their keys, without that of the files; empty if it is none.
std::vector<std::string> records_of(std::string_view file);

/// A map file of the newest version with these rows, and with one of the files that is true of them, unless
/// it is spoiled; without padding it may be smaller than a reader allows.
std::string map_file_of(const std::vector<std::string>& records,
                        const std::function<void(map_file::Files&)>& spoil = {}, bool padded = true);

}  // namespace octosurf::test
