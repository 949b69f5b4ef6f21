#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/height_grid.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/scan.hpp>

// ROS messages as bytes, without ROS: what a node receives becomes scans as it does out of a bag
// (scan_source.hpp says what is read), and what planners read is written as by export_planar_terrain() and
// export_grid_map().

namespace octosurf {

/// How ROS serialises a message.
enum class MessageEncoding {
  ros1,  ///< little-endian, packed
  cdr,   ///< XCDR1 behind its encapsulation header, as ROS 2 has it
  other  ///< JSON, protobuf, …: not read
};

/// A scan as a message has it; where its sensor was is another message's to tell.
struct ReceivedScan {
  Scan scan;                  ///< T_map_sensor is not set
  std::string frame;          ///< of the sensor, without ROS 1's leading slash
  std::int64_t stamp_ns = 0;  ///< of its header, since the epoch
};

/// Of a sensor_msgs/PointCloud2. Throws Error(data) that names `where` for a message that is not whole, has
/// no x, y and z, or whose sizes contradict each other.
ReceivedScan scan_from_cloud(std::string_view cloud, MessageEncoding encoding, const std::string& where);

/// Of a sensor_msgs/Image with depth and the sensor_msgs/CameraInfo of its camera, of which K is taken, or P
/// if the images are `rectified`. `depth_scale`: units per metre; empty: 1000 for 16UC1 and mono16, 1 for
/// 32FC1. Throws as scan_from_cloud(), and for a camera that is not calibrated or of another size.
ReceivedScan scan_from_depth(std::string_view image, std::string_view camera_info, MessageEncoding encoding,
                             const std::string& where, bool rectified = false,
                             std::optional<double> depth_scale = {});

/// Throws Error(data) that names `where` unless it is the sensor_msgs/CameraInfo of a calibrated camera, as
/// scan_from_depth() takes it.
void require_camera(std::string_view camera_info, MessageEncoding encoding, const std::string& where,
                    bool rectified = false);

/// The topic on which image_transport has the CameraInfo of a topic of images: a/b/image → a/b/camera_info.
/// `compressed`: it is a transport's, below the images': a/b/image/compressedDepth → a/b/camera_info.
std::string camera_info_topic(const std::string& images, bool compressed = false);

/// Whether a topic of images is of undistorted ones, as image_proc names theirs ("a/b/image_rect"): the
/// `rectified` of scan_from_depth().
bool is_rectified(const std::string& images);

/// A pose out of tf as a Scan takes it: the rotation exactly orthonormal. Throws Error(data) that names
/// `where` for what is not finite, or a quaternion farther than 1e-2 from unit length.
Eigen::Isometry3d pose_from_transform(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation,
                                      const std::string& where);

/// grid_map_msgs/GridMap as export_grid_map() writes it. Throws Error(data) for a grid without cells.
std::string grid_map_message(const HeightGrid& grid, const std::string& frame, MessageEncoding encoding);

/// convex_plane_decomposition_msgs/PlanarTerrain as export_planar_terrain() writes it, which says what it
/// needs.
std::string planar_terrain_message(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                   const std::string& frame, MessageEncoding encoding);

}  // namespace octosurf
