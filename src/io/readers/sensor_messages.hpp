#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/depth_image.hpp"
#include "io/readers/lens.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <bit>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace octosurf::io {

/// Reads a ROS message's fields in the order of its definition, in both of ROS' encodings. Throws
/// std::runtime_error if the message ends too early; never allocates for missing data.
class MessageReader {
 public:
  /// `bytes` must outlive it. Throws std::runtime_error for another encoding.
  MessageReader(std::string_view bytes, MessageEncoding encoding);

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  float f32() { return std::bit_cast<float>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  std::string text();
  std::string_view bytes() { return bytes_.take(u32()); }  ///< of a uint8[]
  /// A Header begins with a sequence number, as in ROS 1.
  bool numbers_headers() const { return encoding_ == MessageEncoding::ros1; }

 private:
  std::uint64_t number(std::size_t width);

  std::string unpacked_;
  RecordBytes bytes_;
  MessageEncoding encoding_;
  bool big_endian_ = false;
};

inline std::unique_ptr<MessageReader> message_reader(std::string_view bytes, MessageEncoding encoding) {
  return std::make_unique<MessageReader>(bytes, encoding);
}

// The sensor and pose messages of ROS 1 and ROS 2. Reading throws std::runtime_error with the message's
// defect; callers that know topic and time convert it to an Error.

struct MessageHeader {
  std::int64_t stamp_ns = 0;
  std::string frame;  ///< without ROS 1's leading slash
};
MessageHeader read_header(MessageReader& message);

/// geometry_msgs/Point, Vector3.
Eigen::Vector3d read_vector(MessageReader& message);
/// geometry_msgs/Quaternion.
Eigen::Quaterniond read_quaternion(MessageReader& message);

/// PointCloud2, and CustomMsg of Livox' drivers (livox_ros_driver, livox_ros_driver2, livox_interfaces).
bool is_cloud_type(std::string_view type);
/// Its points in its frame: x, y, z as float32 or float64 at any offset, of either byte order, with padding
/// between points and rows. Points exactly at the origin, and those that Livox' tag calls noise, become not
/// finite. `largest_size`: memory limit of the points in bytes.
Cloud read_cloud_message(MessageReader& message, std::uint64_t largest_size,
                         std::string_view type = "sensor_msgs/PointCloud2");
/// The number of points that a message of such a type says it has.
std::uint64_t points_in(MessageReader& message, std::string_view type);

enum class DepthKind {
  none,         ///< a picture
  millimetres,  ///< 16UC1, mono16
  metres        ///< 32FC1
};
DepthKind depth_kind(std::string_view encoding);

/// A sensor_msgs/Image, its pixels not yet read.
struct ImageMessage {
  int width = 0, height = 0;
  std::string encoding;
  bool big_endian = false;
  std::size_t step = 0;   ///< bytes of a row
  std::string_view data;  ///< of the message
};
ImageMessage read_image_message(MessageReader& message);

/// A sensor_msgs/CompressedImage: depth as a 16-bit PNG, or of compressed_depth_image_transport: PNG or RVL,
/// in millimetres (16UC1) or as quantised inverse depth (32FC1).
struct CompressedImageMessage {
  std::string format;
  std::string_view data;
  bool is_depth() const;
};
CompressedImageMessage read_compressed_image_message(MessageReader& message);

/// Points of a depth image, which with their pixels take at most `largest_size` bytes; `units_per_metre`
/// empty: 1000 for millimetres, 1 for metres. `lens` null: without distortion.
std::vector<Eigen::Vector3f> points_of(const ImageMessage& image, const Intrinsics& camera, const Lens* lens,
                                       std::optional<double> units_per_metre, std::uint64_t largest_size);
/// `where` names the message for the PNG's decoder, which throws Error(data). A format that does not name the
/// encoding is of 32FC1 if the head has its numbers.
DepthImage depth_of(const CompressedImageMessage& image, const std::string& where,
                    std::uint64_t largest_size);

struct CameraInfoMessage {
  int width = 0, height = 0;         ///< of the sensor; drivers write that of a part or of binned images, too
  Intrinsics raw;                    ///< K, of the whole sensor
  Intrinsics rectified;              ///< P's left part
  Lens lens;                         ///< distortion_model and D
  int binning_x = 1, binning_y = 1;  ///< pixels that are one in an image
  int left = 0, top = 0, columns = 0, rows = 0;  ///< the part of the sensor (roi); 0 columns: the whole
  bool calibrated() const { return raw.fx != 0 || rectified.fx != 0; }
  bool operator==(const CameraInfoMessage&) const = default;
};
CameraInfoMessage read_camera_info(MessageReader& message);

/// The intrinsics, K or P; `rectified`: is_rectified(), and P where it is set. Throws if the camera is not
/// calibrated.
const Intrinsics& intrinsics_for(const CameraInfoMessage& camera, bool rectified);
/// Of its images of this size: part and binning are taken off, as REP 104 says, unless the size is that of
/// the message. Throws if it is neither.
Intrinsics intrinsics_for(const CameraInfoMessage& camera, bool rectified, int width, int height);

/// The lens whose distortion its images have; null: none, as of rectified ones.
const Lens* lens_of(const CameraInfoMessage& camera, bool rectified);

/// Points of an Image, or of a CompressedImage, by its type; `camera_of(width, height)`: of such images.
std::vector<Eigen::Vector3f> read_depth_message(
    MessageReader& message, std::string_view type, std::optional<double> units_per_metre,
    const std::string& where, std::uint64_t largest_size,
    const std::function<std::pair<Intrinsics, const Lens*>(int, int)>& camera_of);

struct TransformMessage {
  MessageHeader header;
  std::string child_frame;  ///< empty for PoseStamped and PoseWithCovarianceStamped, which have none
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};
/// Visits the transforms of a tf2_msgs/TFMessage.
void for_each_transform(MessageReader& message, const std::function<void(const TransformMessage&)>& visit);

/// nav_msgs/{Odometry, Path} and geometry_msgs/{PoseStamped, PoseWithCovarianceStamped, TransformStamped}.
bool is_pose_type(std::string_view type);
/// Its pose; of a Path all, or, if they have no times, the last at the Path's.
std::vector<TransformMessage> read_pose_message(MessageReader& message, std::string_view type);

}  // namespace octosurf::io
