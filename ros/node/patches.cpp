#include "patches.hpp"

#include "io/exporters/planner_messages.hpp"
#include "io/readers/transform_tree.hpp"
#include "messages.hpp"
#include "publications.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>

namespace octosurf::node {
namespace {

/// The map is read as often; the robot's pose is that of each patch.
constexpr std::chrono::milliseconds map_age{100};

/// Cells along y of a PatchLayout::grid().
std::size_t columns_of(const PatchLayout& layout) {
  const auto beside = [&](const Eigen::Vector2d& point) { return point.x() != layout.points.front().x(); };
  return static_cast<std::size_t>(std::ranges::find_if(layout.points, beside) - layout.points.begin());
}

}  // namespace

Patches::Patches(Middleware& middleware, Mapping& mapping, const NodeOptions& options)
    : mapping_(mapping),
      options_(options),
      heading_(PatchLayout::grid(options.patch_length_m, options.patch_width_m, options.patch_cell_m)),
      patch_(middleware.advertise(options.name + "/patch", "grid_map_msgs/GridMap", Profile::sensor)),
      heights_(
          middleware.advertise(options.name + "/heights", "std_msgs/Float32MultiArray", Profile::sensor)) {
  const double side = std::max(options.patch_length_m, options.patch_width_m);
  square_ = PatchLayout::grid(side, side, options.patch_cell_m);
  side_ = static_cast<Eigen::Index>(columns_of(square_));
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Patches::run(const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  std::mutex mutex;
  std::condition_variable_any never;  // notified; only the stop ends the wait early
  const auto period =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options_.patch_hz));
  std::optional<GroundView> view;
  std::string problem;
  Clock::time_point looked{}, next = Clock::now();
  while (!stop.stop_requested()) {
    if (patch_->subscribers() + heights_->subscribers() > 0) try {
        if (const auto now = Clock::now(); !view || now - looked > map_age) {
          const MapMoment moment = mapping_.moment();
          view = mapping_.asked(moment)->ground(rules_of(options_, moment.up, moment.snapshot->resolution));
          looked = now;
        }
        publish(*view);
        problem.clear();
      } catch (const std::exception& error) {  // tf has no pose yet, for example
        if (problem != error.what()) std::fprintf(stderr, "warning: no patch: %s\n", error.what());
        problem = error.what();
      }
    next = std::max(next + period, Clock::now());
    std::unique_lock lock(mutex);
    never.wait_until(lock, stop, next, [] { return false; });
  }
}

void Patches::publish(const GroundView& view) {
  const auto [T_map_base, stamp_ns] = mapping_.sensors().base_pose();
  if (heights_->subscribers() > 0) {
    const GroundPatch patch = ground_patch(view, T_map_base, heading_);
    const std::size_t columns = columns_of(heading_), rows = patch.height.size() / columns;
    heights_->publish(
        io::cdr_of([&](io::MessageWriter& out) { write_heights(out, patch.height, rows, columns); }));
  }
  if (patch_->subscribers() == 0) return;
  Eigen::Isometry3d T_map_patch = Eigen::Isometry3d::Identity();
  T_map_patch.translation() = T_map_base.translation();
  GroundPatch patch = ground_patch(view, T_map_patch, square_);
  HeightGrid grid;
  grid.cell = options_.patch_cell_m;
  grid.center = T_map_base.translation().head<2>();
  std::vector<float> cell(patch.cell.size());
  std::ranges::transform(patch.cell, cell.begin(), [](PatchCell c) { return static_cast<float>(c); });
  for (float& height : patch.height) height += static_cast<float>(T_map_base.translation().z());
  // From x and y ascending, y the faster, to descending, x the faster: the transpose of the reversed list.
  const auto layer = [this](std::vector<float>& values) {
    std::ranges::reverse(values);
    return Eigen::MatrixXf(Eigen::MatrixXf::Map(values.data(), side_, side_).transpose());
  };
  grid.elevation = layer(patch.height);
  const Eigen::MatrixXf kind = layer(cell), slope = layer(patch.slope_rad), edge = layer(patch.edge_m);
  patch_->publish(io::cdr_of([&](io::MessageWriter& out) {
    io::write_grid_map(out, grid,
                       {{"elevation", &grid.elevation}, {"cell", &kind}, {"slope", &slope}, {"edge", &edge}},
                       options_.frame, stamp_ns);
  }));
}

}  // namespace octosurf::node
