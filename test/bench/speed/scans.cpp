#include "bench/speed/scans.hpp"

#include "bench/support.hpp"
#include "simulation/recording.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

ScanSet from_folder(const std::string& name, const std::filesystem::path& folder, double max_range,
                    std::size_t every, std::size_t frames) {
  return {name, max_range, [=](const std::function<void(const Scan&)>& visit) {
            if (!std::filesystem::is_directory(folder))
              throw Error(Error::Kind::data, "skipped", folder.string() + " is missing");
            for_each_scan(folder, every, frames, [&](const Scan& scan, double) { visit(scan); });
          }};
}

}  // namespace

ScanSet kitchen_scans(const SpeedOptions& options, std::size_t frames) {
  const std::filesystem::path folder =
      options.input.empty() ? std::filesystem::path(OCTOSURF_DATA_DIR) / "rgbd_7scenes_redkitchen"
                            : std::filesystem::path(options.input);
  return from_folder("kitchen", folder, camera_range, options.every, frames);
}

ScanSet hall_scans(std::size_t frames) {
  return from_folder("hall", std::filesystem::path(OCTOSURF_DATA_DIR) / "lidar_balm_realworld",
                     std::numeric_limits<double>::infinity(), 1, frames);
}

ScanSet simulated_scans(const simulation::SimulationOptions& simulation, std::size_t frames) {
  const double range = simulation.sensor == "depth" ? camera_range : std::numeric_limits<double>::infinity();
  return {simulation.scene, range, [=](const std::function<void(const Scan&)>& visit) {
            const simulation::Recording recording(simulation);
            const std::size_t count = frames == 0 ? recording.size() : std::min(frames, recording.size());
            for (std::size_t i = 0; i < count; ++i) visit(recording.scan(i));
          }};
}

Json settings_for(const ScanSet& scans, double resolution) {
  Json settings{{"resolution", resolution}, {"max_range", nullptr}};
  if (std::isfinite(scans.max_range)) settings["max_range"] = scans.max_range;
  return settings;
}

}  // namespace octosurf::bench
