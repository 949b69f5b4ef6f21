// octosurf/ros_messages.hpp in Python: posed scans out of ROS 2's messages as they come, and a map's lock.
#include "bind.hpp"
#include "io/map_lock.hpp"
#include "io/readers/pose_file.hpp"
#include "io/readers/reading_rules.hpp"
#include "io/readers/sensor_messages.hpp"
#include "io/readers/transform_tree.hpp"

#include <map>
#include <stdexcept>
#include <tuple>

#include <octosurf/ros_messages.hpp>

namespace octosurf::python {
namespace {

// Longer than scans wait: 256 MB of depth images are 14 s at 30 Hz, of a lidar's clouds half a minute.
constexpr std::int64_t transforms_kept_ns = 60'000'000'000;
// A robot has some hundred. A flood of unknown names must not fill the memory.
constexpr std::size_t most_frames = 10000;
// Of one frame: earlier by more than this is no reordering (reliable writers resend lost messages within Fast
// DDS's 3 s) but a simulator's reset or a recording's restart.
constexpr std::int64_t out_of_order_ns = 3'000'000'000;

/// tf as it comes, by the rules of a bag's, so that a live map equals the one of the recording.
class Transforms {
 public:
  std::string add(std::string_view message, bool fixed) {
    std::vector<io::TransformMessage> transforms;
    io::for_each_transform(
        *io::message_reader(message, MessageEncoding::cdr), [&](const io::TransformMessage& one) {
          io::rigid(io::pose_from(one.translation, one.rotation), "transform of " + one.child_frame);
          if (one.child_frame.empty() || one.child_frame == one.header.frame)
            throw std::runtime_error("a transform of frame '" + one.child_frame + "' in itself");
          transforms.push_back(one);
        });
    std::string warning;
    for (const io::TransformMessage& one : transforms) {
      const std::int64_t stamp = one.header.stamp_ns;
      const auto last = newest_ns_.find(one.child_frame);
      if (!fixed && last != newest_ns_.end() && stamp < last->second - out_of_order_ns) {
        warning = "time was set back by " + std::to_string((last->second - stamp) / 1'000'000'000) +
                  " s at frame " + one.child_frame + ": earlier transforms are forgotten";
        tree_.forget_moving();
        newest_ns_.clear();
      }
      const bool known = tree_.knows(one.child_frame) && tree_.knows(one.header.frame);
      if (!known && tree_.size() + 2 > most_frames)
        throw std::runtime_error("more than " + std::to_string(most_frames) + " frames");
      tree_.add({one.header.frame, one.child_frame, fixed}, {stamp, one.translation, one.rotation});
      if (!fixed) newest_ns_[one.child_frame] = std::max(newest_ns_[one.child_frame], stamp);
    }
    sorted_ = false;
    return warning;
  }

  const io::TransformTree& sorted() {
    if (!std::exchange(sorted_, true)) {
      tree_.finish();
      tree_.keep_last(transforms_kept_ns);
    }
    return tree_;
  }

 private:
  io::TransformTree tree_;
  bool sorted_ = true;
  std::map<std::string, std::int64_t> newest_ns_;  // of each moving frame
};

void bind_transforms(Module& module) {
  using T = Locked<Transforms>;
  Class<T>(module, "Transforms", "The transforms of tf, as messages bring them, and poses at their times.")
      .def(py::init<>())
      .def(
          "add",
          [](T& self, const py::bytes& message, bool fixed) {
            const std::string_view bytes = message;
            return self.use([&](Transforms& tf) { return tf.add(bytes, fixed); });
          },
          "message"_a, "fixed"_a = false,
          "A tf2_msgs/TFMessage, of /tf_static if `fixed`; a warning if time was set back by more than 3 s. "
          "Raises RuntimeError, and keeps nothing of it, if it is damaged.")
      .def(
          "newest",
          [](T& self, const std::string& to, const std::string& from) {
            return self.use([&](Transforms& tf) { return tf.sorted().newest(to, from); });
          },
          "to"_a, "from_"_a,
          "The time in ns until which later messages cannot change lookup(); None: they are not connected.")
      .def(
          "lookup",
          [](T& self, const std::string& to, const std::string& from, std::int64_t stamp_ns) {
            return self.use([&](Transforms& tf) {
              return tf.sorted().lookup(to, from, stamp_ns, io::largest_gap_in_bags_ns);
            });
          },
          "to"_a, "from_"_a, "stamp_ns"_a, "T_to_from, (4, 4), at that time. Raises RuntimeError.");
}

/// A scan that still waits for its pose.
struct Received {
  ReceivedScan of;
  bool depth;

  /// The robot's own boxes: low, high, T_box_sensor.
  using OwnBox = std::tuple<Eigen::Vector3d, Eigen::Vector3d, Eigen::Isometry3d>;
  Scan posed(const Eigen::Isometry3d& T_map_sensor, std::string name, const std::vector<double>& no_return,
             const std::vector<OwnBox>& own) {
    Scan scan = std::move(of.scan);
    std::vector<SelfBox> boxes;
    for (const auto& [a, b, T_box_sensor] : own)
      boxes.push_back({{a.cwiseMin(b).eval(), a.cwiseMax(b).eval()}, std::to_string(boxes.size())});
    io::erase_own(scan, boxes, [&](const std::string& box) { return std::get<2>(own[std::stoul(box)]); });
    ScanSourceOptions options;
    options.no_return = no_return;
    io::drop_no_returns(scan, depth, options);
    scan.name = std::move(name);
    scan.stamp_s = static_cast<double>(of.stamp_ns) / 1e9;
    scan.T_map_sensor = T_map_sensor;
    return scan;
  }
};

void bind_received(Module& module) {
  Class<Received>(module, "ReceivedScan")
      .def_property_readonly(
          "frame", [](const Received& self) { return self.of.frame; }, doc_of("ReceivedScan.frame"))
      .def_property_readonly(
          "stamp_ns", [](const Received& self) { return self.of.stamp_ns; }, doc_of("ReceivedScan.stamp_ns"))
      .def("posed", &Received::posed, "T_map_sensor"_a, py::kw_only(), "name"_a = "",
           "no_return"_a = std::vector<double>(), "own"_a = std::vector<Received::OwnBox>(), Released(),
           "The Scan at a pose, once: it takes the points. no_return: as of open_scans(). own: boxes whose "
           "readings are the robot itself, (low, high, T_box_sensor) each.");
  module.def(
      "scan_from_cloud",
      [](const py::bytes& cloud, const std::string& where, std::optional<SensorKind> sensor,
         const std::string& type) {
        const std::string_view message = cloud;
        const py::gil_scoped_release others_run;
        return Received{scan_from_cloud(message, MessageEncoding::cdr, where, sensor, type), false};
      },
      "cloud"_a, "where"_a = "", "sensor"_a = py::none(), "type"_a = "sensor_msgs/PointCloud2");
  module.def(
      "scan_from_depth",
      [](const py::bytes& image, const py::bytes& camera_info, const std::string& where, bool rectified,
         std::optional<double> depth_scale, const std::string& type) {
        const std::string_view message = image, camera = camera_info;
        const py::gil_scoped_release others_run;
        return Received{
            scan_from_depth(message, camera, MessageEncoding::cdr, where, rectified, depth_scale, type),
            true};
      },
      "image"_a, "camera_info"_a, "where"_a = "", "rectified"_a = false, "depth_scale"_a = py::none(),
      "type"_a = "sensor_msgs/Image");
  module.def(
      "require_camera",
      [](const py::bytes& camera_info, const std::string& where, bool rectified) {
        require_camera(std::string_view(camera_info), MessageEncoding::cdr, where, rectified);
      },
      "camera_info"_a, "where"_a = "", "rectified"_a = false);
  module.def(
      "pose_from_transform",
      [](const Eigen::Vector3d& translation, const Eigen::Vector4d& rotation, const std::string& where) {
        return pose_from_transform(translation, Eigen::Quaterniond(rotation), where);
      },
      "translation"_a, "rotation"_a, "where"_a = "");
  module.def("camera_info_topic", &camera_info_topic, "images"_a, "compressed"_a = false);
  module.def("is_rectified", &is_rectified, "images"_a);
}

}  // namespace

void bind_ros(Module& module) {
  bind_transforms(module);
  bind_received(module);
  Class<io::MapLock>(module, "MapLock", "Keeps other processes from writing a map while it lives.")
      .def(py::init<const std::filesystem::path&>(), "stem"_a);
}

}  // namespace octosurf::python
