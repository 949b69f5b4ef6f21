// Target for folders of IHMC's planar regions. An input is their files one after the other, divided by
// ASCII's file separator: header.txt, then region1_1, region1_2 and so on.
#include "fuzz/input_file.hpp"

#include <algorithm>

#include <octosurf/planner_formats.hpp>

namespace octosurf::fuzz {
namespace {

constexpr std::uint8_t file_separator = 0x1C;

void write_files(Bytes bytes, const InputFolder& folder) {
  int index = 0;
  while (true) {
    const auto end = std::find(bytes.begin(), bytes.end(), file_separator);
    folder.add(index == 0 ? "header.txt" : "region1_" + std::to_string(index), Bytes(bytes.begin(), end));
    if (end == bytes.end()) return;
    bytes = Bytes(end + 1, bytes.end());
    ++index;
  }
}

/// Rings of no area may turn round on their way.
void promise_same(const IhmcRegion& a, const IhmcRegion& b) {
  promise(a.id == b.id && a.hull.size() == b.hull.size(), "a region stays what it is");
  promise(a.T_world_region.translation() == b.T_world_region.translation() &&
              a.T_world_region.linear().isApprox(b.T_world_region.linear(), 1e-9),
          "a region stays where it is");
  promise(std::equal(a.polygons.begin(), a.polygons.end(), b.polygons.begin(), b.polygons.end(),
                     [](const Ring2& one, const Ring2& other) { return one.size() == other.size(); }),
          "a region keeps its polygons");
}

}  // namespace

void fuzz_ihmc(Bytes bytes) {
  const InputFolder folder;
  write_files(bytes, folder);
  const auto regions = accepted([&] { return read_ihmc(folder.path()); });
  if (!regions || regions->empty()) return;
  export_ihmc(*regions, folder.path() / "again");
  const std::vector<IhmcRegion> again = read_ihmc(folder.path() / "again");
  promise(again.size() == regions->size(), "every region can be written again");
  for (std::size_t i = 0; i < again.size(); ++i) promise_same((*regions)[i], again[i]);
}

}  // namespace octosurf::fuzz
