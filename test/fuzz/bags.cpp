// Targets for bags and the messages in them.
#include "fuzz/input_file.hpp"
#include "io/readers/bag_index.hpp"
#include "io/readers/sensor_messages.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/scan_source.hpp>

namespace octosurf::fuzz {
namespace {

void fuzz_recording(Bytes bytes, const char* ending) {
  const InputFile file(bytes, ending);
  for (const bool skip_bad : {false, true}) {
    accepted([&] {
      ScanSourceOptions options;
      options.skip_bad = skip_bad;
      const auto scans = open_scans({file.path()}, options);
      promise(scans->size() > 0, "a recording has scans");
      while (const std::optional<Scan> scan = scans->next()) require_rigid(scan->T_map_sensor, scan->name);
      return true;
    });
  }
  accepted([&] {
    std::vector<std::string> damage;
    const auto bag = io::open_bag({file.path()});
    promise(io::summarise_bag(*bag, damage).size() == bag->topics().size(), "topics are listed");
    return true;
  });
}

/// Every message that this one could be; a std::runtime_error is an answer.
void read_message(io::MessageReader& message, int type, std::size_t size) {
  const std::uint64_t largest = 32 * (std::size_t{1} << 20);
  if (type == 0) {
    promise(io::read_cloud_message(message, largest).points.size() <= size, "a point takes a byte at least");
  } else if (type == 1) {
    io::points_of(io::read_image_message(message), {500, 500, 320, 240}, nullptr, {}, largest);
  } else if (type == 2) {
    io::depth_of(io::read_compressed_image_message(message), "message", largest);
  } else if (type == 3) {
    const io::CameraInfoMessage camera = io::read_camera_info(message);
    promise(!camera.calibrated() || (camera.width > 0 && camera.height > 0),
            "a calibrated camera has pixels");
  } else if (type == 4) {
    io::TransformTree tree;
    io::for_each_transform(message, [&](const io::TransformMessage& one) {
      tree.add(
          {one.header.frame, one.child_frame, one.header.stamp_ns % 2 == 0},
          {one.header.stamp_ns, one.translation, Eigen::Quaternion<double, Eigen::DontAlign>(one.rotation)});
    });
    tree.finish();
    tree.lookup("map", "lidar", 1000000000, 1000000000);
  } else if (type == 7) {  // a CameraInfo, and an Image by it
    const io::CameraInfoMessage camera = io::read_camera_info(message);
    const auto points = io::read_depth_message(
        message, "sensor_msgs/Image", {}, "message", largest, [&](int width, int height) {
          return std::pair(io::intrinsics_for(camera, false, width, height), io::lens_of(camera, false));
        });
    promise(std::ranges::all_of(points, [](const auto& p) { return p.z() >= io::nearest_depth; }),
            "a reading is a millimetre away at least");
  } else if (type == 8) {
    io::read_cloud_message(message, largest, "livox_ros_driver2/CustomMsg");
  } else {
    io::read_pose_message(message, type == 5 ? "nav_msgs/Odometry" : "nav_msgs/Path");
  }
}

}  // namespace

void fuzz_mcap(Bytes bytes) { fuzz_recording(bytes, ".mcap"); }
void fuzz_db3(Bytes bytes) { fuzz_recording(bytes, ".db3"); }
void fuzz_bag(Bytes bytes) { fuzz_recording(bytes, ".bag"); }

void fuzz_message(Bytes bytes) {
  if (bytes.empty()) return;
  const std::string_view message(reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1);
  const auto encoding = bytes[0] >= 128 ? MessageEncoding::ros1 : MessageEncoding::cdr;
  accepted([&] {
    try {
      read_message(*io::message_reader(message, encoding), bytes[0] % 128 % 9, message.size());
    } catch (const std::runtime_error&) {
      return false;
    }
    return true;
  });
}

}  // namespace octosurf::fuzz
