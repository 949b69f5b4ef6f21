// Decodes single messages, as a node receives them: a pose, a cloud, a depth image.
#include "io/readers/bounded_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/readers/sensor_messages.hpp"

#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

/// Calls `read`; its exceptions become an Error naming the message.
template <class Read>
auto naming(const std::string& where, const Read& read) {
  return io::with_place(read, [&](const std::string& what) { return Error(Error::Kind::data, where, what); });
}

ReceivedScan begin_scan(std::string_view message, MessageEncoding encoding, const std::string& where) {
  const io::MessageHeader header = io::read_header(*io::message_reader(message, encoding));
  ReceivedScan received;
  received.frame = header.frame;
  received.stamp_ns = header.stamp_ns;
  received.scan.stamp_s = static_cast<double>(header.stamp_ns) / 1e9;
  received.scan.name = where;
  return received;
}

}  // namespace

ReceivedScan scan_from_cloud(std::string_view cloud, MessageEncoding encoding, const std::string& where,
                             std::optional<SensorKind> sensor, std::string_view type) {
  return naming(where, [&] {
    ReceivedScan received = begin_scan(cloud, encoding, where);
    io::Cloud read =
        io::read_cloud_message(*io::message_reader(cloud, encoding), io::largest_scan(cloud.size()), type);
    if (!read.shift.isZero(0)) io::fail_reading("points over 8 km away, which no sensor's frame has");
    received.scan.points = std::move(read.points);
    received.scan.sensor = sensor.value_or(sensor_of_frame(received.frame));
    return received;
  });
}

ReceivedScan scan_from_depth(std::string_view image, std::string_view camera_info, MessageEncoding encoding,
                             const std::string& where, bool rectified, std::optional<double> depth_scale,
                             std::string_view type) {
  return naming(where, [&] {
    ReceivedScan received = begin_scan(image, encoding, where);
    const io::CameraInfoMessage info = io::read_camera_info(*io::message_reader(camera_info, encoding));
    received.scan.sensor = SensorKind::depth_camera;
    received.scan.points = io::read_depth_message(
        *io::message_reader(image, encoding), type, depth_scale, where, io::largest_scan(image.size()),
        [&](int width, int height) {
          const io::Intrinsics camera = io::intrinsics_for(info, rectified, width, height);
          if (info.columns == 0) io::require_same_size(camera, width, height, where);
          return std::pair(camera, io::lens_of(info, rectified));
        });
    return received;
  });
}

void require_camera(std::string_view camera_info, MessageEncoding encoding, const std::string& where,
                    bool rectified) {
  naming(where, [&] {
    io::intrinsics_for(io::read_camera_info(*io::message_reader(camera_info, encoding)), rectified);
  });
}

std::string camera_info_topic(const std::string& images, bool compressed) {
  constexpr std::string_view of_librealsense = "/image/data";  // beside info/camera_info
  if (images.ends_with(of_librealsense))
    return images.substr(0, images.size() - of_librealsense.size()) + "/info/camera_info";
  const std::string raw = compressed ? images.substr(0, images.rfind('/')) : images;
  return raw.substr(0, raw.rfind('/') + 1) + "camera_info";  // npos + 1 is 0
}

bool is_rectified(const std::string& images) { return images.find("rect") != std::string::npos; }

Eigen::Isometry3d pose_from_transform(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation,
                                      const std::string& where) {
  return io::rigid(io::pose_from(translation, rotation), where);
}

}  // namespace octosurf
