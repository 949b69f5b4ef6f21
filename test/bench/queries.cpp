// What a planner's questions cost, and the index that answers them, after each scan.
#include "bench/support.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/queries.hpp>

namespace octosurf::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::size_t surfaces = 300, vertices = 400, questions = 20000, frames = 120;
  double resolution = 0.02;
  std::uint64_t seed = 1;
};

Eigen::Vector3d random_vector(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> uniform(-half, half);
  return {uniform(random), uniform(random), uniform(random) / 4};
}

/// Stars whose rims are as ragged as a map's, on planes of all slopes, in a hall of 40 × 40 × 10 m.
std::shared_ptr<const Snapshot> random_surfaces(const Options& options, std::mt19937_64& random) {
  std::uniform_real_distribution<double> ragged(0.7, 1), size(0.3, 3);
  auto snapshot = std::make_shared<Snapshot>();
  for (std::size_t id = 1; id <= options.surfaces; ++id) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(id);
    surface->T_map_surface = Eigen::Translation3d(random_vector(random, 20)) *
                             Eigen::AngleAxisd(random_vector(random, 1.6).x(), Eigen::Vector3d::UnitX());
    surface->plane.normal = surface->T_map_surface.linear().col(2);
    surface->plane.offset = surface->plane.normal.dot(surface->T_map_surface.translation());
    const double radius = size(random);
    Polygon polygon;
    for (std::size_t i = 0; i < options.vertices; ++i) {
      const double a = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(options.vertices);
      polygon.outer.push_back(radius * ragged(random) * Eigen::Vector2d(std::cos(a), std::sin(a)));
    }
    surface->polygons.push_back(std::move(polygon));
    snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

/// Microseconds of each call.
std::vector<double> times_us(std::size_t calls, const std::function<void()>& prepare,
                             const std::function<void()>& work) {
  std::vector<double> times;
  for (std::size_t i = 0; i < calls; ++i) {
    prepare();
    const auto start = Clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  return times;
}

void add_row(TextTable& table, const std::string& name, const std::vector<double>& times) {
  table.add({name, fixed(percentile(times, 0.5), 2), fixed(percentile(times, 0.99), 2),
             fixed(percentile(times, 0.999), 2)});
}

void time_questions(const Options& options) {
  std::mt19937_64 random(options.seed);
  const std::shared_ptr<const Snapshot> snapshot = random_surfaces(options, random);
  const double build_ms = time_ms([&] { const SurfaceIndex built(snapshot); });
  const SurfaceIndex index(snapshot);
  auto changed = std::make_shared<Snapshot>(*snapshot);
  changed->surfaces[0] = std::make_shared<const Surface>(*changed->surfaces[0]);
  const double follow_ms = time_ms([&] { const SurfaceIndex followed(changed, &index); });
  std::printf("%zu surfaces of %zu vertices: index built in %.2f ms, after one changed in %.3f ms\n\n",
              options.surfaces, options.vertices, build_ms, follow_ms);

  Eigen::Vector3d point, other;
  const auto next = [&] {
    point = random_vector(random, 20);
    other = random_vector(random, 20);
  };
  std::size_t found = 0;  // so that nothing is optimised away
  TextTable table({"question, us", "p50", "p99", "p99.9"});
  const auto row = [&](const char* name, std::size_t calls, const std::function<void()>& work) {
    add_row(table, name, times_us(calls, next, work));
  };
  const std::size_t n = options.questions;
  row("nearest", n, [&] { found += index.nearest(point).has_value(); });
  row("nearest of those that slope by 30 deg", n, [&] {
    found += index.nearest(point, {Eigen::Vector3d::UnitZ(), std::numbers::pi / 6}).has_value();
  });
  row("below", n, [&] { found += index.below(point).has_value(); });
  row("first on a ray", n, [&] { found += index.first_on_ray(point, other - point).has_value(); });
  row("snap", n, [&] { found += index.snap(Eigen::Isometry3d(Eigen::Translation3d(point))).has_value(); });
  row("in a sphere of 1 m", n, [&] { found += index.in_sphere(point, 1).size(); });
  const Eigen::Vector3d half(0.5, 0.5, 0.5);
  row("in a box of 1 m", n, [&] {
    found += index.in(ConvexSpace::box({point - half, point + half})).size();
  });
  row("in a camera's frustum of 4 m", n, [&] {
    const Eigen::Isometry3d camera(Eigen::Translation3d(point) *
                                   Eigen::AngleAxisd(other.x(), Eigen::Vector3d::UnitY()));
    found += index.in(ConvexSpace::frustum(camera, 0.6, 0.45, 0.1, 4)).size();
  });
  table.rule();
  row("nearest, every surface looked at", n / 20, [&] { found += nearest(*snapshot, point).has_value(); });
  row("below, every surface looked at", n / 20, [&] { found += below(*snapshot, point).has_value(); });
  std::printf("%s\n(%zu answers)\n\n", table.text().c_str(), found);
}

std::vector<Scan> kitchen_scans(const Options& options) {
  std::vector<Scan> scans;
  for_each_scan(kitchen(), 1, options.frames, [&](const Scan& scan, double) { scans.push_back(scan); });
  return scans;
}

Parameters parameters_of(const Options& options) {
  Parameters parameters;
  parameters.occupancy.resolution = options.resolution;
  return parameters;
}

/// What a mapper would pay to publish an index with every snapshot: the index after each scan, out of the one
/// before.
void time_index(const Options& options, const std::vector<Scan>& scans) {
  Mapper mapper(parameters_of(options));
  SurfaceIndex index(mapper.snapshot());
  std::vector<double> inserts, follows;
  for (const Scan& scan : scans) {
    inserts.push_back(time_ms([&] { mapper.insert(scan); }));
    follows.push_back(time_ms([&] { index = SurfaceIndex(mapper.snapshot(), &index); }));
  }
  TextTable table({"ms a scan of the kitchen", "p50", "p99", "mean"});
  for (const auto& [name, times] : {std::pair{"insert", &inserts}, {"index of its snapshot", &follows}})
    table.add({name, fixed(percentile(*times, 0.5), 3), fixed(percentile(*times, 0.99), 3),
               fixed(sum(*times) / static_cast<double>(times->size()), 3)});
  std::printf("%s\n", table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  using namespace octosurf::bench;
  CLI::App app("What a planner's questions cost");
  Options options;
  app.add_option("--surfaces", options.surfaces)->capture_default_str();
  app.add_option("--vertices", options.vertices, "of each")->capture_default_str();
  app.add_option("--questions", options.questions, "of each kind")->capture_default_str();
  app.add_option("--frames", options.frames, "of the kitchen")->capture_default_str();
  app.add_option("--resolution", options.resolution, "of the kitchen, m")->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return guarded_main([&] {
    time_questions(options);
    const std::vector<octosurf::Scan> scans = kitchen_scans(options);
    time_index(options, scans);
  });
}
