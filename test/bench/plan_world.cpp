#include "bench/plan_world.hpp"

#include "evaluation/truth.hpp"
#include "simulation/recording.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/polygon/polygon.hpp>

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

constexpr double touch_m = 0.01;   // so deep in a box is a touch: truth is sampled every centimetre
constexpr double sample_m = 0.01;  // of soles and of true faces
constexpr double level = 0.86;     // cosine of the steepest ground that goals are drawn on (30°)

/// Above the ids that voxels can have: the true octree's are those of the mapper that made it.
constexpr SurfaceId first_true_id = 1 << 24;

/// The seen part of a true face, gaps up to the mapper's largest hole closed: nobody can plan over what
/// nobody saw.
std::vector<Polygon> seen_part(const evaluation::TrueFace& face, double cell) {
  using namespace boost::polygon::operators;
  constexpr double unit = 1e-5;    // m
  constexpr int half_hole = 4000;  // units: h / 2
  const auto integer = [](double v) { return static_cast<int>(std::lround(v / unit)); };
  boost::polygon::polygon_90_set_data<int> cells;
  for (const evaluation::CellRun& run : face.visible)
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

std::shared_ptr<const Snapshot> snapshot_of(const evaluation::Truth& truth) {
  auto snapshot = std::make_shared<Snapshot>();
  for (const evaluation::TrueFace& face : truth.faces) {
    if (face.gone || face.visible.empty() || face.plane.normal.z() < level) continue;
    auto surface = std::make_shared<Surface>();
    surface->id = first_true_id + face.id;
    surface->plane = face.plane;
    surface->T_map_surface = face.T_map_face;
    surface->polygons = seen_part(face, truth.cell);
    for (const Polygon& polygon : surface->polygons) {
      surface->area_m2 += evaluation::enclosed_area(polygon.outer);
      for (const Ring2& hole : polygon.holes) surface->area_m2 -= evaluation::enclosed_area(hole);
    }
    if (!surface->polygons.empty()) snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

/// Scan i without noise, as it was seen.
Scan ideal_scan(const simulation::Recording& recording, std::size_t i, const simulation::Readings& ideal) {
  Scan scan = recording.labelled_scan(i, ideal).scan;
  scan.T_map_sensor = recording.true_pose(i);
  scan.points.clear();
  for (std::size_t k = 0; k < ideal.t.size(); ++k)
    if (ideal.t[k] > 0) scan.points.emplace_back(ideal.t[k] * recording.rays()[k]);
  return scan;
}

}  // namespace

bool TruePoints::in_box(const footsteps::SwingPose& pose, const Eigen::Vector2d& middle, double length,
                        double width, double from_z, double to_z, const Eigen::Vector2d& rise) const {
  const Eigen::Rotation2Dd turn(pose.yaw_rad);
  const Eigen::Vector2d center = pose.at + turn * middle;
  const double half = std::hypot(length, width) / 2;
  for (double x = center.x() - half; x <= center.x() + half + cell; x += cell)
    for (double y = center.y() - half; y <= center.y() + half + cell; y += cell) {
      const auto found = columns_.find(key({x, y}));
      if (found == columns_.end()) continue;
      for (const Eigen::Vector3d& p : found->second) {
        const double z = p.z() - rise.dot(p.head<2>() - center);
        if (z < from_z + touch_m || z > to_z - touch_m) continue;
        const Eigen::Vector2d d = turn.inverse() * (p.head<2>() - center);
        if (std::abs(d.x()) < length / 2 - touch_m && std::abs(d.y()) < width / 2 - touch_m) return true;
      }
    }
  return false;
}

World make_world(const std::string& scene, const std::filesystem::path& mesh, std::uint64_t seed) {
  simulation::SimulationOptions simulation;
  simulation.seed = seed;
  if (mesh.empty()) {
    simulation.scene = scene;
  } else {
    simulation.mesh = mesh;
    simulation.frames = 300;
  }
  const simulation::Recording recording(simulation);
  simulation::Recording::Visibility visibility = recording.visibility();
  World world;
  world.name = scene;
  Mapper mapper, true_mapper;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const simulation::Readings ideal = recording.ideal(i);
    visibility.add(i, ideal);
    mapper.insert(recording.labelled_scan(i, ideal).scan);
    true_mapper.insert(ideal_scan(recording, i, ideal));
    const Eigen::Isometry3d T = recording.true_pose(i);
    for (std::size_t k = 0; k < ideal.t.size(); k += 7)
      if (ideal.t[k] > 0 && ideal.labels[k] == 0)
        world.points.add(T * (ideal.t[k] * recording.rays()[k]).cast<double>());
  }
  mapper.drain();
  true_mapper.drain();
  world.mapped = mapper.snapshot();
  world.octree = mapper.map().octree();
  world.true_octree = true_mapper.map().octree();
  const evaluation::Truth truth = visibility.truth();
  world.truth = snapshot_of(truth);
  for (const evaluation::TrueFace& face : truth.faces) {
    if (face.gone) continue;
    world.ground.push_back({face.plane, face.T_map_face.inverse(), evaluation::PlanarRegion(face.polygons)});
    world.ground.back().region.for_each_cell(sample_m, [&](const Eigen::Vector2d& uv) {
      world.points.add(face.T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0));
    });
    if (face.plane.normal.z() < level) continue;
    for (const evaluation::CellRun& run : face.visible)
      for (int i = 0; i < run.count; i += 5)
        if (run.row % 5 == 0)
          world.candidates.push_back({face.T_map_face * Eigen::Vector3d((run.column + i + 0.5) * truth.cell,
                                                                        (run.row + 0.5) * truth.cell, 0),
                                      0});
  }
  return world;
}

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

namespace {

/// `meets(pose, share)` somewhere on the straight way from one pose to the other.
template <class Meets>
bool on_way(const footsteps::SwingPose& a, const footsteps::SwingPose& b, const Meets& meets) {
  const double turn = footsteps::turn_between(a.yaw_rad, b.yaw_rad);
  for (int i = 0; i <= 20; ++i)
    if (meets(footsteps::SwingPose{a.at + i / 20.0 * (b.at - a.at), a.yaw_rad + i / 20.0 * turn}, i / 20.0))
      return true;
  return false;
}

footsteps::SwingPose pose_of(const Footstep& foot) {
  return {foot.T_map_foot.translation().head<2>(), foot.yaw_rad};
}
footsteps::SwingPose pose_of(const Standing& body) { return {body.at.head<2>(), body.yaw_rad}; }

/// A leg on its way at both heights at which a robot may lift its foot over `ground`.
bool leg_touches(const World& world, const footsteps::LegBox& leg, const footsteps::SwingPose& from,
                 const footsteps::SwingPose& to, double ground, const footsteps::Lift& lift) {
  const auto meets_at = [&](double height) {
    return on_way(from, to, [&](const auto& at, double) {
      return world.points.in_box(at, leg.middle, 2 * leg.half_length, 2 * leg.half_width, ground + height,
                                 ground + std::max(height, lift.hip));
    });
  };
  return meets_at(lift.usual) && meets_at(lift.high);
}

bool body_touches(const World& world, const BodyBox& body, const Standing& a, const Standing& b) {
  return on_way(pose_of(a), pose_of(b), [&](const auto& pose, double share) {
    const double z = a.at.z() + share * (b.at.z() - a.at.z());
    return world.points.in_box(pose, {0, 0}, body.length_m, body.width_m, z + body.from_m, z + body.to_m);
  });
}

bool touches(const World& world, const FootstepPlan& plan, const Biped& robot) {
  for (std::size_t i = 1; i < plan.body.size(); ++i)
    if (body_touches(world, robot.body, plan.body[i - 1], plan.body[i])) return true;
  const footsteps::LegBox leg = footsteps::LegBox::of(robot.foot);
  const footsteps::Lift lift{robot.lift_m, robot.high_lift_m, robot.body.from_m};
  std::array<Footstep, 2> feet{plan.start[0], plan.start[1]};
  for (const Footstep& step : plan.steps) {
    const auto side = static_cast<std::size_t>(step.foot);
    const Footstep &stance = feet[1 - side], &before = feet[side];
    const Eigen::Vector2d left(-std::sin(stance.yaw_rad), std::cos(stance.yaw_rad));
    footsteps::SwingPose beside = pose_of(stance);
    beside.at += (side == 0 ? 1 : -1) * robot.stance_width_m * left;
    const double z = stance.T_map_foot.translation().z();
    if (leg_touches(world, leg, pose_of(before), beside, std::max(z, before.T_map_foot.translation().z()),
                    lift) ||
        leg_touches(world, leg, beside, pose_of(step), std::max(z, step.T_map_foot.translation().z()), lift))
      return true;
    feet[side] = step;
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

bool touches(const World& world, const FootstepPlan& plan, const Quadruped& robot) {
  const footsteps::LegBox leg = footsteps::LegBox::of(robot.foot);
  const footsteps::Lift lift{robot.lift_m, robot.high_lift_m, robot.body.from_m};
  std::array<Footstep, 4> feet;
  const auto leg_of = [](const Footstep& foot) {
    return static_cast<std::size_t>(foot.foot) - static_cast<std::size_t>(FootName::front_left);
  };
  for (const Footstep& foot : plan.start) feet.at(leg_of(foot)) = foot;
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    // While the body moves over to where the step is taken, and while it is, the feet stand as before it.
    const Eigen::Vector3d plane = plane_through(feet);
    const auto body_meets = [&](const footsteps::SwingPose& pose, double) {
      const double z = plane.z() + plane.head<2>().dot(pose.at);
      return world.points.in_box(pose, {0, 0}, robot.body.length_m, robot.body.width_m, z + robot.body.from_m,
                                 z + robot.body.to_m, plane.head<2>());
    };
    if (on_way(pose_of(plan.body[i]), pose_of(plan.body[i + 1]), body_meets)) return true;
    Footstep& foot = feet.at(leg_of(plan.steps[i]));
    footsteps::SwingPose from = pose_of(foot), to = pose_of(plan.steps[i]);
    from.yaw_rad = to.yaw_rad = 0;  // a ball's
    if (leg_touches(world, leg, from, to,
                    std::max(foot.T_map_foot.translation().z(), plan.steps[i].T_map_foot.translation().z()),
                    lift))
      return true;
    foot = plan.steps[i];
  }
  return false;
}

}  // namespace

bool touches(const World& world, const FootstepPlan& plan, const Robot& robot) {
  return std::visit([&](const auto& kind) { return touches(world, plan, kind); }, robot);
}

}  // namespace octosurf::bench
