// A map's octree as octomap::OcTree: made anew, read by OctoMap from a .bt, and kept up to date.
#include "bench/support.hpp"
#include "support/random_scans.hpp"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace {

using namespace octosurf;

using bench::time_ms;

double median(const std::vector<double>& values) { return bench::percentile(values, 0.5); }

/// The follower along the kitchen, at every scan and beside a reader that lets each tree go after ten.
int follow_kitchen(double resolution) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  Mapper mapper(parameters);
  OctomapFollower follower, read_follower;
  std::shared_ptr<const octomap::OcTree> reader;
  std::vector<double> scan_ms, follow_ms, read_ms, anew_ms, message_ms;
  std::size_t bytes = 0, leaves = 0, pruned_bytes = 0;
  bench::for_each_scan(bench::kitchen(), 1, 0, [&](const Scan& scan, double) {
    scan_ms.push_back(time_ms([&] { mapper.insert(scan); }));
    const OccupancyView now = mapper.map().octree();
    follow_ms.push_back(time_ms([&] { follower.follow(now); }));
    read_ms.push_back(time_ms([&] { read_follower.follow(now); }));
    if (read_ms.size() % 10 == 1) reader = read_follower.tree();
    std::unique_ptr<octomap::OcTree> anew;
    anew_ms.push_back(time_ms([&] { anew = to_octree(now); }));
    message_ms.push_back(time_ms([&] { bytes = octomap_message_data(*anew).size(); }));
    leaves = anew->getNumLeafNodes();
    pruned_bytes = now.octomap_data().size();
  });
  std::printf("%zu scans, %zu leaves; a message %zu bytes, of the pruned tree %zu\n", scan_ms.size(), leaves,
              bytes, pruned_bytes);
  const auto row = [](const char* name, const std::vector<double>& ms) {
    std::printf("%-22s p50 %7.2f  p95 %7.2f  max %7.2f ms\n", name, median(ms), bench::percentile(ms, 0.95),
                bench::percentile(ms, 1));
  };
  row("scan", scan_ms);
  row("follow", follow_ms);
  row("follow, slow reader", read_ms);
  row("the tree made anew", anew_ms);
  row("message", message_ms);
  return follower.tree()->size() == to_octree(mapper.map().octree())->size() ? 0 : 1;
}

}  // namespace

/// bench_octree [SCANS [RESOLUTION]]: a hall of 16 × 16 × 5 m from all its places.
/// bench_octree kitchen [RESOLUTION]: OctomapFollower along the kitchen.
int main(int count, char** arguments) {
  if (count > 1 && std::string(arguments[1]) == "kitchen")
    return follow_kitchen(count > 2 ? std::atof(arguments[2]) : 0.02);
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
    anew.push_back(time_ms([&] { made = to_octree(view); }));
    octomap::OcTree theirs(0.1);
    std::stringstream file(bt.str());
    read.push_back(time_ms([&] { theirs.readBinary(file); }));
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
    update.push_back(time_ms([&] { update_octree(*kept, before, now); }));
    now.for_each_change(before, [&](const OccupancyView::Change&) { ++cubes; });
    before = now;
  }
  std::printf(
      "anew %.1f ms, readBinary %.1f ms, updated after a scan %.2f ms (%zu cubes of 2^3 voxels a scan)\n",
      median(anew), median(read), median(update), cubes / 7);
  return kept->size() == to_octree(before)->size() ? 0 : 1;
}
