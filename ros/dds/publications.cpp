#include "publications.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/grid_map_message.hpp"
#include "io/exporters/planar_terrain_message.hpp"
#include "messages.hpp"

#include <condition_variable>
#include <cstdio>
#include <mutex>

#include <octosurf/ground.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf::dds {
namespace {

/// Of the planar terrain, which is of z up (REP 103).
GroundRules rules_of(const NodeOptions& options, const Eigen::Vector3d& up, double resolution) {
  GroundRules rules = GroundRules::of(Quadruped{}, resolution);
  rules.foot = ContactShape::disc(options.foot_radius_m);
  rules.limits.up = up;
  rules.limits.max_slope_rad = options.max_slope_deg * rad_per_deg;
  rules.limits.clearance_m = options.clearance_m;
  if (options.clearance_m <= 0) rules.limits.obstacle_margin_m = rules.limits.unknown_to_m = 0;
  return rules;
}

Writer latched(const Participant& participant, const NodeOptions& options, const char* topic,
               const char* type) {
  return {participant, topic_over_dds(options.name + "/" + topic), type_over_dds(type), Profile::latched};
}

}  // namespace

Publications::Publications(const Participant& participant, const Mapping& mapping, const NodeOptions& options,
                           std::function<InputState()> inputs)
    : mapping_(mapping),
      options_(options),
      inputs_(std::move(inputs)),
      surfaces_(latched(participant, options, "surfaces", "octosurf_msgs/Surfaces")),
      stairs_(latched(participant, options, "stairs", "octosurf_msgs/Stairs")),
      markers_(latched(participant, options, "markers", "visualization_msgs/MarkerArray")),
      terrain_(
          latched(participant, options, "planar_terrain", "convex_plane_decomposition_msgs/PlanarTerrain")),
      octomap_(latched(participant, options, "octomap_binary", "octomap_msgs/Octomap")),
      grid_map_(latched(participant, options, "grid_map", "grid_map_msgs/GridMap")),
      status_(latched(participant, options, "status", "octosurf_msgs/Status")),
      thread_([this](std::stop_token stop) { run(std::move(stop)); }) {}

void Publications::run(std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any never;  // notified; only the stop ends the wait early
  const std::chrono::duration<double> period(options_.publish_s);
  std::shared_ptr<const Snapshot> last;
  while (!stop.stop_requested()) {
    const MapMoment moment = mapping_.moment();
    if (moment.snapshot != last && publish_map(moment)) last = moment.snapshot;
    publish_status(moment);
    std::unique_lock lock(mutex);
    never.wait_for(lock, stop, period, [] { return false; });
  }
}

/// For example a grid of too many cells: reported once in a row.
void Publications::tell(const char* what, const std::exception& error) {
  const std::string problem = std::string(what) + ": " + error.what();
  if (problem != problem_) std::fprintf(stderr, "warning: not published: %s\n", problem.c_str());
  problem_ = problem;
}

/// False if it is to be tried again, because readers were too slow.
bool Publications::publish(const Writer& writer, const char* what,
                           const std::function<void(io::MessageWriter&)>& message) try {
  return writer.write(io::cdr_of(message));
} catch (const std::exception& error) {
  tell(what, error);
  return true;
}

bool Publications::publish_map(const MapMoment& moment) {
  const std::string& frame = options_.frame;
  const Snapshot& snapshot = *moment.snapshot;
  bool all = publish(surfaces_, "surfaces",
                     [&](io::MessageWriter& out) { write_surfaces(out, snapshot, frame, moment.stamp_ns); });
  all &= publish(stairs_, "stairs", [&](io::MessageWriter& out) {
    write_stairs(out, mapping_.asked(moment)->bare_ground().stairs(), snapshot, frame, moment.stamp_ns);
  });
  all &= publish(markers_, "markers", [&](io::MessageWriter& out) { write_markers(out, snapshot, frame); });
  if (snapshot.octree.resolution() > 0)
    all &= publish(octomap_, "octomap", [&](io::MessageWriter& out) {
      write_octomap(out, *octree_.follow(snapshot.octree), frame);
    });
  PlannerContact contact;
  std::shared_ptr<const Snapshot> ground;
  HeightGrid grid;
  try {
    const GroundView view =
        mapping_.asked(moment)->ground(rules_of(options_, moment.up, snapshot.resolution));
    contact.shape = view.rules().foot;
    contact.limits = view.rules().limits;
    ground = view.solid();
    HeightGridOptions wanted;
    wanted.max_slope_rad = options_.max_slope_deg * rad_per_deg;
    grid = height_grid(*ground, wanted);
  } catch (const std::exception& error) {
    tell("grid map", error);
  }
  if (grid.elevation.size() == 0) return all;  // nothing level yet
  all &= publish(grid_map_, "grid map",
                 [&](io::MessageWriter& out) { io::write_grid_map(out, grid, io::layers_of(grid), frame); });
  all &= publish(terrain_, "planar terrain", [&](io::MessageWriter& out) {
    const auto surfaces = planner_surfaces(*ground, contact, &snapshot.octree);
    io::write_planar_terrain(out, io::terrain_regions(surfaces).regions, grid, frame);
  });
  return all;
}

void Publications::publish_status(const MapMoment& moment) {
  const MappingCounts counts = mapping_.counts();
  const InputState inputs = inputs_();
  publish(status_, "status", [&](io::MessageWriter& out) {
    out.message("header", io::header(options_.frame, moment.stamp_ns), "revision", moment.snapshot->revision,
                "surfaces", static_cast<std::uint32_t>(moment.snapshot->surfaces.size()), "received",
                counts.received, "waiting", counts.waiting, "mapped", counts.mapped, "rejected",
                counts.rejected, "refused", counts.refused, "dropped", counts.dropped, "lost", inputs.lost,
                "transforms", counts.transforms, "messages_refused", counts.messages_refused,
                "scan_publishers", inputs.scan_publishers, "camera_publishers", inputs.camera_publishers,
                "transform_publishers", inputs.transform_publishers, "last_refusal", counts.last_refusal,
                "scan_ms", counts.scan_ms);
  });
}

}  // namespace octosurf::dds
