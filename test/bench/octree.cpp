// A map's octree as octomap::OcTree: made anew, read by OctoMap from a .bt, and kept up to date.
#include "support/random_scans.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <sstream>
#include <vector>

#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace {

using namespace octosurf;

double milliseconds(const auto& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

}  // namespace

/// bench_octree [SCANS [RESOLUTION]]: a hall of 16 × 16 × 5 m from all its places.
int main(int count, char** arguments) {
  const int scans = count > 1 ? std::atoi(arguments[1]) : 150;
  Parameters parameters;
  parameters.occupancy.resolution = count > 2 ? std::atof(arguments[2]) : 0.05;
  parameters.alignment.enabled = false;
  parameters.occupancy.max_range = 20;
  Mapper mapper(parameters);
  std::mt19937_64 random(1);  // fixed: a benchmark measures one world
  for (int i = 0; i < scans; ++i) mapper.insert(test::room_scan(random, 30000, {8, 8, 2.5}));

  std::stringstream bt;
  to_octree(mapper.map().octree())->writeBinary(bt);
  std::vector<double> anew, read, update;
  for (int i = 0; i < 7; ++i) {
    const OccupancyView view = mapper.map().octree();
    std::unique_ptr<octomap::OcTree> made;
    anew.push_back(milliseconds([&] { made = to_octree(view); }));
    octomap::OcTree theirs(0.1);
    std::stringstream file(bt.str());
    read.push_back(milliseconds([&] { theirs.readBinary(file); }));
    if (i == 0)
      std::printf("leaves: %zu in the map, %zu as OctoMap reads its .bt\n", made->getNumLeafNodes(),
                  theirs.getNumLeafNodes());
  }
  OccupancyView before = mapper.map().octree();
  const std::unique_ptr<octomap::OcTree> kept = to_octree(before);
  std::size_t cubes = 0;
  for (int i = 0; i < 7; ++i) {
    mapper.insert(test::room_scan(random, 4000, {2, 2, 1.5}, {4.0 * (i % 3 - 1), 3, 0}));
    const OccupancyView now = mapper.map().octree();
    update.push_back(milliseconds([&] { update_octree(*kept, before, now); }));
    now.for_each_change(before, [&](const OccupancyView::Change&) { ++cubes; });
    before = now;
  }
  std::printf(
      "anew %.1f ms, readBinary %.1f ms, updated after a scan %.2f ms (%zu cubes of 2^3 voxels a scan)\n",
      median(anew), median(read), median(update), cubes / 7);
  return kept->size() == to_octree(before)->size() ? 0 : 1;
}
