#include "io/exporters/export_mcap.hpp"

#include "geometry/degrees.hpp"
#include "geometry/symmetric.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/mcap_format.hpp"
#include "io/text_file.hpp"
#include "octosurf_foxglove.pb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <google/protobuf/descriptor.pb.h>
#include <map>
#include <new>
#include <string_view>
#include <zstd.h>

#include <octosurf/up.hpp>

namespace octosurf::io {
namespace {

constexpr std::string_view compression = "zstd";

std::string compressed(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the only possible error
  packed.resize(size);
  return packed;
}

template <std::unsigned_integral Number>
void add_field(std::string& content, Number number) {
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    content += static_cast<char>(static_cast<unsigned char>(number >> (8 * i)));
}

void add_field(std::string& content, std::string_view text) {
  add_field(content, static_cast<std::uint32_t>(text.size()));
  content += text;
}

/// Content of a record: numbers little-endian; a string, an array or a map behind its size.
template <class... Fields>
std::string content_of(const Fields&... fields) {
  std::string content;
  (add_field(content, fields), ...);
  return content;
}

void add_record(std::string& to, McapOp op, std::string_view content, std::string_view rest = {}) {
  to += content_of(static_cast<std::uint8_t>(op), static_cast<std::uint64_t>(content.size() + rest.size()));
  to += content;
  to += rest;
}

struct Channel {
  std::uint16_t id = 0;  ///< of its schema, too
  std::uint32_t messages = 0;
  std::string index;  ///< time and offset in the chunk of each
};

constexpr const char *map_frame = "map", *sensor_frame = "sensor";
constexpr std::array<float, 3> cylinder_color{0.55F, 0.45F, 0.75F};

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

void add_metadata(foxglove::SceneEntity& entity, const char* key, double value) {
  foxglove::KeyValuePair& pair = *entity.add_metadata();
  pair.set_key(key);
  pair.set_value(formatted("%.6g", value));
}

void describe(foxglove::SceneEntity& entity, const Surface& surface, const Eigen::Vector3d& up) {
  add_metadata(entity, "area_m2", surface.area_m2);
  add_metadata(entity, "slope_deg", slope_rad(surface, up) * deg_per_rad);
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

McapMessage packed(const char* topic, const google::protobuf::Message& message, std::uint64_t time_ns) {
  return {topic, "foxglove." + message.GetDescriptor()->name(), time_ns, message.SerializeAsString()};
}

McapMessage scene_of(const Snapshot& snapshot, const Eigen::Vector3d& up, std::uint64_t time_ns) {
  foxglove::SceneUpdate update;
  const auto add = [&](const std::string& id, const auto& thing) {
    foxglove::SceneEntity& entity = *update.add_entities();
    *entity.mutable_timestamp() = timestamp(time_ns);
    entity.set_frame_id(map_frame);
    entity.set_id(id);
    entity.set_frame_locked(true);
    describe(entity, thing, up);
  };
  for (const SurfacePtr& surface : snapshot.surfaces) add("surface_" + std::to_string(surface->id), *surface);
  for (const CylinderPtr& cylinder : snapshot.cylinders)
    add("cylinder_" + std::to_string(cylinder->id), *cylinder);
  return packed("/surfaces", update, time_ns);
}

McapMessage transform_of(const Eigen::Isometry3d& T_map_sensor, std::uint64_t time_ns) {
  foxglove::FrameTransform transform;
  *transform.mutable_timestamp() = timestamp(time_ns);
  transform.set_parent_frame_id(map_frame);
  transform.set_child_frame_id(sensor_frame);
  set_xyz(transform.mutable_translation(), T_map_sensor.translation());
  set_rotation(transform.mutable_rotation(), Eigen::Quaterniond(T_map_sensor.linear()));
  return packed("/tf", transform, time_ns);
}

}  // namespace

void write_mcap(std::ostream& out, const std::vector<McapMessage>& messages, const std::string& descriptors) {
  std::map<std::string, Channel> channels;  // by topic
  std::string schemas, definitions;
  for (const McapMessage& message : messages) {
    if (channels.contains(message.topic)) continue;
    const auto id = static_cast<std::uint16_t>(channels.size() + 1);
    channels[message.topic].id = id;
    add_record(schemas, McapOp::schema, content_of(id, message.type, "protobuf", descriptors));
    add_record(definitions, McapOp::channel, content_of(id, id, message.topic, "protobuf", ""));
  }
  std::string chunk = schemas + definitions;
  for (const McapMessage& message : messages) {
    Channel& channel = channels[message.topic];
    channel.index += content_of(message.time_ns, std::uint64_t{chunk.size()});
    add_record(chunk, McapOp::message,
               content_of(channel.id, channel.messages++, message.time_ns, message.time_ns), message.bytes);
  }
  const auto [first, last] = std::ranges::minmax_element(messages, {}, &McapMessage::time_ns);
  const std::uint64_t begin_ns = messages.empty() ? 0 : first->time_ns,
                      end_ns = messages.empty() ? 0 : last->time_ns;

  std::string file(mcap_magic);
  add_record(file, McapOp::header, content_of("", "octosurf"));  // profile, library
  const std::string packed = compressed(chunk);
  const std::uint64_t chunk_begin = file.size(), size = chunk.size(), packed_size = packed.size();
  add_record(file, McapOp::chunk,
             content_of(begin_ns, end_ns, size, crc32_of(chunk), compression, packed_size), packed);
  const std::uint64_t index_begin = file.size();
  std::string offsets, counts;  // of each channel
  for (const auto& [topic, channel] : channels) {
    offsets += content_of(channel.id, std::uint64_t{file.size()});
    counts += content_of(channel.id, std::uint64_t{channel.messages});
    add_record(file, McapOp::message_index, content_of(channel.id, channel.index));
  }
  const std::uint64_t index_size = file.size() - index_begin;
  add_record(file, McapOp::data_end, content_of(crc32_of(file)));

  const auto count = static_cast<std::uint16_t>(channels.size());
  std::string statistics, chunk_index;
  add_record(statistics, McapOp::statistics,
             content_of(std::uint64_t{messages.size()}, count /* schemas */, std::uint32_t{count},
                        std::uint32_t{0} /* attachments */, std::uint32_t{0} /* metadata */,
                        std::uint32_t{1} /* chunks */, begin_ns, end_ns, counts));
  add_record(chunk_index, McapOp::chunk_index,
             content_of(begin_ns, end_ns, chunk_begin, index_begin - chunk_begin, offsets, index_size,
                        compression, packed_size, size));
  const std::uint64_t summary_begin = file.size();
  std::string summary = schemas + definitions + statistics + chunk_index;
  // The footer's checksum covers the summary and the footer's fields before it; no offsets of parts follow
  // it.
  add_record(summary, McapOp::footer, content_of(summary_begin, std::uint64_t{0}), "1234");
  summary.resize(summary.size() - 4);
  file += summary + content_of(crc32_of(summary));
  file += mcap_magic;
  out.write(file.data(), static_cast<std::streamsize>(file.size()));
}

void write_foxglove(std::ostream& out, const Snapshot& snapshot, const Eigen::Vector3d& up,
                    const std::vector<StampedPose>& T_map_sensor) {
  constexpr double longest_s = 9e9;  // 285 years, the limit for nanoseconds in a double
  std::vector<McapMessage> messages;
  foxglove::PosesInFrame trajectory;
  std::uint64_t begin_ns = 0, time_ns = 0;
  for (const auto& [stamp_s, pose] : T_map_sensor) {
    time_ns =
        std::max(time_ns, static_cast<std::uint64_t>(std::round(1e9 * std::clamp(stamp_s, 0.0, longest_s))));
    if (messages.empty()) begin_ns = time_ns;
    messages.push_back(transform_of(pose, time_ns));
    set_pose(trajectory.add_poses(), pose);
  }
  *trajectory.mutable_timestamp() = timestamp(begin_ns);
  trajectory.set_frame_id(map_frame);
  if (!messages.empty()) messages.push_back(packed("/trajectory", trajectory, begin_ns));
  if (snapshot.surfaces.size() + snapshot.cylinders.size() > 0)
    messages.push_back(scene_of(snapshot, up, begin_ns));
  write_mcap(out, messages, descriptors());
}

}  // namespace octosurf::io
