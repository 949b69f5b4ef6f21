#include "io/readers/file_kind.hpp"

#include "io/new_file.hpp"
#include "io/readers/scan_graph.hpp"

#include <fstream>
#include <string>
#include <string_view>
#include <utility>

namespace octosurf::io {
namespace {

using enum FileKind;
using Marks = std::pair<std::string_view, FileKind>;

constexpr Marks signatures[]{{"\x89PNG\r\n\x1a\n", image},
                             {"P5 ", image},
                             {"P5\n", image},
                             {"P5\r", image},
                             {"ply\n", ply},
                             {"ply\r", ply},
                             {"# .PCD", pcd},
                             {"VERSION ", pcd},
                             {"FIELDS ", pcd},
                             {"# Octomap OcTree", occupancy_map},
                             {"# OctoMap OcTree", occupancy_map},
                             {"#ROSBAG V", bag},
                             {"SQLite format 3", bag},
                             {"\x89MCAP0\r\n", bag}};

constexpr Marks endings[]{{".png", image},    {".pgm", image},        {".pcd", pcd},         {".ply", ply},
                          {".bin", velodyne}, {".graph", graph},      {".bag", bag},         {".db3", bag},
                          {".mcap", bag},     {".bt", occupancy_map}, {".ot", occupancy_map}};

}  // namespace

FileKind kind_of(const std::filesystem::path& file) noexcept try {
  std::string head(32, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  for (const auto& [signature, kind] : signatures)
    if (head.starts_with(signature)) return kind;
  for (const auto& [ending, kind] : endings)
    if (ending_of(file) == ending) return kind;
  return ScanGraphFile::matches(file) ? FileKind::graph : FileKind::unknown;
} catch (const std::exception&) {
  return FileKind::unknown;
}

}  // namespace octosurf::io
