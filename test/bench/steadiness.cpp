// What of a map's surfaces changes from one scan to the next where the octree did not change: polygons that
// come or go, and surfaces that get another id. Beside it, the same map segmented anew at each scan.

#include "bench/bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

namespace octosurf::bench {
namespace {

/// A snapshot, ready for queries.
class Covered {
 public:
  explicit Covered(std::shared_ptr<const Snapshot> snapshot) : snapshot_(std::move(snapshot)) {
    for (const SurfacePtr& surface : snapshot_->surfaces) regions_.emplace_back(surface->polygons);
  }
  const Snapshot& snapshot() const { return *snapshot_; }
  template <class Visit>
  void for_each_cell(const Visit& visit) const {
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const Surface& surface = *snapshot_->surfaces[i];
      regions_[i].for_each_cell(snapshot_->resolution,
                                [&](const Eigen::Vector2d& uv) { visit(surface, surface.to_map(uv)); });
    }
  }
  /// The surface that covers a place of another surface, its own one first; nullptr if none does.
  const Surface* at(const Surface& other, const Eigen::Vector3d& p) const {
    const Surface* found = nullptr;
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const Surface& surface = *snapshot_->surfaces[i];
      if (std::fabs(surface.plane.signed_distance(p)) > 1.5 * snapshot_->resolution ||
          surface.plane.normal.dot(other.plane.normal) < 0.9)
        continue;
      const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * p).head<2>();
      if (!regions_[i].contains(uv)) continue;
      found = &surface;
      if (surface.id == other.id) return found;
    }
    return found;
  }

 private:
  std::shared_ptr<const Snapshot> snapshot_;
  std::vector<evaluation::PlanarRegion> regions_;
};

/// Counts changes from snapshot to snapshot.
class Steadiness {
 public:
  void next(const std::shared_ptr<const Snapshot>& snapshot) {
    auto now = std::make_unique<Covered>(snapshot);
    if (before_) compare(*before_, *now);
    before_ = std::move(now);
  }
  Json numbers() const {
    const double all = std::max<double>(1, static_cast<double>(same_ + flipped_ + renamed_));
    return {{"unchanged_m2", all * area_},
            {"flipped", static_cast<double>(flipped_) / all},
            {"renamed", static_cast<double>(renamed_) / all}};
  }

 private:
  void compare(const Covered& before, const Covered& now) {
    const double d = now.snapshot().resolution;
    area_ = d * d;
    std::unordered_set<std::uint64_t> changed;
    now.snapshot().octree.for_each_changed_cube(
        before.snapshot().octree, [&](const std::array<std::uint16_t, 3>& corner, int log2_edge) {
          const int n = 1 << (log2_edge - 2);
          for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
              for (int z = 0; z < n; ++z)
                changed.insert(key((corner[0] >> 2) + x, (corner[1] >> 2) + y, (corner[2] >> 2) + z));
        });
    const auto is_evident = [&](const Eigen::Vector3d& p) {  // within a hole's width
      const double reach = 4 * d;
      for (const double x : {-reach, 0.0, reach})
        for (const double y : {-reach, 0.0, reach})
          for (const double z : {-reach, 0.0, reach}) {
            const Eigen::Array3i cube =
                ((p + Eigen::Vector3d(x, y, z)) / (4 * d)).array().floor().cast<int>() + 8192;
            if (changed.contains(key(cube.x(), cube.y(), cube.z()))) return true;
          }
      return false;
    };
    before.for_each_cell([&](const Surface& surface, const Eigen::Vector3d& p) {
      if (is_evident(p)) return;
      const Surface* other = now.at(surface, p);
      ++(other == nullptr ? flipped_ : other->id == surface.id ? same_ : renamed_);
    });
    now.for_each_cell([&](const Surface& surface, const Eigen::Vector3d& p) {
      if (!is_evident(p) && before.at(surface, p) == nullptr) ++flipped_;
    });
  }
  static std::uint64_t key(int x, int y, int z) {
    return (static_cast<std::uint64_t>(x) << 32) | (static_cast<std::uint64_t>(y) << 16) |
           static_cast<std::uint64_t>(z);
  }

  std::unique_ptr<Covered> before_;
  double area_ = 0;  // m², of a cell
  std::size_t same_ = 0, flipped_ = 0, renamed_ = 0;
};

}  // namespace

void steadiness(const Options& options) {
  const auto run = [&](Json row, const std::function<void(const std::function<void(const Scan&)>&)>& scans) {
    for (const bool anew : {false, true}) {
      Mapper mapper(parameters_at(options.resolutions.front(), options.set));
      mapper.share_octree();
      Steadiness steadiness;
      scans([&](const Scan& scan) {
        mapper.insert(scan);
        if (anew) mapper.resegment();
        steadiness.next(mapper.snapshot());
      });
      row["surfaces"] = anew ? "segmented anew" : "kept";
      write(row, steadiness.numbers());
    }
  };
  run({{"scene", "kitchen"}},
      [&](const auto& visit) { for_each_scan(kitchen_of(options), options.every, options.frames, visit); });
  for_each_recording(options, [&](const Recorded& recorded, const Json& row) {
    run(row, [&](const auto& visit) {
      for (std::size_t i = 0; i < recorded.scans.size(); i += options.every) visit(recorded.scans[i]);
    });
  });
}

}  // namespace octosurf::bench
