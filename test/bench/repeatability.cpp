// Whether two maps of one place agree, each of every second scan of a real recording: no labels are needed.

#include "bench/bench.hpp"

#include <octosurf/scan_source.hpp>

namespace octosurf::bench {
namespace {

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
