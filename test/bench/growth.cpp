// What ground that is kept up costs, and what a planner's questions do.

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

Eigen::Vector3d random_vector(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> uniform(-half, half);
  return {uniform(random), uniform(random), uniform(random) / 4};
}

/// Stars whose rims are as ragged as a map's, on planes of all slopes, in a hall of 40 × 40 × 10 m.
std::shared_ptr<const Snapshot> random_surfaces(std::mt19937_64& random) {
  constexpr std::size_t surfaces = 300, vertices = 400;
  std::uniform_real_distribution<double> ragged(0.7, 1), size(0.3, 3);
  auto snapshot = std::make_shared<Snapshot>();
  for (std::size_t id = 1; id <= surfaces; ++id) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(id);
    surface->T_map_surface = Eigen::Translation3d(random_vector(random, 20)) *
                             Eigen::AngleAxisd(random_vector(random, 1.6).x(), Eigen::Vector3d::UnitX());
    surface->plane.normal = surface->T_map_surface.linear().col(2);
    surface->plane.offset = surface->plane.normal.dot(surface->T_map_surface.translation());
    const double radius = size(random);
    Polygon polygon;
    for (std::size_t i = 0; i < vertices; ++i) {
      const double a = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(vertices);
      polygon.outer.push_back(radius * ragged(random) * Eigen::Vector2d(std::cos(a), std::sin(a)));
    }
    surface->polygons.push_back(std::move(polygon));
    snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

void write_times(const std::string& what, const std::vector<double>& ms, std::size_t answers = 0) {
  write(named("question p50_us p99_us p999_us mean_us answers", what, 1000 * percentile(ms, 0.5),
              1000 * percentile(ms, 0.99), 1000 * percentile(ms, 0.999), 1000 * mean(ms), answers));
}

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

void queries(const Options& options) {
  std::mt19937_64 random(options.seeds.front());
  const std::shared_ptr<const Snapshot> snapshot = random_surfaces(random);
  write_times("an index of 300 surfaces", {time_ms([&] { const SurfaceIndex built(snapshot); })});
  const SurfaceIndex index(snapshot);
  auto changed = std::make_shared<Snapshot>(*snapshot);
  changed->surfaces[0] = std::make_shared<const Surface>(*changed->surfaces[0]);
  write_times("after one changed", {time_ms([&] { const SurfaceIndex followed(changed, &index); })});

  Eigen::Vector3d point, other;
  const auto ask = [&](const char* what, std::size_t calls, const std::function<std::size_t()>& answers) {
    std::vector<double> ms;
    std::size_t found = 0;  // so that nothing is optimised away
    for (std::size_t i = 0; i < calls; ++i) {
      point = random_vector(random, 20);
      other = random_vector(random, 20);
      ms.push_back(time_ms([&] { found += answers(); }));
    }
    write_times(what, ms, found);
  };
  const std::size_t n = options.count;
  const Eigen::Vector3d half(0.5, 0.5, 0.5), z = Eigen::Vector3d::UnitZ();
  ask("nearest", n, [&] { return index.nearest(point).has_value(); });
  ask("nearest of those that slope by 30 deg", n, [&] {
    return index.nearest(point, {z, std::numbers::pi / 6}).has_value();
  });
  ask("below", n, [&] { return index.below(point).has_value(); });
  ask("first on a ray", n, [&] { return index.first_on_ray(point, other - point).has_value(); });
  ask("snap", n, [&] { return index.snap(Eigen::Isometry3d(Eigen::Translation3d(point))).has_value(); });
  ask("in a sphere of 1 m", n, [&] { return index.in_sphere(point, 1).size(); });
  ask("in a box of 1 m", n, [&] { return index.in(ConvexSpace::box({point - half, point + half})).size(); });
  ask("in a camera's frustum of 4 m", n, [&] {
    const Eigen::Isometry3d camera(Eigen::Translation3d(point) *
                                   Eigen::AngleAxisd(other.x(), Eigen::Vector3d::UnitY()));
    return index.in(ConvexSpace::frustum(camera, 0.6, 0.45, 0.1, 4)).size();
  });

  // What a mapper would pay to publish an index with every snapshot: one after each scan, out of the one
  // before.
  Mapper mapper(parameters_at(options.resolutions.front(), options.set));
  SurfaceIndex followed(mapper.snapshot());
  std::vector<double> inserts, follows;
  for_each_kitchen_scan(options, [&](const Scan& scan) {
    inserts.push_back(time_ms([&] { mapper.insert(scan); }));
    follows.push_back(time_ms([&] { followed = SurfaceIndex(mapper.snapshot(), &followed); }));
  });
  write_times("a scan of the kitchen", inserts, inserts.size());
  write_times("index of its snapshot", follows, follows.size());
}

}  // namespace octosurf::bench
