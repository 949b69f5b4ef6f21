// What ground that is kept up costs, and what a planner asks of it.

#include "bench/bench.hpp"

#include <octosurf/queries.hpp>

namespace octosurf::bench {
namespace {

/// What the ground of a map costs at each scan, kept up from the one before.
class GroundTimes {
 public:
  /// Reads what a planner needs near `from`, and everything.
  void measure(const std::shared_ptr<const Snapshot>& snapshot, const Eigen::Vector3d& from) {
    std::optional<GroundView> now;
    const auto keep_up = [&] {
      now = kept_ ? kept_->next(snapshot, snapshot->octree) : GroundView(snapshot, snapshot->octree);
    };
    times_["next_ms"].push_back(time_ms(keep_up));
    kept_ = now;
    const auto floor = SurfaceIndex(snapshot).below(from, {Eigen::Vector3d::UnitZ(), max_slope});
    if (floor) {
      constexpr int feet = 50;
      double area = 0;
      const auto put_feet = [&] {
        for (int k = 0; k < feet; ++k) {
          const double turn = k * 2.4, off = 0.02 * k;  // a spiral to 1 m
          const Eigen::Vector3d at = floor->point + off * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0);
          area += now->foothold(floor->id, at, turn).supported;
        }
      };
      times_["first_feet_ms"].push_back(time_ms(put_feet) / feet);
      times_["foothold_ms"].push_back(time_ms(put_feet) / feet);
      times_["region_2m_ms"].push_back(
          time_ms([&] { area += now->region_about(floor->id, floor->point, 2, {}).area_m2; }));
    }
    times_["all_ms"].push_back(time_ms([&] { now->solid(); }));
  }
  Json medians() const {
    Json row;
    for (const auto& [name, ms] : times_) row[name] = percentile(ms, 0.5);
    return row;
  }

 private:
  std::optional<GroundView> kept_;
  std::map<std::string, std::vector<double>> times_;
};

}  // namespace

/// Ground kept up while recordings are mapped: the kitchen, and simulated ones.
void ground(const Options& options) {
  for_each_run(options, 1, [&](const Json& row, const auto& scans) {
    Mapper mapper(parameters_at(options.resolutions.front(), options.set));
    mapper.share_octree();
    GroundTimes times;
    std::vector<double> insert_ms;
    scans([&](const Scan& scan) {
      insert_ms.push_back(time_ms([&] { mapper.insert(scan); }));
      times.measure(mapper.snapshot(), scan.T_map_sensor.translation());
    });
    Json more{{"insert_ms", percentile(insert_ms, 0.5)}};
    more.update(times.medians());
    write(row, more);
  });
}

}  // namespace octosurf::bench
