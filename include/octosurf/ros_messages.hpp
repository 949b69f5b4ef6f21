#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <octosurf/scan.hpp>

// Serialised ROS messages, without a ROS dependency: decodes received scans as from a bag (scan_source.hpp
// lists the supported types).

namespace octosurf {

/// Serialisation of a ROS message.
enum class MessageEncoding {
  ros1,  ///< little-endian, packed
  cdr,   ///< XCDR1 after its encapsulation header, as in ROS 2
  other  ///< JSON, protobuf, …: not supported
};

/// A scan from a message, without a pose, which comes from other messages.
struct ReceivedScan {
  Scan scan;                  ///< T_map_sensor is not set
  std::string frame;          ///< of the sensor, without ROS 1's leading slash
  std::int64_t stamp_ns = 0;  ///< of its header, since the epoch
};

/// Decodes a sensor_msgs/PointCloud2, or by `type` Livox' CustomMsg ("livox_ros_driver2/CustomMsg"). Throws
/// Error(data) naming `where`. `sensor`: empty: its frame's (sensor_of_frame()). Motion is not undone.
ReceivedScan scan_from_cloud(std::string_view cloud, MessageEncoding encoding, const std::string& where,
                             std::optional<SensorKind> sensor = {},
                             std::string_view type = "sensor_msgs/PointCloud2");

/// Decodes a sensor_msgs/Image with depth, or by `type` a "sensor_msgs/CompressedImage" (compressedDepth: PNG
/// or RVL), and its sensor_msgs/CameraInfo, using K, or P if the images are `rectified`. `depth_scale`: units
/// per metre; empty: 1000 for 16UC1 and mono16, 1 for 32FC1. Throws Error(data) naming `where`.
ReceivedScan scan_from_depth(std::string_view image, std::string_view camera_info, MessageEncoding encoding,
                             const std::string& where, bool rectified = false,
                             std::optional<double> depth_scale = {},
                             std::string_view type = "sensor_msgs/Image");

/// Throws Error(data) naming `where` unless it is the sensor_msgs/CameraInfo of a calibrated camera, as
/// scan_from_depth() needs it.
void require_camera(std::string_view camera_info, MessageEncoding encoding, const std::string& where,
                    bool rectified = false);

/// The CameraInfo topic of an image topic by image_transport's convention: a/b/image → a/b/camera_info.
/// `compressed`: the images come by a transport's subtopic: a/b/image/compressedDepth → a/b/camera_info.
std::string camera_info_topic(const std::string& images, bool compressed = false);

/// Whether the topic's name denotes undistorted images by image_proc's convention ("a/b/image_rect"): the
/// `rectified` of scan_from_depth().
bool is_rectified(const std::string& images);

/// A tf transform as a Scan's pose: the rotation is made exactly orthonormal. Throws Error(data) naming
/// `where` for numbers that are not finite, or a quaternion farther than 1e-2 from unit length.
Eigen::Isometry3d pose_from_transform(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation,
                                      const std::string& where);

}  // namespace octosurf
