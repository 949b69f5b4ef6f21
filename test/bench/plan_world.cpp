#include "bench/plan_world.hpp"

#include "evaluation/truth.hpp"
#include "simulation/recording.hpp"

#include <algorithm>
#include <array>
#include <boost/polygon/polygon.hpp>
#include <tuple>

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
                        double width, double from_z, double to_z) const {
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

}  // namespace octosurf::bench
