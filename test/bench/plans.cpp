// Footstep plans over simulated scenes and terrains, judged by the truth: is every sole on true ground, does
// anything touch, and are as many goals reached as by the same planner on the true surfaces.

#include "bench/support.hpp"
#include "evaluation/evaluate.hpp"
#include "evaluation/planar_region.hpp"
#include "planning/footsteps/swing.hpp"
#include "simulation/recording.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <boost/polygon/polygon.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <random>
#include <unordered_map>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/plan_files.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"stairs", "stones", "office", "bauzil_stairs", "darpa", "rubbles_stairs_1"};
  std::uint64_t seed = 1;
  std::size_t goals = 50;
  PlanBudget budget;
  std::string robot = "biped";
  std::filesystem::path pictures;
  std::string json;
  bool verbose = false;
};

constexpr double within_m = 0.01;   // of true ground every part of a sole lies
constexpr double touch_m = 0.01;    // so deep in a box is a touch: truth is sampled every centimetre
constexpr double sample_m = 0.01;   // of soles and of true faces
constexpr double shortest_m = 1.0;  // between start and goal
constexpr double level = 0.86;      // cosine of the steepest ground that goals are drawn on (30°)

/// What stands, as points, in columns of 10 cm: true faces, and noise-free readings for what has none.
class TruePoints {
 public:
  void add(const Eigen::Vector3d& p) { columns_[key(p.head<2>())].push_back(p); }

  bool in_box(const footsteps::SwingPose& pose, const Eigen::Vector2d& middle, double length, double width,
              double from_z, double to_z) const {
    const Eigen::Rotation2Dd turn(pose.yaw_rad);
    const Eigen::Vector2d center = pose.at + turn * middle;
    const double half = std::hypot(length, width) / 2;
    for (double x = center.x() - half; x <= center.x() + half + cell; x += cell)
      for (double y = center.y() - half; y <= center.y() + half + cell; y += cell) {
        const auto found = columns_.find(key({x, y}));
        if (found == columns_.end()) continue;
        for (const Eigen::Vector3d& p : found->second) {
          if (p.z() < from_z + touch_m || p.z() > to_z - touch_m) continue;
          const Eigen::Vector2d d = turn.inverse() * (p.head<2>() - center);
          if (std::abs(d.x()) < length / 2 - touch_m && std::abs(d.y()) < width / 2 - touch_m) return true;
        }
      }
    return false;
  }

 private:
  static constexpr double cell = 0.1;
  static std::uint64_t key(const Eigen::Vector2d& p) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(static_cast<int>(std::floor(p.x() / cell))))
               << 32 |
           static_cast<std::uint32_t>(static_cast<int>(std::floor(p.y() / cell)));
  }
  std::unordered_map<std::uint64_t, std::vector<Eigen::Vector3d>> columns_;
};

struct TrueGround {
  Plane plane;
  Eigen::Isometry3d T_face_map;
  PlanarRegion region;
};

/// A scene, mapped and true.
struct World {
  std::string name;
  std::shared_ptr<const Snapshot> mapped, truth;
  OccupancyView octree, true_octree;
  std::vector<TrueGround> ground;
  TruePoints points;
  std::vector<Standing> candidates;  ///< seen level ground
};

/// The seen part of a true face, gaps up to the mapper's largest hole closed: nobody can plan over what
/// nobody saw.
std::vector<Polygon> seen_part(const TrueFace& face, double cell) {
  using namespace boost::polygon::operators;
  constexpr double unit = 1e-5;    // m
  constexpr int half_hole = 4000;  // units: h / 2
  const auto integer = [](double v) { return static_cast<int>(std::lround(v / unit)); };
  boost::polygon::polygon_90_set_data<int> cells;
  for (const CellRun& run : face.visible)
    cells += boost::polygon::rectangle_data<int>(integer(run.column * cell), integer(run.row * cell),
                                                 integer((run.column + run.count) * cell),
                                                 integer((run.row + 1) * cell));
  cells.bloat(half_hole, half_hole, half_hole, half_hole);
  cells.shrink(half_hole, half_hole, half_hole, half_hole);
  std::vector<boost::polygon::rectangle_data<int>> rectangles;
  cells.get_rectangles(rectangles);
  boost::polygon::polygon_set_data<int> seen, whole;
  for (const auto& rectangle : rectangles) seen.insert(rectangle);
  const auto insert = [&](const Ring2& ring, bool hole) {
    std::vector<boost::polygon::point_data<int>> points;
    for (const Eigen::Vector2d& p : ring) points.emplace_back(integer(p.x()), integer(p.y()));
    boost::polygon::polygon_data<int> polygon(points.begin(), points.end());
    whole.insert(polygon, hole);
  };
  for (const Polygon& polygon : face.polygons) {
    insert(polygon.outer, false);
    for (const Ring2& hole : polygon.holes) insert(hole, true);
  }
  seen &= whole;
  std::vector<boost::polygon::polygon_with_holes_data<int>> parts;
  seen.get(parts);
  const auto ring_of = [&](const auto& part, bool outer) {
    Ring2 ring;
    for (auto p = part.begin(); p != part.end(); ++p) ring.emplace_back(p->x() * unit, p->y() * unit);
    if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    double twice = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      twice += a.x() * b.y() - a.y() * b.x();
    }
    if ((twice > 0) != outer) std::reverse(ring.begin(), ring.end());
    return ring;
  };
  std::vector<Polygon> polygons;
  for (const auto& part : parts) {
    Polygon polygon{ring_of(part, true), {}};
    for (auto hole = part.begin_holes(); hole != part.end_holes(); ++hole)
      polygon.holes.push_back(ring_of(*hole, false));
    polygons.push_back(std::move(polygon));
  }
  return polygons;
}

std::shared_ptr<const Snapshot> snapshot_of(const Truth& truth) {
  auto snapshot = std::make_shared<Snapshot>();
  for (const TrueFace& face : truth.faces) {
    if (face.gone || face.visible.empty() || face.plane.normal.z() < level) continue;
    auto surface = std::make_shared<Surface>();
    surface->id = face.id;
    surface->plane = face.plane;
    surface->T_map_surface = face.T_map_face;
    surface->polygons = seen_part(face, truth.cell);
    for (const Polygon& polygon : surface->polygons) {
      surface->area_m2 += enclosed_area(polygon.outer);
      for (const Ring2& hole : polygon.holes) surface->area_m2 -= enclosed_area(hole);
    }
    if (!surface->polygons.empty()) snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

/// Scan i without noise, as it was seen.
Scan ideal_scan(const Recording& recording, std::size_t i, const Readings& ideal) {
  Scan scan = recording.labelled_scan(i, ideal).scan;
  scan.T_map_sensor = recording.true_pose(i);
  scan.points.clear();
  for (std::size_t k = 0; k < ideal.t.size(); ++k)
    if (ideal.t[k] > 0) scan.points.emplace_back(ideal.t[k] * recording.rays()[k]);
  return scan;
}

/// CPU time, because other work may share the machine and a planner has one thread.
double cpu_ms(const std::function<void()>& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

World make_world(const Options& options, const std::string& scene, const std::filesystem::path& mesh) {
  SimulationOptions simulation;
  simulation.seed = options.seed;
  if (mesh.empty()) {
    simulation.scene = scene;
  } else {
    simulation.mesh = mesh;
    simulation.frames = 300;
  }
  const Recording recording(simulation);
  Recording::Visibility visibility = recording.visibility();
  World world;
  world.name = scene;
  Mapper mapper, true_mapper;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Readings ideal = recording.ideal(i);
    visibility.add(i, ideal);
    mapper.insert(recording.labelled_scan(i, ideal).scan);
    true_mapper.insert(ideal_scan(recording, i, ideal));
    const Eigen::Isometry3d T = recording.true_pose(i);
    for (std::size_t k = 0; k < ideal.t.size(); k += 7)
      if (ideal.t[k] > 0 && ideal.labels[k] == 0)
        world.points.add(T * (ideal.t[k] * recording.rays()[k]).cast<double>());
  }
  world.mapped = mapper.snapshot();
  world.octree = mapper.map().octree();
  world.true_octree = true_mapper.map().octree();
  const Truth truth = visibility.truth();
  world.truth = snapshot_of(truth);
  for (const TrueFace& face : truth.faces) {
    if (face.gone) continue;
    world.ground.push_back({face.plane, face.T_map_face.inverse(), PlanarRegion(face.polygons)});
    world.ground.back().region.for_each_cell(sample_m, [&](const Eigen::Vector2d& uv) {
      world.points.add(face.T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0));
    });
    if (face.plane.normal.z() < level) continue;
    for (const CellRun& run : face.visible)
      for (int i = 0; i < run.count; i += 5)
        if (run.row % 5 == 0)
          world.candidates.push_back({face.T_map_face * Eigen::Vector3d((run.column + i + 0.5) * truth.cell,
                                                                        (run.row + 0.5) * truth.cell, 0),
                                      0});
  }
  return world;
}

/// Every sample of the sole lies over a true face or within a centimetre beside it, and at most so far off
/// its plane.
bool supported(const World& world, const Footstep& step, const ContactShape& foot, double off_plane) {
  const footsteps::LegBox box = footsteps::LegBox::of(foot);
  for (double x = -box.half_length; x <= box.half_length + 1e-9; x += box.half_length / 8)
    for (double y = -box.half_width; y <= box.half_width + 1e-9; y += box.half_width / 5) {
      if (foot.outline.empty() && std::hypot(x, y) > foot.radius) continue;
      const Eigen::Vector3d p = step.T_map_foot * Eigen::Vector3d(box.middle.x() + x, box.middle.y() + y, 0);
      const bool on = std::any_of(world.ground.begin(), world.ground.end(), [&](const TrueGround& face) {
        return std::abs(face.plane.signed_distance(p)) <= off_plane &&
               face.plane.normal.dot(step.T_map_foot.linear().col(2)) > level &&
               face.region.within((face.T_face_map * p).head<2>(), within_m);
      });
      if (!on) return false;
    }
  return true;
}

/// The body's box or a swinging biped's leg meets a true point.
bool touches(const World& world, const FootstepPlan& plan, const Robot& robot) {
  const BodyBox body = std::visit([](const auto& kind) { return kind.body; }, robot);
  const auto sweep = [&](const footsteps::SwingPose& a, const footsteps::SwingPose& b, const auto& meets) {
    const double turn = footsteps::turn_between(a.yaw_rad, b.yaw_rad);
    for (int i = 0; i <= 20; ++i)
      if (meets(footsteps::SwingPose{a.at + i / 20.0 * (b.at - a.at), a.yaw_rad + i / 20.0 * turn}, i / 20.0))
        return true;
    return false;
  };
  for (std::size_t i = 1; i < plan.body.size(); ++i) {
    const Standing &a = plan.body[i - 1], &b = plan.body[i];
    if (sweep({a.at.head<2>(), a.yaw_rad}, {b.at.head<2>(), b.yaw_rad}, [&](const auto& pose, double share) {
          const double z = a.at.z() + share * (b.at.z() - a.at.z());
          return world.points.in_box(pose, {0, 0}, body.length_m, body.width_m, z + body.from_m,
                                     z + body.to_m);
        }))
      return true;
  }
  const auto* biped = std::get_if<Biped>(&robot);
  if (biped == nullptr) return false;
  const footsteps::LegBox leg = footsteps::LegBox::of(biped->foot);
  std::array<Footstep, 2> feet{plan.start[0], plan.start[1]};
  for (const Footstep& step : plan.steps) {
    const auto side = static_cast<std::size_t>(step.foot);
    const Footstep &stance = feet[1 - side], &before = feet[side];
    const auto pose = [](const Footstep& foot) {
      return footsteps::SwingPose{foot.T_map_foot.translation().head<2>(), foot.yaw_rad};
    };
    const Eigen::Vector2d left(-std::sin(stance.yaw_rad), std::cos(stance.yaw_rad));
    footsteps::SwingPose beside = pose(stance);
    beside.at += (side == 0 ? 1 : -1) * biped->stance_width_m * left;
    for (const auto& [from, to, other] :
         {std::tuple{pose(before), beside, &before}, std::tuple{beside, pose(step), &step}}) {
      const double z = std::max(stance.T_map_foot.translation().z(), other->T_map_foot.translation().z());
      const auto meets_at = [&, &from = from, &to = to](double lift) {
        return sweep(from, to, [&](const auto& at, double) {
          return world.points.in_box(at, leg.middle, 2 * leg.half_length, 2 * leg.half_width, z + lift,
                                     z + biped->body.from_m);
        });
      };
      if (meets_at(biped->lift_m) && meets_at(biped->high_lift_m)) return true;
    }
    feet[side] = step;
  }
  return false;
}

struct Result {
  std::size_t goals = 0, mapped = 0, truth = 0, only_mapped = 0, only_truth = 0;
  std::size_t unsupported = 0, off_plane = 0, touching = 0, refuted = 0, unreachable = 0, budget = 0,
              steps = 0;
  std::vector<double> ms;
  double first_ms = 0;
};

void draw(const Options& options, const World& world, const Robot& robot, const FootstepPlan& plan) {
  if (options.pictures.empty() || plan.steps.empty()) return;
  std::filesystem::create_directories(options.pictures);
  PictureOptions picture;
  picture.force = true;
  picture.meshes = footprints(plan, robot);
  Eigen::AlignedBox3d box;
  for (const Standing& pose : plan.body) box.extend(pose.at);
  picture.target = box.center();
  const double away = 1.2 * box.diagonal().norm() + 1.5;
  picture.eye = box.center() + away * Eigen::Vector3d(-0.45, -0.55, 0.75);
  render_png(*world.mapped, options.pictures / (world.name + "_" + options.robot + ".png"), picture);
}

Result run(const Options& options, const World& world) {
  const Robot robot = options.robot == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  const ContactShape foot = std::visit([](const auto& kind) { return kind.foot; }, robot);
  FootstepPlanner on_map(world.mapped, world.octree, robot), on_truth(world.truth, world.true_octree, robot);
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  const auto standing = [&]() {
    for (;;) {  // where the planner on the truth says that one can stand
      Standing drawn = world.candidates[random() % world.candidates.size()];
      drawn.yaw_rad = turn(random);
      if (on_truth.plan(drawn, drawn).found()) return drawn;
    }
  };
  Result result;
  FootstepPlan longest;
  for (; result.goals < options.goals; ++result.goals) {
    const Standing from = standing();
    Standing to = standing();
    for (int tries = 0; (to.at - from.at).norm() < shortest_m && tries < 20; ++tries) to = standing();
    const FootstepPlan truth = on_truth.plan(from, to, options.budget);
    FootstepPlan mapped;
    (result.goals == 0 ? result.first_ms : result.ms.emplace_back()) =
        cpu_ms([&] { mapped = on_map.plan(from, to, options.budget); });
    result.truth += truth.found();
    result.mapped += mapped.found();
    result.only_mapped += mapped.found() && !truth.found();
    result.only_truth += truth.found() && !mapped.found();
    if (options.verbose && !mapped.found())
      std::fprintf(stderr, "%s %zu: %s; on the truth: %s\n", world.name.c_str(), result.goals,
                   mapped.refusal->sentence.c_str(),
                   truth.found() ? "found" : truth.refusal->sentence.c_str());
    if (!mapped.found()) {
      result.unreachable += mapped.refusal->why != NoPlan::Why::budget;
      result.budget += mapped.refusal->why == NoPlan::Why::budget;
      continue;
    }
    result.steps += mapped.steps.size();
    std::size_t off = 0;
    for (const Footstep& step : mapped.steps) {
      off += !supported(world, step, foot, EvaluationOptions{}.tolerance_at(world.mapped->resolution));
      result.off_plane += !supported(world, step, foot, within_m);
    }
    result.unsupported += off;
    const bool touch = touches(world, mapped, robot);
    result.touching += touch;
    const std::vector<std::string> wrong = verify_plan(mapped, *world.mapped, world.octree, robot);
    result.refuted += !wrong.empty();
    if (options.verbose && (off > 0 || touch || !wrong.empty()))
      std::fprintf(stderr, "%s %zu: %zu of %zu soles off%s%s\n", world.name.c_str(), result.goals, off,
                   mapped.steps.size(), touch ? ", touches" : "",
                   wrong.empty() ? "" : (", " + wrong.front()).c_str());
    if (mapped.steps.size() > longest.steps.size()) longest = mapped;
  }
  draw(options, world, robot, longest);
  return result;
}

/// The mesh of a terrain's name; empty for a scene. Nothing if the data are missing.
std::optional<std::filesystem::path> mesh_of(const std::string& scene) {
  for (const char* name : {"stairs", "stones", "office", "room", "corridor"})
    if (scene == name) return std::filesystem::path();
  const std::filesystem::path file =
      std::filesystem::path(OCTOSURF_DATA_DIR) / "terrain_meshes" / (scene + ".stl");
  if (!std::filesystem::exists(file)) return std::nullopt;
  return file;
}

void body(const Options& options) {
  TextTable table({"scene", "goals", "found", "truth's", "only map", "only truth", "steps", "soles off",
                   "touch", "refuted", "refused", "budget", "first ms", "p50", "p95"});
  nlohmann::json rows = nlohmann::json::array();
  for (const std::string& scene : options.scenes) {
    const auto mesh = mesh_of(scene);
    if (!mesh) {
      std::printf("%s: skipped, its mesh is missing\n", scene.c_str());
      continue;
    }
    const World world = make_world(options, scene, *mesh);
    const Result r = run(options, world);
    table.add({scene, std::to_string(r.goals), std::to_string(r.mapped), std::to_string(r.truth),
               std::to_string(r.only_mapped), std::to_string(r.only_truth), std::to_string(r.steps),
               std::to_string(r.unsupported), std::to_string(r.off_plane), std::to_string(r.touching),
               std::to_string(r.refuted), std::to_string(r.unreachable), std::to_string(r.budget),
               fixed(r.first_ms, 0), fixed(percentile(r.ms, 0.5), 1), fixed(percentile(r.ms, 0.95), 1)});
    rows.push_back({{"scene", scene},
                    {"robot", options.robot},
                    {"goals", r.goals},
                    {"found", r.mapped},
                    {"found_on_truth", r.truth},
                    {"steps", r.steps},
                    {"soles_off", r.unsupported},
                    {"soles_off_1cm_high", r.off_plane},
                    {"touching", r.touching},
                    {"first_ms", r.first_ms},
                    {"p50_ms", percentile(r.ms, 0.5)},
                    {"p95_ms", percentile(r.ms, 0.95)}});
    std::fprintf(stderr, "%s done\n", scene.c_str());
  }
  std::printf(
      "%s, seed %zu. \"truth's\": found by the same planner on what was seen of the true surfaces, and a "
      "noise-free octree; \"off\": steps of which a part lies more than 1 cm beside all true ground (3 cm "
      "off its plane counts as on it), \"1 cm\": or more than 1 cm off its plane; \"touch\": plans whose "
      "body or swinging leg meets a true "
      "point by more than 1 cm; \"refuted\": by verify_plan(); \"refused\": start or goal not standable, or "
      "proven unreachable; ms of CPU, the first plan with all preparation apart.\n%s",
      options.robot.c_str(), static_cast<std::size_t>(options.seed), table.text().c_str());
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"footstep plans over simulated scenes and terrains, judged by the truth"};
  app.add_option("--scenes", options.scenes, "scenes, and meshes of ../shared/data/terrain_meshes by name")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--goals", options.goals)->capture_default_str();
  app.add_option("--robot", options.robot)
      ->check(CLI::IsMember({"biped", "quadruped"}))
      ->capture_default_str();
  app.add_option("--budget", options.budget.expansions, "expansions to find a plan")->capture_default_str();
  app.add_option("--improving", options.budget.improving, "further ones to find a better one")
      ->capture_default_str();
  app.add_option("--pictures", options.pictures, "folder for one picture of each scene");
  app.add_option("--json", options.json, "write the numbers there");
  app.add_flag("--verbose", options.verbose, "tell what was refused and why");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
