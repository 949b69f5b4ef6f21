// What a scan costs: OctoMap's own insertion, our occupancy stage, a whole Mapper::insert and the
// paper's pipeline, on the same frames in the same run, so that their ratios can be trusted.

#include "bench/support.hpp"
#include "occupancy/occupancy_map.hpp"
#include "reference/paper_pipeline.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <octomap/OcTree.h>
#include <sstream>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::string input;
  std::vector<double> resolutions{0.02};
  std::size_t every = 1, frames = 0, paper_every = 10;
  int threads = 1;
  std::string json;
};

constexpr double max_range = 4;

/// Milliseconds per frame of each contestant, in the order of the table.
struct Costs {
  std::vector<std::pair<std::string, std::vector<double>>> rows;

  std::vector<double>& of(const std::string& name) {
    for (auto& row : rows)
      if (row.first == name) return row.second;
    return rows.emplace_back(name, std::vector<double>{}).second;
  }
};

octomap::Pointcloud octomap_cloud(const Scan& scan) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) continue;
    const Eigen::Vector3f in_map = (scan.T_map_sensor * point.cast<double>()).cast<float>();
    cloud.push_back(in_map.x(), in_map.y(), in_map.z());
  }
  return cloud;
}

std::size_t known_voxels(const octomap::OcTree& tree) {
  std::size_t voxels = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    voxels += std::size_t{1} << (3 * (tree.getTreeDepth() - leaf.getDepth()));
  return voxels;
}

/// Voxels in which the two differ: every voxel OctoMap knows is looked up in ours, and both must
/// know equally many.
std::size_t differing_voxels(const octomap::OcTree& theirs, const OccupancyMap& ours) {
  std::size_t differing = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const octomap::OcTreeKey first = leaf.getIndexKey();
    const unsigned edge = 1u << (theirs.getTreeDepth() - leaf.getDepth());
    for (unsigned i = 0; i < edge * edge * edge; ++i) {
      const auto along = [&](unsigned axis, unsigned step) {
        return static_cast<std::uint16_t>(first[axis] + step);
      };
      const VoxelKey key{along(0, i % edge), along(1, i / edge % edge), along(2, i / edge / edge)};
      const OccupancyMap::Lookup found = ours.at(key);
      if (found.state == OccupancyMap::State::unknown || found.log_odds != leaf->getLogOdds()) ++differing;
    }
  }
  std::stringstream written;
  ours.write_bt(written);
  octomap::OcTree read_back(theirs.getResolution());
  if (!read_back.readBinary(written)) throw Error(Error::Kind::data, "write_bt", "OctoMap does not read it");
  const std::size_t our_known = known_voxels(read_back), their_known = known_voxels(theirs);
  return differing + (our_known > their_known ? our_known - their_known : their_known - our_known);
}

struct Result {
  Costs costs;
  std::size_t frames = 0;
  std::size_t differing = 0;
  std::size_t surfaces = 0;
};

Result run(const Options& options, double resolution) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  parameters.occupancy.max_range = max_range;
  Parameters paper = reference::paper_parameters(resolution);
  Parameters paper_small = reference::paper_parameters_small_radius(resolution);
  paper.occupancy.max_range = paper_small.occupancy.max_range = max_range;

  octomap::OcTree theirs(resolution);
  OccupancyMap occupancy(parameters.occupancy);
  Downsampler downsampler(occupancy.grid());
  Mapper mapper(parameters, options.threads);
  reference::PaperPipeline paper_pipeline(paper), paper_pipeline_small(paper_small);

  Result result;
  Costs& costs = result.costs;
  const std::filesystem::path input =
      options.input.empty() ? kitchen() : std::filesystem::path(options.input);
  for_each_scan(input, options.every, options.frames, [&](const Scan& scan, double read_ms) {
    costs.of("read and decode").push_back(read_ms);
    const octomap::Pointcloud cloud = octomap_cloud(scan);
    const Eigen::Vector3f eye = scan.T_map_sensor.translation().cast<float>();
    const octomap::point3d origin(eye.x(), eye.y(), eye.z());
    costs.of("octomap insertPointCloud").push_back(time_ms([&] {
      theirs.insertPointCloud(cloud, origin, max_range, false, true);
    }));
    costs.of("our occupancy stage").push_back(time_ms([&] {
      occupancy.insert(downsampler(scan, 0, max_range), downsampler, nullptr);
    }));
    ScanReport report;
    costs.of("Mapper::insert").push_back(time_ms([&] { report = mapper.insert(scan); }));
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
      costs.of("  " + std::string(stage_names[stage])).push_back(report.stage_ms[stage]);
    if (options.paper_every > 0 && result.frames % options.paper_every == 0) {
      costs.of("paper, r = 0.06").push_back(time_ms([&] { paper_pipeline_small.insert(scan); }));
      costs.of("paper, r = 0.15").push_back(time_ms([&] { paper_pipeline.insert(scan); }));
    }
    ++result.frames;
  });
  result.differing = differing_voxels(theirs, occupancy);
  result.surfaces = mapper.snapshot()->surfaces.size();
  return result;
}

nlohmann::json report_on(Result& result, double resolution, std::size_t paper_every) {
  const double octomap_median = percentile(result.costs.of("octomap insertPointCloud"), 0.5);
  const double octomap_mean =
      sum(result.costs.of("octomap insertPointCloud")) / static_cast<double>(result.frames);
  TextTable table(
      {"ms per frame", "frames", "median", "p95", "max", "total s", "median / octomap", "mean / octomap"});
  nlohmann::json rows = nlohmann::json::object();
  for (const auto& [name, ms] : result.costs.rows) {
    const double median = percentile(ms, 0.5), mean = sum(ms) / static_cast<double>(ms.size());
    table.add({name, std::to_string(ms.size()), fixed(median, 2), fixed(percentile(ms, 0.95), 2),
               fixed(percentile(ms, 1), 2), fixed(sum(ms) / 1000, 2), fixed(median / octomap_median, 3),
               fixed(mean / octomap_mean, 3)});
    rows[name.substr(name.find_first_not_of(' '))] = {{"frames", ms.size()},
                                                      {"median_ms", median},
                                                      {"p95_ms", percentile(ms, 0.95)},
                                                      {"max_ms", percentile(ms, 1)},
                                                      {"total_ms", sum(ms)},
                                                      {"median_over_octomap", median / octomap_median},
                                                      {"mean_over_octomap", mean / octomap_mean}};
  }
  std::printf("d = %g m, %zu frames, %zu surfaces\n%s", resolution, result.frames, result.surfaces,
              table.text().c_str());
  if (paper_every > 1)
    std::printf("The paper's pipeline saw every %zuth of these frames only.\n", paper_every);
  std::printf("Trees of OctoMap and of our occupancy stage: %s (%zu voxels differ).\n\n",
              result.differing == 0 ? "equal" : "NOT EQUAL", result.differing);
  return {{"resolution", resolution},    {"frames", result.frames},
          {"surfaces", result.surfaces}, {"differing_voxels", result.differing},
          {"paper_every", paper_every},  {"rows", rows}};
}

void body(const Options& options) {
  nlohmann::json all = nlohmann::json::array();
  for (const double resolution : options.resolutions) {
    Result result = run(options, resolution);
    if (result.frames == 0) throw Error(Error::Kind::data, options.input, "has no scans");
    all.push_back(report_on(result, resolution, options.paper_every));
  }
  if (!options.json.empty()) write_json_file(options.json, all.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"ms per frame of OctoMap, octosurf and the paper's pipeline on the same frames"};
  app.add_option("--input", options.input, "recording (default: the kitchen of ../shared/data)");
  app.add_option("--resolution", options.resolutions, "voxel edges, m")
      ->capture_default_str()
      ->delimiter(',');
  app.add_option("--every", options.every, "use every k-th frame")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--frames", options.frames, "use at most so many (0: all)")->capture_default_str();
  app.add_option("--paper-every", options.paper_every,
                 "every k-th of them for the paper's pipeline (0: none)")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "of Mapper")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
