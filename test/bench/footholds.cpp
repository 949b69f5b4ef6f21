// How far footholds on our surfaces can be trusted: random ones on maps of simulated recordings, against the
// truth, for several margins, and beside them the convex hull's plain inset.

#include "bench/foothold_truth.hpp"
#include "bench/support.hpp"
#include "planning/contact_shape.hpp"
#include "planning/convex_sides.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/up.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"room", "office", "stairs", "stones"};
  std::vector<std::uint64_t> seeds{1};
  std::string sensor = "depth";
  double noise_scale = 1;
  std::optional<std::size_t> frames;
  std::size_t count = 10000;
  bool terrain = false;
};

constexpr std::array margins{0.0, 0.01, 0.02, 0.03};
constexpr double step = 0.01;       // m, between the points by which a contact is judged
constexpr double inside_by = 0.01;  // m: truly supported is what lies so far inside

struct Foot {
  std::string name;
  ContactShape shape;
  ContactLimits limits{};
};

/// Feet that ask the outlines alone, and the octree, too: for what stands there and for cracks.
std::vector<Foot> all_feet() {
  ContactLimits octree;
  octree.clearance_m = 0.15;  // of a foot
  octree.gap_depth_m = 0.03;
  const ContactShape sole = ContactShape::rectangle(0.22, 0.11), disc = ContactShape::disc(0.02);
  return {{"sole", sole}, {"sole, octree", sole, octree}, {"disc", disc}, {"disc, octree", disc, octree}};
}

/// Points all over a contact, its outline included, about its reference point.
std::vector<Eigen::Vector2d> points_of(const ContactShape& shape, double margin) {
  Ring2 ring = shape.outline.empty() ? planning::around_disc(shape.radius) : shape.outline;
  if (margin > 0) ring = planning::minkowski_sum(ring, planning::around_disc(margin));
  const planning::ConvexSides sides(ring);
  std::vector<Eigen::Vector2d> points = ring;
  evaluation::for_each_on_ring(ring, step, [&points](const Eigen::Vector2d& p) { points.push_back(p); });
  for (double x = sides.box().min().x(); x < sides.box().max().x(); x += step)
    for (double y = sides.box().min().y(); y < sides.box().max().y(); y += step)
      if (sides.depth(Eigen::Vector2d(x, y)) > 0) points.emplace_back(x, y);
  return points;
}

/// The heading that brings a contact's x axis to `x` on this surface.
double yaw_of(const Surface& surface, const Eigen::Vector3d& x) {
  const Eigen::Vector3d u = surface.T_map_surface.linear().transpose() * x;
  const Eigen::Vector2d zero = heading_on(surface, 0, Eigen::Vector3d::UnitZ());
  // Of a slope up to 30° a heading's projection is not quite turned by the same angle: turned on until it is.
  double yaw = std::atan2(u.y(), u.x()) - std::atan2(zero.y(), zero.x());
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d h = heading_on(surface, yaw, Eigen::Vector3d::UnitZ());
    yaw += std::atan2(h.x() * u.y() - h.y() * u.x(), h.dot(u.head<2>()));
  }
  return yaw;
}

/// Footholds counted for each margin.
struct Tally {
  std::size_t asked = 0, good = 0;
  std::array<std::size_t, margins.size()> accepted{}, off_1cm{}, off_2cm{}, off_all{}, good_accepted{};
  std::size_t hull_accepted = 0, hull_off_1cm = 0, hull_off_2cm = 0, hull_good = 0;
  std::vector<double> us;

  void add(const Tally& other) {
    asked += other.asked;
    good += other.good;
    for (std::size_t m = 0; m < margins.size(); ++m) {
      accepted[m] += other.accepted[m];
      off_1cm[m] += other.off_1cm[m];
      off_2cm[m] += other.off_2cm[m];
      off_all[m] += other.off_all[m];
      good_accepted[m] += other.good_accepted[m];
    }
    hull_accepted += other.hull_accepted;
    hull_off_1cm += other.hull_off_1cm;
    hull_off_2cm += other.hull_off_2cm;
    hull_good += other.hull_good;
    us.insert(us.end(), other.us.begin(), other.us.end());
  }
};

/// A surface as planners without polygons have it: its convex hull.
planning::ConvexSides hull_of(const Surface& surface) {
  Ring2 all;
  for (const Polygon& polygon : surface.polygons)
    all.insert(all.end(), polygon.outer.begin(), polygon.outer.end());
  return planning::ConvexSides(planning::convex_hull(std::move(all)));
}

struct Walkable {
  const Surface* surface;
  planning::ConvexSides hull;
};
std::vector<Walkable> walkable(const Snapshot& snapshot) {
  std::vector<Walkable> all;
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (slope_rad(*surface) <= max_slope && !surface->polygons.empty())
      all.push_back({surface.get(), hull_of(*surface)});
  return all;
}

bool in_hull(const planning::ConvexSides& hull, const Surface& surface, const ContactShape& shape,
             const Eigen::Isometry3d& T_map_contact) {
  const Eigen::Isometry3d T = surface.T_map_surface.inverse() * T_map_contact;
  const Ring2 ring = shape.outline.empty() ? planning::around_disc(shape.radius) : shape.outline;
  return std::all_of(ring.begin(), ring.end(), [&](const Eigen::Vector2d& p) {
    return hull.depth(Eigen::Vector2d((T * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>())) >= 0;
  });
}

/// Random places on what the map says is there: how many are accepted, and which of them are not there.
void ask_map(const Snapshot& snapshot, const std::vector<Walkable>& surfaces, const OccupancyView& octree,
             const Ground& ground, const Foot& foot, const Options& options, std::mt19937_64& rng,
             Tally& tally) {
  const std::vector<Eigen::Vector2d> points = points_of(foot.shape, 0);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> areas;
  for (const Walkable& one : surfaces) areas.push_back(one.hull.area());
  std::discrete_distribution<std::size_t> by_area(areas.begin(), areas.end());
  for (std::size_t i = 0; i < options.count; ++i) {
    const Walkable& one = surfaces[by_area(rng)];
    const Surface& surface = *one.surface;
    Eigen::Vector2d uv;
    do
      uv = one.hull.box().min() +
           Eigen::Vector2d(uniform(rng), uniform(rng)).cwiseProduct(one.hull.box().sizes());
    while (one.hull.depth(uv) < 0);
    Foothold found;
    const double yaw = 2 * std::numbers::pi * uniform(rng);
    tally.us.push_back(1000 * time_ms([&] {
                         found = foothold(surface, foot.shape, surface.to_map(uv), yaw, foot.limits, &octree,
                                          nullptr, &snapshot);
                       }));
    const bool hull = in_hull(one.hull, surface, foot.shape, found.T_map_contact);
    ++tally.asked;
    if (!found.accepted && !hull) continue;
    double off = 0;
    for (const Eigen::Vector2d& p : points)
      off = std::max(
          off, ground.off(found.T_map_contact * Eigen::Vector3d(p.x(), p.y(), 0), surface.plane.normal));
    tally.hull_accepted += hull;
    tally.hull_off_1cm += hull && off > 0.01;
    tally.hull_off_2cm += hull && off > 0.02;
    if (!found.accepted) continue;
    for (std::size_t m = 0; m < margins.size(); ++m) {
      if (found.margin_m < margins[m]) continue;
      ++tally.accepted[m];
      tally.off_1cm[m] += off > 0.01;
      tally.off_2cm[m] += off > 0.02;
      tally.off_all[m] += off >= false_from;
    }
  }
}

/// Places that are truly supported and were seen: how many are accepted, by any surface that is there.
void ask_truth(const Snapshot& snapshot, const std::vector<Walkable>& surfaces, const OccupancyView& octree,
               const Ground& ground, const Foot& foot, double tolerance, const Options& options,
               std::mt19937_64& rng, Tally& tally) {
  const std::vector<Eigen::Vector2d> points = points_of(foot.shape, inside_by);
  for (std::size_t i = 0; i < options.count; ++i) {
    const Ground::Place place = ground.place(rng, points);
    if (!place.supported || !place.seen) continue;
    ++tally.good;
    double margin = -1;
    bool hull = false;
    const Eigen::Vector3d at = place.T_map_contact.translation();
    for (const Walkable& one : surfaces) {
      const Surface& surface = *one.surface;
      if (surface.plane.normal.dot(place.face->plane.normal) < std::cos(max_slope / 2) ||
          std::abs(surface.plane.signed_distance(at)) > tolerance)
        continue;
      const double yaw = yaw_of(surface, place.T_map_contact.linear().col(0));
      const Foothold found = foothold(surface, foot.shape, at, yaw, foot.limits, &octree, nullptr, &snapshot);
      if (found.accepted) margin = std::max(margin, found.margin_m);
      hull = hull || in_hull(one.hull, surface, foot.shape, found.T_map_contact);
    }
    for (std::size_t m = 0; m < margins.size(); ++m) tally.good_accepted[m] += margin >= margins[m];
    tally.hull_good += hull;
  }
}

struct Mapped {
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  evaluation::Truth truth;
};
Mapped map_of(const std::string& scene, std::uint64_t seed, const Options& options) {
  simulation::SimulationOptions simulation;
  set_scene(scene, simulation);
  simulation.sensor = options.sensor;
  simulation.seed = seed;
  simulation.noise_scale = options.noise_scale;
  simulation.frames = options.frames;
  const Recorded recorded = record(simulation);
  Mapper mapper{Parameters{}};
  for (const Scan& scan : recorded.scans) mapper.insert(scan);
  mapper.drain();
  return {mapper.snapshot(), mapper.map().octree(), recorded.truth};
}

std::string percent(std::size_t part, std::size_t whole, int digits) {
  return whole == 0 ? "-" : fixed(100 * static_cast<double>(part) / static_cast<double>(whole), digits);
}

void add_rows(TextTable& table, const std::string& name, const Tally& tally) {
  for (std::size_t m = 0; m < margins.size(); ++m)
    table.add({name + ", " + fixed(100 * margins[m], 0) + " cm", std::to_string(tally.accepted[m]),
               std::to_string(tally.off_1cm[m]), percent(tally.off_1cm[m], tally.accepted[m], 2),
               std::to_string(tally.off_2cm[m]), std::to_string(tally.off_all[m]), std::to_string(tally.good),
               percent(tally.good_accepted[m], tally.good, 1)});
  table.add({name + ", hull", std::to_string(tally.hull_accepted), std::to_string(tally.hull_off_1cm),
             percent(tally.hull_off_1cm, tally.hull_accepted, 2), std::to_string(tally.hull_off_2cm), "",
             std::to_string(tally.good), percent(tally.hull_good, tally.good, 1)});
  table.rule();
}

/// All that is asked of one map, for each foot.
void ask(const Mapped& mapped, const std::vector<Foot>& feet, const Options& options, std::uint64_t seed,
         std::vector<Tally>& tallies) {
  const double tolerance = std::max(0.02, 1.5 * mapped.snapshot->resolution);
  const Ground ground(mapped.truth, tolerance);
  const std::vector<Walkable> surfaces = walkable(*mapped.snapshot);
  if (surfaces.empty() || !ground.has_ground()) return;
  std::mt19937_64 rng(seed);
  for (std::size_t f = 0; f < feet.size(); ++f) {
    ask_map(*mapped.snapshot, surfaces, mapped.octree, ground, feet[f], options, rng, tallies[f]);
    ask_truth(*mapped.snapshot, surfaces, mapped.octree, ground, feet[f], tolerance, options, rng,
              tallies[f]);
  }
}

void body(Options options) {
  if (options.terrain && (options.scenes = terrain_meshes()).empty()) return;
  const std::vector<Foot> feet = all_feet();
  std::vector<Tally> totals(feet.size());
  TextTable table({"scene, foot, margin", "accepted", "off > 1 cm", "%", "off > 2 cm", "false", "good ones",
                   "% accepted"});
  for (const std::string& scene : options.scenes) {
    std::vector<Tally> tallies(feet.size());
    const std::string name = std::filesystem::path(scene).stem().string();
    for (const std::uint64_t seed : options.seeds) {
      ask(map_of(scene, seed, options), feet, options, seed, tallies);
      std::fprintf(stderr, "%s %zu done\n", name.c_str(), static_cast<std::size_t>(seed));
    }
    for (std::size_t f = 0; f < feet.size(); ++f) {
      add_rows(table, name + ", " + feet[f].name, tallies[f]);
      totals[f].add(tallies[f]);
    }
  }
  for (std::size_t f = 0; f < feet.size(); ++f) {
    add_rows(table, "all, " + feet[f].name, totals[f]);
    std::printf("foothold(), %s: p50 %.1f µs, p99 %.1f µs of %zu\n", feet[f].name.c_str(),
                percentile(totals[f].us, 0.5), percentile(totals[f].us, 0.99), totals[f].us.size());
  }
  std::printf(
      "%s sensor, noise ×%g, %zu seeds; accepted: of %zu random ones in the surfaces' hulls; off: a part of "
      "the contact lies over what is not a true surface, by more than that (false: 5 cm); good ones: random "
      "ones on true faces, supported with 1 cm to spare and seen.\n%s",
      options.sensor.c_str(), options.noise_scale, options.seeds.size(), options.count, table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"random footholds on maps of simulated scenes, against the truth"};
  auto* scenes = app.add_option("--scenes", options.scenes, "names, or files of meshes")
                     ->delimiter(',')
                     ->capture_default_str();
  app.add_flag("--terrain", options.terrain,
               "the meshes of ../shared/data/terrain_meshes in their place; 300 scans of each unless told "
               "otherwise")
      ->excludes(scenes);
  app.add_option("--seeds", options.seeds)->delimiter(',')->capture_default_str();
  app.add_option("--sensor", options.sensor)->capture_default_str();
  app.add_option("--noise-scale", options.noise_scale, "times the sensor's noise")->capture_default_str();
  app.add_option("--frames", options.frames, "scans of each recording (default: as many as show the scene)");
  app.add_option("--count", options.count,
                 "random footholds on each map, of each foot, and as many on its truth")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (options.terrain && !options.frames) options.frames = 300;  // a step of 10 to 15 cm each
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
