// Footstep plans over simulated scenes and terrains, judged by the truth: is every sole on true ground, does
// anything touch, and are as many goals reached as by the same planner on the true surfaces.

#include "bench/bench.hpp"
#include "evaluation/evaluate.hpp"
#include "footsteps/swing.hpp"

#include <Eigen/Dense>
#include <boost/polygon/polygon.hpp>
#include <ctime>

#include <octosurf/footsteps.hpp>

namespace octosurf::bench {
namespace {

using footsteps::SwingPose;

constexpr double touch_m = 0.01;   // so deep in a box is a touch: truth is sampled every centimetre
constexpr double within_m = 0.01;  // of true ground every part of a sole lies
constexpr double sample_m = 0.01;  // of soles and of true faces
constexpr double level = 0.86;     // cosine of the steepest ground that goals are drawn on (30°)

/// Above the ids that voxels can have: the true octree's are those of the mapper that made it.
constexpr SurfaceId first_true_id = 1 << 24;

namespace bp = boost::polygon;
constexpr double unit = 1e-5;  // m
int to_units(double v) { return static_cast<int>(std::lround(v / unit)); }

template <typename Points>
Ring2 ring_from(const Points& points) {
  Ring2 ring;
  for (const bp::point_data<int>& p : points) ring.emplace_back(p.x() * unit, p.y() * unit);
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();  // Boost repeats the first
  return ring;
}

/// The seen part of a true face, gaps up to the mapper's largest hole closed: nobody can plan over what
/// nobody saw.
std::vector<Polygon> seen_part(const evaluation::TrueFace& face, double cell) {
  constexpr int half_hole = 4000;  // units: h / 2
  bp::polygon_90_set_data<int> cells;
  for (const evaluation::CellRun& run : face.visible)
    bp::operators::operator+=(
        cells,
        bp::rectangle_data<int>(to_units(run.column * cell), to_units(run.row * cell),
                                to_units((run.column + run.count) * cell), to_units((run.row + 1) * cell)));
  cells.bloat(half_hole, half_hole, half_hole, half_hole);
  cells.shrink(half_hole, half_hole, half_hole, half_hole);
  std::vector<bp::rectangle_data<int>> rectangles;
  cells.get_rectangles(rectangles);
  bp::polygon_set_data<int> seen, whole;
  for (const auto& rectangle : rectangles) seen.insert(rectangle);
  const auto insert = [&](const Ring2& ring, bool hole) {
    std::vector<bp::point_data<int>> points;
    for (const Eigen::Vector2d& p : ring) points.emplace_back(to_units(p.x()), to_units(p.y()));
    whole.insert(bp::polygon_data<int>(points.begin(), points.end()), hole);
  };
  for (const Polygon& polygon : face.polygons) {
    insert(polygon.outer, false);
    for (const Ring2& hole : polygon.holes) insert(hole, true);
  }
  bp::operators::operator&=(seen, whole);
  std::vector<bp::polygon_with_holes_data<int>> parts;
  seen.get(parts);
  std::vector<Polygon> polygons;
  for (const auto& part : parts) {
    polygons.push_back({ring_from(part), {}});
    for (auto hole = part.begin_holes(); hole != part.end_holes(); ++hole)
      polygons.back().holes.push_back(ring_from(*hole));
  }
  return polygons;
}

std::shared_ptr<const Snapshot> true_surfaces(const evaluation::Truth& truth) {
  auto snapshot = std::make_shared<Snapshot>();
  for (const evaluation::TrueFace& face : truth.faces) {
    if (face.gone || face.visible.empty() || face.plane.normal.z() < level) continue;
    auto surface = std::make_shared<Surface>();
    surface->id = first_true_id + face.id;
    surface->plane = face.plane;
    surface->T_map_surface = face.T_map_face;
    surface->polygons = seen_part(face, truth.cell);
    for (const Polygon& polygon : surface->polygons) surface->area_m2 += evaluation::enclosed_area(polygon);
    if (!surface->polygons.empty()) snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

/// What stands, as points, in columns of 10 cm: true faces, and noise-free readings for what has none.
class TruePoints {
 public:
  void add(const Eigen::Vector3d& p) { columns_[column(p.x(), p.y())].push_back(p); }

  /// One lies in the box about `middle` of `pose` by more than a centimetre. Bottom and top of the box are at
  /// those heights over its middle, and rise by `rise`, m along x and y.
  bool in_box(const SwingPose& pose, const Eigen::Vector2d& middle, const Eigen::Vector2d& half,
              double from_z, double to_z, const Eigen::Vector2d& rise = Eigen::Vector2d::Zero()) const {
    const Eigen::Rotation2Dd turn(pose.yaw_rad);
    const Eigen::Vector2d center = pose.at + turn * middle;
    const double reach = half.norm();
    for (double x = center.x() - reach; x <= center.x() + reach + cell; x += cell)
      for (double y = center.y() - reach; y <= center.y() + reach + cell; y += cell) {
        const auto found = columns_.find(column(x, y));
        if (found == columns_.end()) continue;
        for (const Eigen::Vector3d& p : found->second) {
          const double z = p.z() - rise.dot(p.head<2>() - center);
          if (z < from_z + touch_m || z > to_z - touch_m) continue;
          const Eigen::Vector2d d = turn.inverse() * (p.head<2>() - center);
          if ((d.cwiseAbs().array() < half.array() - touch_m).all()) return true;
        }
      }
    return false;
  }

 private:
  static constexpr double cell = 0.1;
  static std::uint64_t column(double x, double y) {
    const auto at = [](double v) {
      return static_cast<std::uint32_t>(static_cast<int>(std::floor(v / cell)));
    };
    return std::uint64_t{at(x)} << 32 | at(y);
  }
  std::unordered_map<std::uint64_t, std::vector<Eigen::Vector3d>> columns_;
};

/// A scene, mapped and true.
struct World {
  std::shared_ptr<const Snapshot> mapped, truth;
  OccupancyView octree, true_octree;
  std::vector<Face> ground;
  TruePoints points;
  std::vector<Standing> candidates;  ///< seen level ground
};

World make_world(const Recorded& recorded) {
  const simulation::Recording& recording = *recorded.simulated;
  World world;
  Mapper mapper = mapped(recorded, Options{}), true_mapper;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const simulation::Readings ideal = recording.ideal(i);
    const Eigen::Isometry3d T = recording.true_pose(i);
    Scan scan = recorded.scans[i];  // as it would be without noise
    scan.T_map_sensor = T;
    scan.points.clear();
    for (std::size_t k = 0; k < ideal.t.size(); ++k) {
      if (ideal.t[k] <= 0) continue;
      scan.points.emplace_back(ideal.t[k] * recording.rays()[k]);
      if (k % 7 == 0 && ideal.labels[k] == 0) world.points.add(T * scan.points.back().cast<double>());
    }
    true_mapper.insert(scan);
  }
  mapper.drain();
  true_mapper.drain();
  world.mapped = mapper.snapshot();
  world.octree = mapper.map().octree();
  world.true_octree = true_mapper.map().octree();
  world.truth = true_surfaces(recorded.truth);
  world.ground = standing_faces(recorded.truth);
  for (const Face& one : world.ground) {
    const evaluation::TrueFace& face = *one.truth;
    one.for_each_point(sample_m, [&](const Eigen::Vector3d& p) { world.points.add(p); });
    if (face.plane.normal.z() < level) continue;
    for (const evaluation::CellRun& run : face.visible)
      for (int i = 0; i < run.count; i += 5)
        if (run.row % 5 == 0)
          world.candidates.push_back(
              {face.T_map_face *
                   (recorded.truth.cell * Eigen::Vector3d(run.column + i + 0.5, run.row + 0.5, 0)),
               0});
  }
  return world;
}

/// Every point of the sole lies over a true face or within a centimetre beside it, and at most so far off its
/// plane.
bool supported(const World& world, const Footstep& foot, const std::vector<Eigen::Vector2d>& sole,
               double off_plane) {
  return std::ranges::all_of(sole, [&](const Eigen::Vector2d& p) {
    return off_outlines(world.ground, foot.T_map_foot * Eigen::Vector3d(p.x(), p.y(), 0),
                        foot.T_map_foot.linear().col(2), off_plane, 2 * within_m) <= within_m;
  });
}

/// `meets(pose, share)` somewhere on the straight way from one pose to the other.
template <class Meets>
bool on_way(const SwingPose& a, const SwingPose& b, const Meets& meets) {
  const double turn = footsteps::turn_between(a.yaw_rad, b.yaw_rad);
  for (int i = 0; i <= 20; ++i)
    if (meets(SwingPose{a.at + i / 20.0 * (b.at - a.at), a.yaw_rad + i / 20.0 * turn}, i / 20.0)) return true;
  return false;
}

double height(const Footstep& foot) { return foot.T_map_foot.translation().z(); }
SwingPose pose_of(const Footstep& foot) { return {foot.T_map_foot.translation().head<2>(), foot.yaw_rad}; }
SwingPose pose_of(const Standing& body) { return {body.at.head<2>(), body.yaw_rad}; }
Eigen::Vector2d half_of(const BodyBox& body) { return {body.length_m / 2, body.width_m / 2}; }

/// A robot's leg on its way at both heights at which it may lift its foot over `ground`.
template <class Kind>
bool leg_touches(const World& world, const Kind& robot, const SwingPose& from, const SwingPose& to,
                 double ground) {
  const footsteps::LegBox leg = footsteps::LegBox::of(robot.foot);
  const auto meets_at = [&](double lift) {
    return on_way(from, to, [&](const auto& at, double) {
      return world.points.in_box(at, leg.middle, {leg.half_length, leg.half_width}, ground + lift,
                                 ground + std::max(lift, robot.body.from_m));
    });
  };
  return meets_at(robot.lift_m) && meets_at(robot.high_lift_m);
}

/// The body's box or a swinging leg meets a true point. A biped's body is upright.
bool touches(const World& world, const FootstepPlan& plan, const Biped& robot) {
  const BodyBox& body = robot.body;
  for (std::size_t i = 1; i < plan.body.size(); ++i) {
    const Standing &a = plan.body[i - 1], &b = plan.body[i];
    if (on_way(pose_of(a), pose_of(b), [&](const auto& pose, double share) {
          const double z = a.at.z() + share * (b.at.z() - a.at.z());
          return world.points.in_box(pose, {0, 0}, half_of(body), z + body.from_m, z + body.to_m);
        }))
      return true;
  }
  std::array<Footstep, 2> feet{plan.start[0], plan.start[1]};
  for (const Footstep& foot : plan.steps) {
    const auto side = static_cast<std::size_t>(foot.foot);
    const Footstep &stance = feet[1 - side], &before = feet[side];
    const Eigen::Vector2d left(-std::sin(stance.yaw_rad), std::cos(stance.yaw_rad));
    SwingPose beside = pose_of(stance);
    beside.at += (side == 0 ? 1 : -1) * robot.stance_width_m * left;
    if (leg_touches(world, robot, pose_of(before), beside, std::max(height(stance), height(before))) ||
        leg_touches(world, robot, beside, pose_of(foot), std::max(height(stance), height(foot))))
      return true;
    feet[side] = foot;
  }
  return false;
}

/// Height and rise of the plane through four feet: a, b, c of z = a x + b y + c.
Eigen::Vector3d plane_through(const std::array<Footstep, 4>& feet) {
  Eigen::Matrix<double, 4, 3> A;
  Eigen::Vector4d z;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d p = feet[static_cast<std::size_t>(i)].T_map_foot.translation();
    A.row(i) << p.x(), p.y(), 1;
    z[i] = p.z();
  }
  return A.colPivHouseholderQr().solve(z);
}

/// Likewise. A quadruped's body leans as the plane through its four feet does, as that of its planner.
bool touches(const World& world, const FootstepPlan& plan, const Quadruped& robot) {
  const BodyBox& body = robot.body;
  std::array<Footstep, 4> feet;
  const auto leg_of = [](const Footstep& foot) {
    return static_cast<std::size_t>(foot.foot) - static_cast<std::size_t>(FootName::front_left);
  };
  for (const Footstep& foot : plan.start) feet.at(leg_of(foot)) = foot;
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    // While the body moves over to where the step is taken, and while it is, the feet stand as before it.
    const Eigen::Vector3d plane = plane_through(feet);
    const auto body_meets = [&](const SwingPose& pose, double) {
      const double z = plane.z() + plane.head<2>().dot(pose.at);
      return world.points.in_box(pose, {0, 0}, half_of(body), z + body.from_m, z + body.to_m,
                                 plane.head<2>());
    };
    if (on_way(pose_of(plan.body[i]), pose_of(plan.body[i + 1]), body_meets)) return true;
    Footstep& foot = feet.at(leg_of(plan.steps[i]));
    SwingPose from = pose_of(foot), to = pose_of(plan.steps[i]);
    from.yaw_rad = to.yaw_rad = 0;  // a ball's
    if (leg_touches(world, robot, from, to, std::max(height(foot), height(plan.steps[i])))) return true;
    foot = plan.steps[i];
  }
  return false;
}

/// Counts of all goals of one world.
Json plan_in(const World& world, const Options& options, std::uint64_t seed) {
  constexpr double shortest_m = 1;  // between start and goal
  const PlanBudget budget;
  const Robot robot = options.robot == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  const std::vector<Eigen::Vector2d> sole =
      points_of(std::visit([](const auto& kind) { return kind.foot; }, robot), 0);
  FootstepPlanner on_map(world.mapped, world.octree, robot), on_truth(world.truth, world.true_octree, robot);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  const auto standing = [&]() {
    for (;;) {  // where the planner on the truth says that one can stand
      Standing drawn = world.candidates[random() % world.candidates.size()];
      drawn.yaw_rad = turn(random);
      if (on_truth.plan(drawn, drawn).found()) return drawn;
    }
  };
  Counts count{"found",     "ways",          "truth", "only_map", "only_truth", "steps",
               "soles_off", "soles_off_1cm", "touch", "refuted",  "refused",    "budget"};
  std::vector<double> ms, over_bound;
  for (std::size_t goal = 0; goal < options.count; ++goal) {
    const Standing from = standing();
    Standing to = standing();
    for (int tries = 0; (to.at - from.at).norm() < shortest_m && tries < 100; ++tries) to = standing();
    const FootstepPlan truth = on_truth.plan(from, to, budget);
    const std::clock_t start = std::clock();  // CPU time: other work may share the machine
    const FootstepPlan plan = on_map.plan(from, to, budget);
    ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    const bool found = plan.found();
    count["truth"] += truth.found();
    count["found"] += found;
    count["ways"] += found || (options.way > 0 && on_map.plan(from, to, {options.way, 0, {}}).found());
    count["only_map"] += found && !truth.found();
    count["only_truth"] += truth.found() && !found;
    if (!found) {
      ++count[plan.refusal->why == NoPlan::Why::budget ? "budget" : "refused"];
      continue;
    }
    count["steps"] += plan.steps.size();
    if (plan.lower_bound > 0) over_bound.push_back(plan.cost / plan.lower_bound);
    const double near = evaluation::EvaluationOptions{}.tolerance_at(world.mapped->resolution);
    for (const Footstep& foot : plan.steps) {
      count["soles_off"] += !supported(world, foot, sole, near);
      count["soles_off_1cm"] += !supported(world, foot, sole, within_m);
    }
    count["touch"] += std::visit([&](const auto& kind) { return touches(world, plan, kind); }, robot);
    count["refuted"] += !verify_plan(plan, *world.mapped, world.octree, robot).empty();
  }
  Json result{{"robot", options.robot}, {"goals", options.count}};
  result.update(count.row);
  if (!over_bound.empty()) result["over_bound_p50"] = percentile(over_bound, 0.5);
  if (ms.empty()) return result;
  result["first_ms"] = ms.front();  // with all preparation
  ms.erase(ms.begin());
  result["p50_ms"] = percentile(ms, 0.5);
  result["p95_ms"] = percentile(ms, 0.95);
  return result;
}

}  // namespace

void plans(const Options& options) {
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    write(recording, plan_in(make_world(recorded), options, recording.at("seed").get<std::uint64_t>()));
  });
}

}  // namespace octosurf::bench
