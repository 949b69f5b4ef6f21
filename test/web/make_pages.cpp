// make_pages FOLDER: the pages that page_test.mjs looks at, of maps that are known to the last edge.
#include "io/exporters/page_template.hpp"
#include "io/exporters/room_snapshot.hpp"
#include "support/painted_octree.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>

#include <octosurf/page.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;

/// Of the room of make_room(): a pending block of 10 × 10 × 10 voxels at (1, 0.5, 1), the floor's voxels
/// under it.
OccupancyView room_octree() {
  PaintedOctree octree(0.02);
  for (int y = 25; y < 35; ++y)
    for (int x = 50; x < 60; ++x) {
      octree.occupy(x, y, 0, 3.5F, 2);
      for (int z = 50; z < 60; ++z) octree.occupy(x, y, z, 0.85F, 0);
    }
  return octree.view();
}

PageMap room(const std::string& name) {
  Snapshot snapshot = make_room();
  std::vector<Stair> stairs = find_stairs(snapshot).stairs;
  return {name, std::make_shared<Snapshot>(std::move(snapshot)), room_octree(), std::move(stairs)};
}

PageMap turned(PageMap map, const Eigen::Quaterniond& rotation) {
  Snapshot snapshot = *map.snapshot;
  for (SurfacePtr& surface : snapshot.surfaces) {
    Surface copy = *surface;
    copy.plane.normal = rotation * copy.plane.normal;
    copy.T_map_surface = rotation * copy.T_map_surface;
    surface = std::make_shared<Surface>(copy);
  }
  snapshot.cylinders.clear();
  map.snapshot = std::make_shared<Snapshot>(std::move(snapshot));
  map.octree = {};
  map.stairs.clear();
  return map;
}

/// 200 × 200 voxels of a hilly ground, 20 surfaces of 200 vertices.
PageMap hills() {
  constexpr double d = 0.02;
  constexpr int side = 200;
  const auto height = [](double x, double y) { return 0.5 * std::sin(x) * std::cos(0.7 * y); };
  PaintedOctree octree(d);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      octree.occupy(x, y, static_cast<int>(std::floor(height(x * d, y * d) / d)),
                    0.85F + 0.002F * static_cast<float>((x * 7 + y * 13) % 1000), 0);
  SnapshotBuilder builder;
  for (int tile = 0; tile < 20; ++tile) {
    const double x = 0.4 + 0.8 * (tile % 5), y = 0.5 + 1.0 * (tile / 5);
    Ring2 ring;
    for (int k = 0; k < 200; ++k) {
      const double angle = 2 * std::numbers::pi * k / 200, radius = 0.3 + 0.05 * std::cos(9 * angle);
      ring.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    builder.add({x, y, height(x, y) + 0.3}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), {{ring, {}}},
                0.28);
  }
  const Snapshot snapshot = builder.take();
  return {"hills", std::make_shared<Snapshot>(snapshot), octree.view()};
}

void write_all(const fs::path& folder) {
  fs::create_directories(folder);
  const auto write = [&](const char* name, const PageMap& map, const PageOptions& options = {}) {
    std::ofstream(folder / name) << make_page(map, options);
  };
  write("room.html", room("room </script><script>window.injected = 1</script>"));
  write("hills.html", hills());
  PageOptions small;
  small.max_mb = 0.69;
  write("small.html", hills(), small);
  write("empty.html", {"nothing", std::make_shared<Snapshot>()});

  const auto rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY());
  write("lying.html", turned(room("lying"), rotation));
}

}  // namespace
}  // namespace octosurf::test

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::runtime_error("usage: make_pages FOLDER");
    if (octosurf::io::page_template().empty()) {
      std::puts("skipped: built without the page (npm ci in web/)");
      std::filesystem::remove_all(argv[1]);  // an earlier build's
      return 77;
    }
    octosurf::test::write_all(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_pages: %s\n", error.what());
    return 1;
  }
}
