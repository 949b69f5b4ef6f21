// The ground around a robot as a controller reads it, beside the truth, and what it costs.

#include "bench/bench.hpp"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include <octosurf/ground_patch.hpp>

namespace octosurf::bench {
namespace {

constexpr double right_m = 0.01, void_m = 0.05;  // of a height; of ground that is not there

/// Where a face crosses the upright line through p; empty beside it, and of walls.
std::optional<double> height_over(const Face& face, const Eigen::Vector3d& p) {
  if (std::fabs(face.normal().z()) < 0.1) return {};
  const double z = p.z() - face.height(p) / face.normal().z();
  return face.holds({p.x(), p.y(), z}) ? std::optional(z) : std::nullopt;
}

/// The highest face that is not above `below`; minus infinity without one.
double highest(const std::vector<Face>& faces, const Eigen::Vector3d& p, double below) {
  double found = -std::numeric_limits<double>::infinity();
  for (const Face& face : faces)
    if (const auto z = height_over(face, p); z && *z <= below) found = std::max(found, *z);
  return found;
}

Eigen::Isometry3d base_of(const Scan& scan) {
  const Eigen::Vector3d ahead =
      scan.T_map_sensor.linear().col(scan.sensor == SensorKind::depth_camera ? 2 : 0);
  Eigen::Isometry3d base(Eigen::AngleAxisd(std::atan2(ahead.y(), ahead.x()), Eigen::Vector3d::UnitZ()));
  base.translation() = scan.T_map_sensor.translation();
  return base;
}

/// ms of each patch that one thread reads at 50 Hz while another maps at 30 Hz and keeps the ground up.
std::vector<double> beside_mapping(const Recorded& recorded, const Parameters& parameters,
                                   const PatchLayout& layout) {
  using Clock = std::chrono::steady_clock;
  struct Ground {
    GroundView view;
    Eigen::Isometry3d base;
  };
  std::mutex mutex;
  std::optional<Ground> now;
  std::atomic<bool> done = false;
  std::thread mapping([&] {
    Mapper mapper(parameters);
    mapper.share_octree();
    std::optional<GroundView> view;
    auto due = Clock::now();
    for (const Scan& scan : recorded.scans) {
      mapper.insert(scan);
      const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
      view = view ? view->next(snapshot, snapshot->octree) : GroundView(snapshot, snapshot->octree);
      {
        const std::lock_guard lock(mutex);
        now = Ground{*view, base_of(scan)};
      }
      std::this_thread::sleep_until(due += std::chrono::microseconds(33'333));
    }
    done = true;
  });
  std::vector<double> ms;
  for (auto due = Clock::now(); !done; std::this_thread::sleep_until(due += std::chrono::milliseconds(20))) {
    std::optional<Ground> ground;
    {
      const std::lock_guard lock(mutex);
      ground = now;
    }
    if (ground) ms.push_back(time_ms([&] { ground_patch(ground->view, ground->base, layout); }));
  }
  mapping.join();
  return ms;
}

}  // namespace

/// Patches of 640 cells at the poses of a finished recording: cells with a height, of them within a
/// centimetre of the truth below the headroom, and supported ones that are off by more than 5 cm. ms of a
/// patch, of the finished map and beside a thread that maps.
void patches(const Options& options) {
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    const Mapper mapper = mapped(recorded, options);
    const GroundView view(mapper.snapshot(), mapper.map().octree());
    const std::vector<Face> faces = standing_faces(recorded.truth);
    const PatchLayout layout = PatchLayout::grid();
    Counts count{"cells", "known", "right", "beside", "supported", "wrong"};
    std::vector<double> ms;
    for (std::size_t i = 0; i < recorded.scans.size(); i += std::max<std::size_t>(1, options.every)) {
      const Eigen::Isometry3d base = base_of(recorded.scans[i]);
      GroundPatch patch;
      ms.push_back(time_ms([&] { patch = ground_patch(view, base, layout); }));
      const double ground = highest(faces, base.translation(), base.translation().z());
      if (!std::isfinite(ground)) continue;
      for (std::size_t k = 0; k < layout.points.size(); ++k) {
        ++count["cells"];
        if (std::isnan(patch.height[k])) continue;
        const Eigen::Vector3d p =
            base * Eigen::Vector3d(layout.points[k].x(), layout.points[k].y(), patch.height[k]);
        const double below = std::max(ground, p.z()) + layout.headroom_m / 2;
        const auto off_at = [&](double x, double y) {
          const Eigen::Vector3d there = p + Eigen::Vector3d(x, y, 0);
          return std::fabs(highest(faces, there, below) - p.z());
        };
        const double off = off_at(0, 0), d = view.octree().resolution();
        const double nearby = std::min({off, off_at(d, 0), off_at(-d, 0), off_at(0, d), off_at(0, -d)});
        ++count["known"];
        count["right"] += off < right_m;
        count["beside"] += nearby < right_m;
        if (patch.cell[k] != PatchCell::supported) continue;
        ++count["supported"];
        count["wrong"] += nearby > void_m;
        if (options.verbose && nearby >= right_m)
          std::fprintf(stderr, "%zu: %.3f %.3f %.3f off %.3f %s\n", i, p.x(), p.y(), p.z(), off,
                       std::string(patch_cell_names.at(static_cast<std::size_t>(patch.cell[k]))).c_str());
      }
    }
    const std::vector<double> mapping_ms =
        beside_mapping(recorded, parameters_at(options.resolutions.front(), options.set), layout);
    count.row.update(quantiles("", "ms", ms));
    count.row.update(quantiles("mapping_", "ms", mapping_ms));
    write(recording, count.row);
  });
}

}  // namespace octosurf::bench
