// What of a map's surfaces changes from one scan to the next where the octree did not change: polygons that
// come or go, and surfaces that get another id. Beside it, the same map segmented anew at each scan.

#include "bench/bench.hpp"

#include <unordered_set>

namespace octosurf::bench {
namespace {

/// Counts changes from snapshot to snapshot.
class Steadiness {
 public:
  void next(std::shared_ptr<const Snapshot> snapshot) {
    std::vector<Face> faces = faces_of(*snapshot);
    if (before_) compare(*snapshot, faces);
    before_ = std::move(snapshot);
    faces_ = std::move(faces);
  }
  Json numbers() const {
    const double all = std::max<double>(1, static_cast<double>(same_ + flipped_ + renamed_));
    return named("unchanged_m2 flipped renamed", all * area_, static_cast<double>(flipped_) / all,
                 static_cast<double>(renamed_) / all);
  }

 private:
  void compare(const Snapshot& now, const std::vector<Face>& faces) {
    const double d = now.resolution;
    area_ = d * d;
    std::unordered_set<std::uint64_t> changed;
    now.octree.for_each_changed_cube(
        before_->octree, [&](const std::array<std::uint16_t, 3>& corner, int log2_edge) {
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
    // Ids of a place's surface and of the one that covers it there, its own one first; 0 if none does.
    const auto compare_in = [&](const std::vector<Face>& from, const std::vector<Face>& in,
                                const auto& count) {
      for (const Face& face : from)
        face.for_each_point(d, [&](const Eigen::Vector3d& p) {
          if (is_evident(p)) return;
          SurfaceId found = 0;
          for (const Face& other : in) {
            if (std::fabs(other.height(p)) > 1.5 * d || other.normal().dot(face.normal()) < 0.9 ||
                !other.holds(p))
              continue;
            found = other.surface->id;
            if (found == face.surface->id) break;
          }
          count(face.surface->id, found);
        });
    };
    compare_in(faces_, faces, [&](SurfaceId id, SurfaceId other) {
      ++(other == 0 ? flipped_ : other == id ? same_ : renamed_);
    });
    compare_in(faces, faces_, [&](SurfaceId, SurfaceId other) { flipped_ += other == 0; });
  }
  static std::uint64_t key(int x, int y, int z) {
    return (static_cast<std::uint64_t>(x) << 32) | (static_cast<std::uint64_t>(y) << 16) |
           static_cast<std::uint64_t>(z);
  }

  std::shared_ptr<const Snapshot> before_;
  std::vector<Face> faces_;  // its
  double area_ = 0;          // m², of a cell
  std::size_t same_ = 0, flipped_ = 0, renamed_ = 0;
};

}  // namespace

void steadiness(const Options& options) {
  for_each_run(options, options.every, [&](Json row, const auto& scans) {
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
  });
}

}  // namespace octosurf::bench
