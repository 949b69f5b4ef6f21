// Maps of one place beside one another: what of a map's surfaces changes from one scan to the next where the
// octree did not change, and whether two maps agree, each
// of every second scan of a real recording: no labels are needed.

#include "bench/bench.hpp"

#include <unordered_set>

#include <octosurf/scan_source.hpp>

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

constexpr double same_normal_deg = 20;  // noise tilts a plane of n points by less
constexpr double step = 0.01;           // m, between samples

/// Samples of one map's surfaces where the other has seen something, and how far its surfaces are off there.
class Agreement {
 public:
  explicit Agreement(double tolerance) : tolerance_(tolerance) {}

  void add(const Snapshot& snapshot, const Map& other, const std::vector<Face>& others) {
    for (const Face& face : faces_of(snapshot))
      face.for_each_point(step, [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d n = face.normal();
        bool seen = false, full = false;
        for (const double off : {-tolerance_, 0.0, tolerance_}) {
          const OccupancyView::Voxel voxel = other.at(p + off * n);
          seen |= voxel.state != OccupancyView::State::unknown;
          full |= voxel.state == OccupancyView::State::occupied;
        }
        if (!seen) return;
        ++samples_;
        const Face* nearest = nullptr;
        double least = tolerance_;
        for (const Face& one : others) {
          const double off = std::fabs(one.height(p));
          if (off > least || one.normal().dot(n) < std::cos(same_normal_deg / deg) ||
              !one.region.within(one.foot(p), tolerance_))
            continue;
          least = off;
          nearest = &one;
        }
        if (nearest == nullptr) {
          full ? ++pending_ : ++free_;
          return;
        }
        offsets_mm_.push_back(1e3 * least);
        angles_deg_.push_back(deg * std::acos(std::min(1.0, nearest->normal().dot(n))));
      });
  }
  Json numbers() const {
    const double all = static_cast<double>(samples_);
    return named(
        "both_saw_m2 agreeing without_surface seen_empty offset_p50_mm offset_p95_mm angle_p50_deg "
        "angle_p95_deg",
        step * step * all / 2, static_cast<double>(offsets_mm_.size()) / all,
        static_cast<double>(pending_) / all, static_cast<double>(free_) / all, percentile(offsets_mm_, 0.5),
        percentile(offsets_mm_, 0.95), percentile(angles_deg_, 0.5), percentile(angles_deg_, 0.95));
  }

 private:
  double tolerance_;  // m
  std::size_t samples_ = 0, pending_ = 0, free_ = 0;
  std::vector<double> offsets_mm_, angles_deg_;
};

}  // namespace

void steadiness(const Options& options) {
  for_each_run(options, options.every, [&](Json row, const auto& scans) {
    Mapper mapper(parameters_at(options.resolutions.front(), options.set));
    mapper.share_octree();
    Steadiness steadiness;
    scans([&](const Scan& scan) {
      mapper.insert(scan);
      steadiness.next(mapper.snapshot());
    });
    row["surfaces"] = "kept";
    write(row, steadiness.numbers());
  });
}

void repeatability(const Options& options) {
  for (const std::string& name : options.scenes) {
    ScanSourceOptions how;
    if (name == "hall") how.poses = data_path("lidar_balm_realworld/poses_subset.csv");
    const auto source = open_scans({name == "hall"      ? data_path("lidar_balm_realworld/scans")
                                    : name == "kitchen" ? data_path("rgbd_7scenes_redkitchen")
                                                        : std::filesystem::path(name)},
                                   how);
    std::vector<Scan> scans;
    while (std::optional<Scan> scan = source->next()) scans.push_back(std::move(*scan));
    for (const double d : options.resolutions) {
      std::array<Mapper, 2> halves{Mapper(parameters_at(d, options.set), options.threads),
                                   Mapper(parameters_at(d, options.set), options.threads)};
      for (std::size_t k = 0; k < scans.size(); ++k) halves[k % 2].insert(scans[k]);
      for (Mapper& half : halves) half.drain();
      const auto a = halves[0].snapshot(), b = halves[1].snapshot();
      Agreement agreement(d);
      agreement.add(*a, halves[1].map(), faces_of(*b));
      agreement.add(*b, halves[0].map(), faces_of(*a));
      write({{"recording", name}, {"scans", scans.size()}, {"resolution", d}}, agreement.numbers());
    }
  }
}

}  // namespace octosurf::bench
