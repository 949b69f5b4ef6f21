#include "publications.hpp"

#include "geometry/degrees.hpp"
#include "geometry/voxel_grid.hpp"
#include "io/exporters/planner_messages.hpp"
#include "messages.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>

#include <octosurf/planner_formats.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf::node {
namespace {

/// Share of the radius that the robot moves before the box around it does: not with every scan.
constexpr double box_follows = 0.125;

}  // namespace

GroundRules rules_of(const NodeOptions& options, const Eigen::Vector3d& up, double resolution) {
  GroundRules rules = GroundRules::of(Quadruped{}, resolution);
  rules.foot = ContactShape::disc(options.foot_radius_m);
  rules.limits.up = up;
  rules.limits.max_slope_rad = options.max_slope_deg * rad_per_deg;
  rules.limits.clearance_m = options.clearance_m;
  if (options.clearance_m <= 0) rules.limits.obstacle_margin_m = rules.limits.unknown_to_m = 0;
  return rules;
}

Publications::Topic Publications::latched(Middleware& middleware, const char* topic, const char* type) const {
  return {topic, middleware.advertise(options_.name + "/" + topic, type, Profile::latched)};
}

Publications::Publications(Middleware& middleware, const Mapping& mapping, const NodeOptions& options,
                           std::function<InputState()> inputs)
    : mapping_(mapping),
      options_(options),
      inputs_(std::move(inputs)),
      surfaces_(latched(middleware, "surfaces", "octosurf_msgs/Surfaces")),
      stairs_(latched(middleware, "stairs", "octosurf_msgs/Stairs")),
      markers_(latched(middleware, "markers", "visualization_msgs/MarkerArray")),
      terrain_(latched(middleware, "planar_terrain", "convex_plane_decomposition_msgs/PlanarTerrain")),
      octomap_(latched(middleware, "octomap_binary", "octomap_msgs/Octomap")),
      grid_map_(latched(middleware, "grid_map", "grid_map_msgs/GridMap")),
      status_(latched(middleware, "status", "octosurf_msgs/Status")),
      map_thread_([this](const std::stop_token& stop) { run(stop, [this] { publish_map(); }); }),
      // Large messages may wait for slow readers; what the node does is published meanwhile.
      status_thread_([this](const std::stop_token& stop) { run(stop, [this] { publish_status(); }); }) {}

void Publications::run(const std::stop_token& stop, const std::function<void()>& work) const {
  std::mutex mutex;
  std::condition_variable_any never;  // notified; only the stop ends the wait early
  const std::chrono::duration<double> period(options_.publish_s);
  while (!stop.stop_requested()) {
    work();
    std::unique_lock lock(mutex);
    never.wait_for(lock, stop, period, [] { return false; });
  }
}

void Publications::publish_all(double radius) {
  const std::lock_guard lock(mutex_);
  all_within_m_ = radius;
}

/// For example a grid of too many cells: reported once in a row.
void Publications::tell(const std::string& what, const std::exception& error) {
  const std::string problem = what + ": " + error.what();
  if (problem != problem_) std::fprintf(stderr, "warning: not published: %s\n", problem.c_str());
  problem_ = problem;
}

/// It has subscribers, and has changed since it was last sent.
bool Publications::is_due(const Topic& topic) const {
  return all_ || (topic.out->subscribers() > 0 && topic.sent != look_);
}

/// If due. It stays due while readers are too slow.
void Publications::publish(Topic& topic, const Write& message) try {
  if (!is_due(topic)) return;
  std::string cdr = io::cdr_of(message);
  const std::size_t size = cdr.size();
  if (!topic.out->publish(std::move(cdr))) return;
  bytes_ += size;
  topic.sent = look_;
} catch (const std::exception& error) {
  tell(topic.name, error);
}

Publications::Part Publications::part_of(const MapMoment& moment, double radius) {
  Part part{{}, *moment.snapshot};
  if (!(radius > 0) || !moment.sensor) return part;
  if (!middle_ || (*middle_ - *moment.sensor).norm() > box_follows * radius) middle_ = moment.sensor;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(radius);
  part.box = {*middle_ - half, *middle_ + half};
  const std::vector<SurfaceId> near = mapping_.asked(moment)->index.in(ConvexSpace::box(part.box));
  std::erase_if(part.snapshot.surfaces,
                [&](const SurfacePtr& surface) { return !std::ranges::binary_search(near, surface->id); });
  std::erase_if(part.snapshot.cylinders, [&](const CylinderPtr& cylinder) {
    return !part.box.intersects(planning::extent_of(*cylinder));
  });
  return part;
}

Publications::Look Publications::look_of(const MapMoment& moment, const Part& part) {
  Look look;
  for (const SurfacePtr& surface : part.snapshot.surfaces)
    look.surfaces.emplace_back(surface->id, surface->revision);
  for (const CylinderPtr& cylinder : part.snapshot.cylinders)
    look.cylinders.emplace_back(cylinder->id, cylinder->revision);
  look.octree = look_.octree;
  const OccupancyView& octree = moment.snapshot->octree;
  const double d = octree.resolution();
  bool changed = d != octree_.resolution();
  if (d > 0 && !changed)
    octree.for_each_changed_cube(octree_, [&](const std::array<std::uint16_t, 3>& corner, int level) {
      const Eigen::Vector3d low = geometry::VoxelGrid(d).corner_of({corner[0], corner[1], corner[2]});
      const double edge = d * static_cast<double>(1 << level);
      changed |= part.box.isEmpty() || part.box.intersects({low, low + Eigen::Vector3d::Constant(edge)});
    });
  look.octree += changed ? 1 : 0;
  octree_ = octree;
  return look;
}

void Publications::publish_map() try {
  const auto begin = std::chrono::steady_clock::now();
  const std::string& frame = options_.frame;
  const MapMoment moment = mapping_.moment();
  double radius = options_.radius_m;
  {
    const std::lock_guard lock(mutex_);
    all_ = all_within_m_.has_value();
    radius = std::exchange(all_within_m_, {}).value_or(radius);
  }
  const std::array<const Topic*, 6> topics{&surfaces_, &stairs_, &markers_, &terrain_, &octomap_, &grid_map_};
  if (!all_ && std::ranges::all_of(topics, [](const Topic* one) { return one->out->subscribers() == 0; }))
    return;
  const auto middle = middle_;
  const Part part = part_of(moment, radius);
  if (moment.snapshot != last_ || middle != middle_) {
    const bool moved = middle != middle_;
    look_ = look_of(moment, part);
    look_.octree += moved ? 1 : 0;
    last_ = moment.snapshot;
  }
  publish(surfaces_,
          [&](io::MessageWriter& out) { write_surfaces(out, part.snapshot, frame, moment.stamp_ns); });
  publish(stairs_, [&](io::MessageWriter& out) {
    Stairs stairs = mapping_.asked(moment)->bare_ground().stairs();
    const auto far = [&](const Step& step) {
      return !part.box.isEmpty() &&
             !part.box.intersects({step.edge[0].cwiseMin(step.edge[1]), step.edge[0].cwiseMax(step.edge[1])});
    };
    std::erase_if(stairs.stairs, [&](const Stair& stair) { return std::ranges::all_of(stair.steps, far); });
    std::erase_if(stairs.single_steps, far);
    write_stairs(out, stairs, part.snapshot, frame, moment.stamp_ns);
  });
  publish(markers_,
          [&](io::MessageWriter& out) { write_markers(out, part.snapshot, frame, moment.stamp_ns); });
  if (part.snapshot.octree.resolution() > 0)
    publish(octomap_, [&](io::MessageWriter& out) {
      write_octomap(out, part.snapshot.octree, part.box, frame, moment.stamp_ns);
    });
  if (is_due(grid_map_) || is_due(terrain_)) publish_ground(moment, part);
  map_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
} catch (const std::exception& error) {
  tell("map", error);
}

void Publications::publish_ground(const MapMoment& moment, const Part& part) {
  const GroundView view =
      mapping_.asked(moment)->ground(rules_of(options_, moment.up, moment.snapshot->resolution));
  PlannerContact contact;
  contact.shape = view.rules().foot;
  contact.limits = view.rules().limits;
  Snapshot ground = part.snapshot;
  for (SurfacePtr& surface : ground.surfaces) surface = view.solid(surface->id);
  HeightGridOptions wanted;
  wanted.max_slope_rad = options_.max_slope_deg * rad_per_deg;
  wanted.cell = std::max(options_.grid_cell_m, ground.resolution);
  if (!part.box.isEmpty()) wanted.within = {part.box.min().head<2>(), part.box.max().head<2>()};
  const HeightGrid grid = height_grid(ground, wanted);
  if (grid.elevation.size() == 0) return;  // nothing level yet
  publish(grid_map_, [&](io::MessageWriter& out) {
    io::write_grid_map(out, grid, io::layers_of(grid), options_.frame, moment.stamp_ns);
  });
  publish(terrain_, [&](io::MessageWriter& out) {
    const auto surfaces = planner_surfaces(ground, contact, &ground.octree);
    io::write_planar_terrain(out, io::terrain_regions(surfaces), grid, options_.frame, moment.stamp_ns);
  });
}

void Publications::publish_status() try {
  const MappingCounts counts = mapping_.counts();
  const InputState inputs = inputs_();
  const MapMoment moment = mapping_.moment();
  status_.out->publish(io::cdr_of([&](io::MessageWriter& out) {
    out.message("header", io::header(options_.frame, moment.stamp_ns), "revision", moment.snapshot->revision,
                "surfaces", static_cast<std::uint32_t>(moment.snapshot->surfaces.size()), "received",
                counts.received, "waiting", counts.waiting, "mapped", counts.mapped, "rejected",
                counts.rejected, "refused", counts.refused, "dropped", counts.dropped, "lost", inputs.lost,
                "transforms", counts.transforms, "messages_refused", counts.messages_refused,
                "scan_publishers", inputs.scan_publishers, "camera_publishers", inputs.camera_publishers,
                "transform_publishers", inputs.transform_publishers, "last_refusal", counts.last_refusal,
                "scan_ms", counts.scan_ms, "contradiction", counts.contradiction, "published_bytes",
                bytes_.load(), "publish_ms", map_ms_.load());
  }));
} catch (const std::exception& error) {
  std::fprintf(stderr, "warning: no status: %s\n", error.what());
}

}  // namespace octosurf::node
