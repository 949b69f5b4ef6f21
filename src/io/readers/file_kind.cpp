#include "io/readers/file_kind.hpp"

#include "io/new_file.hpp"
#include "io/readers/scan_graph.hpp"

#include <array>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

namespace octosurf::io {
namespace {

constexpr std::array signatures{
    std::pair<std::string_view, FileKind>{"\x89PNG\r\n\x1a\n", FileKind::image},
    std::pair<std::string_view, FileKind>{"P5 ", FileKind::image},
    std::pair<std::string_view, FileKind>{"P5\n", FileKind::image},
    std::pair<std::string_view, FileKind>{"P5\r", FileKind::image},
    std::pair<std::string_view, FileKind>{"ply\n", FileKind::ply},
    std::pair<std::string_view, FileKind>{"ply\r", FileKind::ply},
    std::pair<std::string_view, FileKind>{"# .PCD", FileKind::pcd},
    std::pair<std::string_view, FileKind>{"VERSION ", FileKind::pcd},
    std::pair<std::string_view, FileKind>{"FIELDS ", FileKind::pcd},
    std::pair<std::string_view, FileKind>{"# Octomap OcTree", FileKind::occupancy_map},
    std::pair<std::string_view, FileKind>{"# OctoMap OcTree", FileKind::occupancy_map},
    std::pair<std::string_view, FileKind>{"#ROSBAG V", FileKind::bag},
    std::pair<std::string_view, FileKind>{"SQLite format 3", FileKind::bag},
    std::pair<std::string_view, FileKind>{"\x89MCAP0\r\n", FileKind::bag},
};

constexpr std::array endings{
    std::pair<std::string_view, FileKind>{".png", FileKind::image},
    std::pair<std::string_view, FileKind>{".pgm", FileKind::image},
    std::pair<std::string_view, FileKind>{".pcd", FileKind::pcd},
    std::pair<std::string_view, FileKind>{".ply", FileKind::ply},
    std::pair<std::string_view, FileKind>{".bin", FileKind::velodyne},
    std::pair<std::string_view, FileKind>{".graph", FileKind::graph},
    std::pair<std::string_view, FileKind>{".bag", FileKind::bag},
    std::pair<std::string_view, FileKind>{".db3", FileKind::bag},
    std::pair<std::string_view, FileKind>{".mcap", FileKind::bag},
    std::pair<std::string_view, FileKind>{".bt", FileKind::occupancy_map},
    std::pair<std::string_view, FileKind>{".ot", FileKind::occupancy_map},
};

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
