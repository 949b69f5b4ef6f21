// Targets for files of scans and what stands beside them.
#include "fuzz/input_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/depth_image.hpp"
#include "io/readers/pose_file.hpp"
#include "io/readers/scan_graph.hpp"
#include "parameter_options.hpp"

#include <cmath>

#include <octosurf/scan_source.hpp>

namespace octosurf::fuzz {
namespace {

/// A folder of one scan goes its whole way through the public interface.
void read_as_scans(const std::filesystem::path& file) {
  accepted([&] {
    is_occupancy_map(file);
    const auto scans = open_scans({file}, {});
    while (const std::optional<Scan> scan = scans->next()) require_rigid(scan->T_map_sensor, scan->name);
    return true;
  });
}

}  // namespace

void fuzz_graph(Bytes bytes) {
  const InputFile file(bytes, ".graph");
  accepted([&] {
    const io::ScanGraphFile graph(file.path());
    for (std::size_t i = 0; i < graph.size(); ++i) graph.read(i);
    return true;
  });
  promise(io::ScanGraphFile::matches(file.path()) ==
              accepted([&] { return io::ScanGraphFile(file.path()).size(); }).has_value(),
          "matches() says what the constructor does");
  read_as_scans(file.path());
}

void fuzz_pcd(Bytes bytes) {
  const InputFile file(bytes, ".pcd");
  if (const auto cloud = accepted([&] { return io::read_pcd(file.path()); }))
    promise(!cloud->points.empty(), "a cloud has points");
  read_as_scans(file.path());
}

void fuzz_ply(Bytes bytes) {
  const InputFile file(bytes, ".ply");
  if (const auto cloud = accepted([&] { return io::read_ply(file.path()); }))
    promise(!cloud->points.empty(), "a cloud has points");
  read_as_scans(file.path());
}

void fuzz_image(Bytes bytes) {
  const InputFile file(bytes, ".png");
  io::is_picture(file.path());
  if (const auto camera = accepted([&] { return io::read_intrinsics(file.path()); }))
    promise(camera->fx != 0 && std::isfinite(camera->fx), "a camera has a focal length");
  accepted([&] {
    const io::DepthImage image = io::read_depth_image(file.path());
    promise(
        image.pixels.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
        "an image has its pixels");
    return io::back_project(image, io::Intrinsics{500, 500, 320, 240}, 1000);
  });
}

void fuzz_poses(Bytes bytes) {
  const InputFile file(bytes, ".txt");
  const auto poses = accepted([&] { return io::read_poses(file.path()); });
  if (!poses) return;
  promise(!poses->poses.empty(), "a pose file has poses");
  for (const io::FilePose& pose : poses->poses) accepted([&] { return io::rigid(pose.T, pose.where); });
  if (!poses->stamped) return;
  const auto trajectory = accepted([&] { return io::trajectory_of(poses->poses); });
  if (!trajectory) return;
  for (const io::FilePose& pose : poses->poses)
    for (const double later : {0.0, 0.005, 1.0})
      if (const std::int64_t t = io::to_ns(*pose.stamp_s + later); trajectory->gap_at(t, 100000000).empty())
        accepted([&] { return trajectory->at(t, 100000000); });
}

void fuzz_config(Bytes bytes) {
  const InputFile file(bytes, ".cfg");
  ParameterOptions options;
  options.config = file.path().string();
  const auto parameters = accepted([&] { return ParameterChoice(options).in_force({}); });
  if (!parameters) return;
  parameters->validate();
  for (const ParameterInfo& info : parameter_infos())
    promise(!get_parameter(*parameters, info.name).empty(), "parameters can be told");
}

}  // namespace octosurf::fuzz
