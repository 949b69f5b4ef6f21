// What a scan costs late in a long run beside what it costs early, and what a planner's questions cost.

#include "bench/bench.hpp"

#include <octosurf/queries.hpp>

namespace octosurf::bench {
namespace {

/// What the ground of a map costs at each scan, kept up from the one before.
class GroundTimes {
 public:
  /// Reads what a planner needs near `from`, and, with `all`, everything.
  void measure(const std::shared_ptr<const Snapshot>& snapshot, const Eigen::Vector3d& from, bool all) {
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
    if (!all) return;
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

/// A mapper that inserts scan 0, 1, … of a run.
struct Walk {
  Mapper mapper;
  std::function<Scan(std::size_t)> scan;
  std::size_t next = 0;
  double heap_bytes = 0;
  std::vector<ScanReport> reports{};  ///< of what is measured
  GroundTimes ground{};

  Walk(const Parameters& parameters, std::function<Scan(std::size_t)> scans, std::size_t until)
      : mapper(parameters), scan(std::move(scans)) {
    const double before = heap_in_use();
    while (next < until) mapper.insert(scan(next++));
    heap_bytes = heap_in_use() - before;
  }
  void measure() {
    const Scan look = scan(next++);
    mapper.share_octree();
    reports.push_back(mapper.insert(look));
    ground.measure(mapper.snapshot(), look.T_map_sensor.translation() + Eigen::Vector3d(1.5, 0, 0), false);
  }
};

/// The median of each stage and of whole scans, and what the map takes.
Json count(const Walk& walk, const std::string& name) {
  std::vector<double> whole;
  for (const ScanReport& report : walk.reports) whole.push_back(report.total_ms);
  Json row = quantiles("", "ms", whole);
  row["stage_p50_ms"] =
      stages_of(walk.reports, [](const std::vector<double>& ms) { return percentile(ms, 0.5); });
  row["ground"] = walk.ground.medians();
  const std::string stem = scratch(name);
  save_map(walk.mapper.map(), stem);
  row.update(named("heap_bytes tree_bytes file_bytes surfaces", walk.heap_bytes,
                   walk.mapper.map().size().bytes, std::filesystem::file_size(stem + ".surfaces"),
                   walk.mapper.snapshot()->surfaces.size()));
  return row;
}

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

/// A floor 3 m wide, walked --laps times, that a camera looks down on from 1.2 m: a reading each centimetre
/// or so. One mapper walks its last 25 m, by turns with another that walks those after its first 25 m (of
/// several laps: of the second lap): so the machine's other load hits both alike.
void floor(const Options& options) {
  constexpr double width = 3, step = 0.5, noise_m = 0.002;
  constexpr std::size_t measured = 50;
  const auto scans = static_cast<std::size_t>(std::ceil(options.length / step)),
             all = scans * static_cast<std::size_t>(options.laps);
  const auto scan = [scans, random = std::mt19937_64(options.seeds.front())](std::size_t i) mutable {
    std::normal_distribution<double> noise(0, noise_m);
    std::uniform_real_distribution<double> within(-0.005, 0.005);
    Scan look;
    look.T_map_sensor = Eigen::Translation3d(static_cast<double>(i % scans) * step, 0, 1.2);
    look.stamp_s = static_cast<double>(i) / 30;
    for (double along = 0.3; along < 3.3; along += 0.01)
      for (double across = -width / 2; across < width / 2; across += 0.01)
        look.points.emplace_back(Eigen::Vector3f(static_cast<float>(along + within(random)),
                                                 static_cast<float>(across + within(random)),
                                                 static_cast<float>(-1.2 + noise(random))));
    return look;
  };
  const Parameters parameters = parameters_at(options.resolutions.front(), options.set);
  Walk late(parameters, scan, all - measured);
  Walk early(parameters, scan, options.laps > 1 ? 2 * scans - measured : measured);
  for (std::size_t i = 0; i < measured; ++i) {
    if (i % 2 == 0) early.measure();
    late.measure();
    if (i % 2 != 0) early.measure();
  }
  for (const auto& [name, walk] : {std::pair{"early", &early}, {"late", &late}}) {
    write({{"when", name}}, count(*walk, name));
  }
}

/// Ground kept up while recordings are mapped: the kitchen, and simulated ones.
void ground(const Options& options) {
  for_each_run(options, 1, [&](const Json& row, const auto& scans) {
    Mapper mapper(parameters_at(options.resolutions.front(), options.set));
    mapper.share_octree();
    GroundTimes times;
    std::vector<double> insert_ms;
    scans([&](const Scan& scan) {
      insert_ms.push_back(time_ms([&] { mapper.insert(scan); }));
      times.measure(mapper.snapshot(), scan.T_map_sensor.translation(), true);
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
