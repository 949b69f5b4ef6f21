#include "io/exporters/foxglove_log.hpp"

#include "geometry/symmetric.hpp"
#include "geometry/voxel_grid.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/text_file.hpp"
#include "octosurf_foxglove.pb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <google/protobuf/descriptor.pb.h>
#include <limits>
#include <numbers>
#include <vector>

#include <octosurf/up.hpp>

namespace octosurf::io {
namespace {

constexpr const char *map_frame = "map", *sensor_frame = "sensor";
constexpr std::size_t most_cells = std::size_t{1} << 23;
constexpr std::array<float, 3> pending_color{0.5F, 0.5F, 0.5F}, cylinder_color{0.55F, 0.45F, 0.75F};

/// The definitions of the messages, with their imports, in package `foxglove`.
std::string descriptors() {
  google::protobuf::FileDescriptorSet set;
  google::protobuf::Timestamp::descriptor()->file()->CopyTo(set.add_file());
  google::protobuf::FileDescriptorProto& file = *set.add_file();
  foxglove::SceneUpdate::descriptor()->file()->CopyTo(&file);
  const std::string ours = "." + file.package(), theirs = ".foxglove";
  file.set_package(theirs.substr(1));
  for (auto& message : *file.mutable_message_type())
    for (auto& field : *message.mutable_field())
      if (field.type_name().starts_with(ours + "."))
        field.set_type_name(theirs + field.type_name().substr(ours.size()));
  return set.SerializeAsString();
}

google::protobuf::Timestamp timestamp(std::uint64_t time_ns) {
  google::protobuf::Timestamp stamp;
  stamp.set_seconds(static_cast<std::int64_t>(time_ns / 1'000'000'000));
  stamp.set_nanos(static_cast<std::int32_t>(time_ns % 1'000'000'000));
  return stamp;
}

template <class Message>
void set_xyz(Message* message, const Eigen::Vector3d& xyz) {
  message->set_x(xyz.x());
  message->set_y(xyz.y());
  message->set_z(xyz.z());
}

void set_rotation(foxglove::Quaternion* message, const Eigen::Quaterniond& rotation) {
  message->set_x(rotation.x());
  message->set_y(rotation.y());
  message->set_z(rotation.z());
  message->set_w(rotation.w());
}

void set_pose(foxglove::Pose* message, const Eigen::Isometry3d& T) {
  set_xyz(message->mutable_position(), T.translation());
  set_rotation(message->mutable_orientation(), Eigen::Quaterniond(T.linear()));
}

void set_color(foxglove::Color* message, const std::array<float, 3>& color) {
  message->set_r(color[0]);
  message->set_g(color[1]);
  message->set_b(color[2]);
  message->set_a(1);
}

std::array<std::uint8_t, 4> rgba(const std::array<float, 3>& color) {
  const auto byte = [](float part) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(part, 0.F, 1.F)));
  };
  return {byte(color[0]), byte(color[1]), byte(color[2]), 255};
}

template <class Message>
void add_field(Message& message, const char* name, std::uint32_t offset,
               foxglove::PackedElementField::NumericType type) {
  foxglove::PackedElementField& field = *message.add_fields();
  field.set_name(name);
  field.set_offset(offset);
  field.set_type(type);
}

template <class Message>
void add_color_fields(Message& message, std::uint32_t offset) {
  for (const char* name : {"red", "green", "blue", "alpha"})
    add_field(message, name, offset++, foxglove::PackedElementField::UINT8);
}

void add_metadata(foxglove::SceneEntity& entity, const char* key, double value) {
  foxglove::KeyValuePair& pair = *entity.add_metadata();
  pair.set_key(key);
  pair.set_value(formatted("%.6g", value));
}

void describe(foxglove::SceneEntity& entity, const Surface& surface, const Eigen::Vector3d& up) {
  add_metadata(entity, "area_m2", surface.area_m2);
  add_metadata(entity, "slope_deg", slope_rad(surface, up) * 180 / std::numbers::pi);
  add_metadata(entity, "inliers", static_cast<double>(surface.inliers));
  add_metadata(entity, "rms_m", surface.rms_m);
  const Mesh mesh = flat(surface, simplified(surface));
  foxglove::TriangleListPrimitive& triangles = *entity.add_triangles();
  set_pose(triangles.mutable_pose(), Eigen::Isometry3d::Identity());
  set_color(triangles.mutable_color(), surface.color);
  for (const Eigen::Vector3d& vertex : mesh.vertices) set_xyz(triangles.add_points(), vertex);
  for (const auto& corners : mesh.triangles)
    for (const std::uint32_t corner : corners) triangles.add_indices(corner);
}

void describe(foxglove::SceneEntity& entity, const Cylinder& cylinder, const Eigen::Vector3d& /*up*/) {
  add_metadata(entity, "radius_m", cylinder.radius_m);
  add_metadata(entity, "length_m", cylinder.length_m);
  add_metadata(entity, "inliers", static_cast<double>(cylinder.inliers));
  add_metadata(entity, "rms_m", cylinder.rms_m);
  foxglove::CylinderPrimitive& primitive = *entity.add_cylinders();
  Eigen::Isometry3d pose(geometry::rotation_between(Eigen::Vector3d::UnitZ(), cylinder.axis));
  pose.translation() = cylinder.axis_point;
  set_pose(primitive.mutable_pose(), pose);
  set_xyz(primitive.mutable_size(), {2 * cylinder.radius_m, 2 * cylinder.radius_m, cylinder.length_m});
  primitive.set_bottom_scale(1);
  primitive.set_top_scale(1);
  set_color(primitive.mutable_color(), cylinder_color);
}

/// A grid of cells around the occupied voxels, with their states.
struct Cells {
  struct Cell {
    std::array<std::uint8_t, 4> color{};  ///< transparent unless occupied
    std::uint8_t occupancy = 0;           ///< unknown, free, occupied
  };

  double edge = 0;
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();  ///< the lowest
  Eigen::Array<std::size_t, 3, 1> count = Eigen::Array<std::size_t, 3, 1>::Zero();
  std::vector<Cell> cells;

  /// Index of the cell that contains a point in the box, per axis.
  Eigen::Array<std::size_t, 3, 1> index(const Eigen::Vector3d& point) const {
    return ((point - corner) / edge).array().floor().cast<std::size_t>().min(count - 1);
  }
  Cell& at(std::size_t x, std::size_t y, std::size_t z) { return cells[(z * count.y() + y) * count.x() + x]; }
};

Cells cells_around_occupied(const OccupancyView& octree) {
  Eigen::AlignedBox3d box;
  constexpr double far = std::numeric_limits<double>::max();
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-far), Eigen::Vector3d::Constant(far));
  octree.for_each_occupied(everywhere, [&](const OccupancyView::Voxel& voxel) {
    box.extend(voxel.center);
    return true;
  });
  Cells cells;
  if (box.isEmpty()) return cells;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(octree.resolution() / 2);
  cells.corner = box.min() - half;
  cells.edge = octree.resolution();
  const auto fit = [&]() -> Eigen::Array3d {
    return ((box.max() - cells.corner) / cells.edge).array().floor() + 1;
  };
  while (fit().prod() > static_cast<double>(most_cells)) cells.edge *= 2;
  cells.count = fit().cast<std::size_t>();
  cells.cells.resize(cells.count.prod());
  return cells;
}

void mark_free(Cells& cells, const OccupancyView& octree) {
  const double d = octree.resolution();
  const Eigen::Vector3d size = cells.count.cast<double>() * cells.edge, end = cells.corner + size;
  octree.for_each_leaf({cells.corner, end}, [&](std::span<const OccupancyView::Leaf> leaves) {
    for (const OccupancyView::Leaf& leaf : leaves) {
      if (leaf.log_odds >= octree.occupied_from()) continue;
      // Between the centres of its first and its last voxel.
      const Eigen::Vector3d low(leaf.corner[0], leaf.corner[1], leaf.corner[2]);
      const Eigen::Vector3d first = (low.array() - geometry::VoxelGrid::origin + 0.5) * d;
      const Eigen::Vector3d last = first.array() + ((1 << leaf.level) - 1) * d;
      if ((last.array() < cells.corner.array()).any() || (first.array() >= end.array()).any()) continue;
      const auto from = cells.index(first.cwiseMax(cells.corner)), to = cells.index(last);
      for (std::size_t z = from.z(); z <= to.z(); ++z)
        for (std::size_t y = from.y(); y <= to.y(); ++y)
          for (std::size_t x = from.x(); x <= to.x(); ++x) cells.at(x, y, z).occupancy = 1;
    }
  });
}

void mark_occupied(Cells& cells, const OccupancyView& octree, const Snapshot& snapshot) {
  const Eigen::Vector3d size = cells.count.cast<double>() * cells.edge;
  octree.for_each_occupied({cells.corner, cells.corner + size}, [&](const OccupancyView::Voxel& voxel) {
    const auto index = cells.index(voxel.center);
    Cells::Cell& cell = cells.at(index.x(), index.y(), index.z());
    const Surface* surface = snapshot.find(voxel.surface);
    if (surface != nullptr || cell.occupancy != 2)
      cell = {rgba(surface != nullptr ? surface->color : pending_color), 2};
    return true;
  });
}

}  // namespace

std::uint64_t FoxgloveLog::time_ns(double stamp_s) {
  constexpr double longest_s = 9e9;  // 285 years, the limit for nanoseconds in a double
  const auto ns = static_cast<std::uint64_t>(std::round(1e9 * std::clamp(stamp_s, 0.0, longest_s)));
  return last_ns_ = std::max(last_ns_, ns);
}

void FoxgloveLog::write(const char* topic, const google::protobuf::Message& message, std::uint64_t time_ns) {
  auto channel = channels_.find(topic);
  if (channel == channels_.end()) {
    const std::string type = "foxglove." + message.GetDescriptor()->name();
    channel = channels_.emplace(topic, file_.add_channel(topic, type, descriptors())).first;
  }
  file_.write(channel->second, time_ns, message.SerializeAsString());
}

void FoxgloveLog::add_pose(double stamp_s, const Eigen::Isometry3d& T_map_sensor) {
  const std::uint64_t time = time_ns(stamp_s);
  foxglove::FrameTransform transform;
  *transform.mutable_timestamp() = timestamp(time);
  transform.set_parent_frame_id(map_frame);
  transform.set_child_frame_id(sensor_frame);
  set_xyz(transform.mutable_translation(), T_map_sensor.translation());
  set_rotation(transform.mutable_rotation(), Eigen::Quaterniond(T_map_sensor.linear()));
  write("/tf", transform, time);
}

void FoxgloveLog::add_trajectory(double stamp_s, std::span<const Eigen::Isometry3d> T_map_sensor) {
  const std::uint64_t time = time_ns(stamp_s);
  foxglove::PosesInFrame poses;
  *poses.mutable_timestamp() = timestamp(time);
  poses.set_frame_id(map_frame);
  for (const Eigen::Isometry3d& pose : T_map_sensor) set_pose(poses.add_poses(), pose);
  write("/trajectory", poses, time);
}

void FoxgloveLog::add_surfaces(double stamp_s, const Snapshot& snapshot) {
  const std::uint64_t time = time_ns(stamp_s);
  foxglove::SceneUpdate update;
  const auto add = [&](const std::string& id, const auto& thing) {
    foxglove::SceneEntity& entity = *update.add_entities();
    *entity.mutable_timestamp() = timestamp(time);
    entity.set_frame_id(map_frame);
    entity.set_id(id);
    entity.set_frame_locked(true);
    describe(entity, thing, up_);
  };
  for (const SurfacePtr& surface : snapshot.surfaces) add("surface_" + std::to_string(surface->id), *surface);
  for (const CylinderPtr& cylinder : snapshot.cylinders)
    add("cylinder_" + std::to_string(cylinder->id), *cylinder);
  if (update.entities_size() > 0) write("/surfaces", update, time);
}

void FoxgloveLog::add_voxels(double stamp_s, const OccupancyView& octree, const Snapshot& snapshot) {
  Cells cells = cells_around_occupied(octree);
  if (cells.cells.empty()) return;
  mark_free(cells, octree);
  mark_occupied(cells, octree, snapshot);

  static_assert(sizeof(Cells::Cell) == 5);
  constexpr auto stride = static_cast<std::uint32_t>(sizeof(Cells::Cell));
  const auto columns = static_cast<std::uint32_t>(cells.count.x());
  const auto rows = static_cast<std::uint32_t>(cells.count.y());
  const std::uint64_t time = time_ns(stamp_s);
  foxglove::VoxelGrid grid;
  *grid.mutable_timestamp() = timestamp(time);
  grid.set_frame_id(map_frame);
  set_pose(grid.mutable_pose(), Eigen::Isometry3d(Eigen::Translation3d(cells.corner)));
  grid.set_column_count(columns);
  grid.set_row_count(rows);
  set_xyz(grid.mutable_cell_size(), Eigen::Vector3d::Constant(cells.edge));
  grid.set_cell_stride(stride);
  grid.set_row_stride(stride * columns);
  grid.set_slice_stride(stride * columns * rows);
  add_color_fields(grid, offsetof(Cells::Cell, color));
  add_field(grid, "occupancy", offsetof(Cells::Cell, occupancy), foxglove::PackedElementField::UINT8);
  grid.set_data(cells.cells.data(), cells.cells.size() * sizeof(Cells::Cell));
  write("/voxels", grid, time);
}

}  // namespace octosurf::io
