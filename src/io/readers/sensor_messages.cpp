#include "io/readers/sensor_messages.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace octosurf::io {
namespace {

std::string without_slash(std::string frame) {
  if (frame.starts_with('/')) frame.erase(0, 1);
  return frame;
}

/// A PointField's datatype.
Scalar scalar_of(std::uint8_t datatype) {
  constexpr std::array types{Scalar::none,  Scalar::int8,   Scalar::uint8,   Scalar::int16,  Scalar::uint16,
                             Scalar::int32, Scalar::uint32, Scalar::float32, Scalar::float64};
  return datatype < types.size() ? types[datatype] : Scalar::none;
}

/// Fields of a cloud, as offsets in a point.
struct CloudFields {
  Coordinates xyz;
  TimeField time;
};

CloudFields read_fields(MessageReader& message) {
  CloudFields fields;
  std::array<int, 3> found{};
  for (std::uint32_t count = message.u32(); count > 0; --count) {
    const std::string name = message.text();
    const std::uint32_t offset = message.u32();
    const Scalar type = scalar_of(message.u8());
    message.u32();  // values of it; drivers write 0 or 1
    fields.time.note(name, {offset, 0, 0, type});
    const auto axis = axis_of(name);
    if (!axis) continue;
    if (!is_real(type)) fail_reading("its field " + name + " is no float32 or float64");
    fields.xyz[*axis] = {offset, 0, 0, type};
    ++found[*axis];
  }
  if (found != std::array{1, 1, 1}) fail_reading("a cloud without one each of x, y and z");
  return fields;
}

// Until its motion is undone: before and after, with its time, in double and in float, and its ray's start.
constexpr std::uint64_t bytes_of_timed_point =
    3 * sizeof(Eigen::Vector3f) + sizeof(double) + 2 * sizeof(float);

/// Behind the first point's time; leaves the message at the list of points.
std::uint32_t livox_points(MessageReader& message) {
  message.u32();                             // number of points, as in the list's head
  for (int i = 0; i < 4; ++i) message.u8();  // lidar's number, reserved
  return message.u32();
}

bool is_livox_type(std::string_view type) {
  return type.starts_with("livox") && type.ends_with("/CustomMsg");
}

Cloud read_livox_message(MessageReader& message, std::uint64_t largest_size) {
  const std::uint64_t first_ns = message.u64();
  const std::uint64_t count = livox_points(message);
  if (count > largest_size / bytes_of_timed_point)
    fail_reading("a cloud of " + std::to_string(count) + " points, far more than its bag's size");
  Cloud cloud;
  cloud.times.field = "offset_time";
  for (std::uint64_t i = 0; i < count; ++i) {
    cloud.times.values.push_back(static_cast<double>(first_ns + message.u32()));
    Eigen::Vector3f point;
    for (float& value : point) value = message.f32();
    message.u8();  // reflectivity
    const std::uint8_t tag = message.u8();
    message.u8();  // laser
    // Bits 0 and 1 tell noise by its place, 2 and 3 by its intensity: 0 is none, 1 and 2 are sure and likely
    // noise of the first driver's lidars, doubtful and bad points of the second's; 3 is unlikely or unused.
    const auto is_noise = [&](int shift) { return ((tag >> shift & 3) + 1) / 2 == 1; };
    if (point.isZero(0) || is_noise(0) || is_noise(2))
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
    cloud.points.push_back(point);
  }
  return cloud;
}

void check_positive_side(std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0 || width > largest_side || height > largest_side)
    fail_reading("an image of " + size_text(width, height) + " pixels");
}

/// Of `image`, whose pixels are there.
template <class Pixel>
std::vector<Eigen::Vector3f> points_of(const ImageMessage& image, const Intrinsics& camera, double scale,
                                       const Lens* lens) {
  const auto pixel = [&](std::size_t u, std::size_t v) {
    return number_at<Pixel>(image.data.data() + v * image.step + sizeof(Pixel) * u, image.big_endian);
  };
  return back_project(static_cast<std::size_t>(image.width), static_cast<std::size_t>(image.height), camera,
                      scale, pixel, lens);
}

}  // namespace

MessageReader::MessageReader(std::string_view bytes, MessageEncoding encoding)
    : bytes_(bytes), encoding_(encoding) {
  if (encoding == MessageEncoding::ros1) return;
  if (encoding != MessageEncoding::cdr) fail_reading("is not serialised as ROS 1 or ROS 2 do");
  if (bytes.starts_with("\x28\xb5\x2f\xfd"))
    bytes = unpacked_ = decompressed(bytes);  // --compression-mode message
  // Little-endian or big-endian plain CDR; the other encapsulations are parameter lists.
  if (bytes.size() < 4) fail_reading("ends too early");
  if (bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
    fail_reading(formatted("not CDR as ROS 2 writes it, 00 00 or 00 01, but %02x %02x",
                           static_cast<unsigned char>(bytes[0]), static_cast<unsigned char>(bytes[1])));
  big_endian_ = bytes[1] == 0;
  bytes_ = RecordBytes(bytes.substr(4));
}

std::uint64_t MessageReader::number(std::size_t width) {
  if (encoding_ == MessageEncoding::cdr) bytes_.take((width - bytes_.position() % width) % width);  // aligned
  return bytes_.number(width, big_endian_);
}

std::string MessageReader::text() {
  std::string_view text = bytes();
  if (encoding_ == MessageEncoding::cdr && text.ends_with('\0')) text.remove_suffix(1);
  return std::string(text);
}

Eigen::Vector3d read_vector(MessageReader& message) {
  Eigen::Vector3d v;
  for (double& value : v) value = message.f64();
  return v;
}

Eigen::Quaterniond read_quaternion(MessageReader& message) {
  Eigen::Quaterniond q;
  for (double& value : q.coeffs()) value = message.f64();  // x y z w, as ROS has them
  return q;
}

MessageHeader read_header(MessageReader& message) {
  if (message.numbers_headers()) message.u32();
  const auto seconds =
      static_cast<std::int32_t>(message.u32());  // ROS 1's are unsigned; both end in 2038 here
  const std::uint32_t nanoseconds = message.u32();
  return {std::int64_t{1000000000} * seconds + nanoseconds, without_slash(message.text())};
}

Cloud read_cloud_message(MessageReader& message, std::uint64_t largest_size, std::string_view type) {
  read_header(message);
  if (is_livox_type(type)) return read_livox_message(message, largest_size);
  const std::uint64_t height = message.u32(), width = message.u32();
  Cloud cloud;
  if (width == 0 || height == 0) return cloud;  // a scan without returns; its fields may be none
  auto [xyz, time] = read_fields(message);
  const bool big_endian = message.u8() != 0;
  const std::uint64_t step = message.u32(), row_step = message.u32();
  const std::string_view data = message.bytes();
  for (Field& c : xyz) {
    c.step = step;
    if (c.offset + size_of(c.type) > step) fail_reading("a field of it lies outside of its points");
  }
  if (time.place && time.place->offset + size_of(time.place->type) > step) time = {};
  if (time.place) time.place->step = step;
  const std::uint64_t row = height > 1 ? row_step : width * step;
  // This order avoids overflow: width and step have 32 bits, and so has `row` when there are rows.
  if (width * step > data.size() || row < width * step || (data.size() - width * step) / row < height - 1)
    fail_reading("says it has " + size_text(width, height) + " points of " + std::to_string(step) +
                 " bytes, but holds " + std::to_string(data.size()) + " bytes");
  if (width * height > largest_size / (time.place ? bytes_of_timed_point : sizeof(Eigen::Vector3f)))
    fail_reading("a cloud of " + std::to_string(width * height) + " points, far more than its bag's size");
  cloud = binary_points(data, xyz, big_endian, width, height, row);
  cloud.times = binary_times(data, time, big_endian, width, height, row);
  return cloud;
}

bool is_cloud_type(std::string_view type) { return type == "sensor_msgs/PointCloud2" || is_livox_type(type); }

std::uint64_t points_in(MessageReader& message, std::string_view type) {
  read_header(message);
  if (!is_livox_type(type)) {
    const std::uint64_t height = message.u32();
    return height * message.u32();
  }
  message.u64();  // the first point's time
  return livox_points(message);
}

DepthKind depth_kind(std::string_view encoding) {
  if (encoding == "16UC1" || encoding == "mono16") return DepthKind::millimetres;
  return encoding == "32FC1" ? DepthKind::metres : DepthKind::none;
}

ImageMessage read_image_message(MessageReader& message) {
  read_header(message);
  const std::uint32_t height = message.u32(), width = message.u32();
  ImageMessage image;
  image.encoding = message.text();
  image.big_endian = message.u8() != 0;
  image.step = message.u32();
  image.data = message.bytes();
  check_positive_side(width, height);
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  return image;
}

bool CompressedImageMessage::is_depth() const {
  // IHDR is a PNG's first chunk: bit depth is byte 24, colour type byte 25 (0 is gray).
  const bool gray16 = data.starts_with("\x89PNG") && data.size() > 25 && data[24] == 16 && data[25] == 0;
  return gray16 || format.find("16UC1") != std::string::npos || format.find("mono16") != std::string::npos ||
         format.find("compressedDepth") != std::string::npos;
}

CompressedImageMessage read_compressed_image_message(MessageReader& message) {
  read_header(message);
  CompressedImageMessage image;
  image.format = message.text();
  image.data = message.bytes();
  return image;
}

std::vector<Eigen::Vector3f> points_of(const ImageMessage& image, const Intrinsics& camera, const Lens* lens,
                                       std::optional<double> units_per_metre, std::uint64_t largest_size) {
  const DepthKind kind = depth_kind(image.encoding);
  if (kind == DepthKind::none)
    fail_reading("an image of encoding '" + image.encoding.substr(0, 20) +
                 "' is no depth image (16UC1, mono16, 32FC1)");
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  const std::size_t row = width * (kind == DepthKind::metres ? sizeof(float) : sizeof(std::uint16_t));
  if (image.step < row || row > image.data.size() || (image.data.size() - row) / image.step < height - 1)
    fail_reading("says it has " + size_text(width, height) + " pixels in rows of " +
                 std::to_string(image.step) + " bytes, but holds " + std::to_string(image.data.size()) +
                 " bytes");
  if (width * height > largest_size / (sizeof(Eigen::Vector3f) + sizeof(std::uint16_t)))
    fail_reading("an image of " + size_text(width, height) + " pixels, far more than its bag's size");
  return kind == DepthKind::metres
             ? points_of<float>(image, camera, units_per_metre.value_or(1), lens)
             : points_of<std::uint16_t>(image, camera, units_per_metre.value_or(1000), lens);
}

DepthImage depth_of(const CompressedImageMessage& image, const std::string& where,
                    std::uint64_t largest_size) {
  const auto says = [&](const char* word) { return image.format.find(word) != std::string::npos; };
  if (!says("compressedDepth")) return read_png(image.data, where, largest_size);
  // compressed_depth_image_transport: the kind of its head, and two numbers that depth of 32FC1 is quantised
  // with, 0 or not set for 16UC1.
  RecordBytes head(image.data);
  const std::uint32_t kind = head.u32();
  const float a = std::bit_cast<float>(head.u32()), b = std::bit_cast<float>(head.u32());
  DepthImage depth = head.rest().starts_with("\x89PNG") ? read_png(head.rest(), where, largest_size)
                     : says("png")                      ? read_png(head.rest(), where, largest_size)
                                                        : read_rvl(head.rest(), largest_size);
  const bool millimetres = says("16UC1") || says("mono16");
  // The farthest depth that it encodes, by pixel value 1: its writer's depth_max.
  const float farthest = a / (1 - b);
  constexpr float least_farthest = 0.1F, most_farthest = 1e4F;  // m
  const bool quantised =
      kind == 0 && a > 0 && std::isfinite(b) && farthest >= least_farthest && farthest <= most_farthest;
  if (says("32FC1") && !quantised)
    fail_reading("depth of 32FC1, whose head does not say how it is quantised");
  if (!millimetres && quantised) {
    depth.quant_a = a;
    depth.quant_b = b;
  }
  return depth;
}

CameraInfoMessage read_camera_info(MessageReader& message) {
  read_header(message);
  const std::uint32_t height = message.u32(), width = message.u32();
  CameraInfoMessage info;
  info.lens.model = message.text();
  for (std::uint32_t count = message.u32(); count > 0; --count) info.lens.d.push_back(message.f64());
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  for (double& value : k) value = message.f64();
  for (double& value : r) value = message.f64();
  for (double& value : p) value = message.f64();
  info.raw = {k[0], k[4], k[2], k[5]};
  info.rectified = {p[0], p[5], p[2], p[6]};
  if (info.calibrated()) check_positive_side(width, height);  // else from a driver that is starting
  const auto side = [&] { return static_cast<int>(std::min(message.u32(), largest_side)); };
  info.binning_x = std::max(1, side());
  info.binning_y = std::max(1, side());
  info.left = side();
  info.top = side();
  info.rows = side();
  info.columns = side();
  info.width = static_cast<int>(width);
  info.height = static_cast<int>(height);
  return info;
}

const Intrinsics& intrinsics_for(const CameraInfoMessage& camera, bool rectified) {
  const Intrinsics& chosen = rectified && camera.rectified.fx != 0 ? camera.rectified : camera.raw;
  if (!std::isfinite(chosen.fx + chosen.fy + chosen.cx + chosen.cy) || chosen.fx == 0 || chosen.fy == 0)
    fail_reading("a camera whose focal length is zero or not finite: it is not calibrated");
  return chosen;
}

Intrinsics intrinsics_for(const CameraInfoMessage& camera, bool rectified, int width, int height) {
  Intrinsics part = intrinsics_for(camera, rectified);
  const bool whole = camera.columns == 0 || camera.rows == 0;
  const int columns = whole ? camera.width : camera.columns, rows = whole ? camera.height : camera.rows;
  if (columns / camera.binning_x == width && rows / camera.binning_y == height) {
    if (!whole) part.cx -= camera.left, part.cy -= camera.top;
    // A pixel's middle is a whole number, and that of binned ones is between theirs.
    part.cx = (part.cx + 0.5) / camera.binning_x - 0.5;
    part.cy = (part.cy + 0.5) / camera.binning_y - 0.5;
    part.fx /= camera.binning_x;
    part.fy /= camera.binning_y;
  } else if (width != camera.width || height != camera.height) {
    fail_reading(
        "an image of " + size_text(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)) +
        " pixels, but its camera has " +
        size_text(static_cast<std::uint64_t>(camera.width), static_cast<std::uint64_t>(camera.height)));
  }
  return part;
}

const Lens* lens_of(const CameraInfoMessage& camera, bool rectified) {
  const bool of_p = &intrinsics_for(camera, rectified) == &camera.rectified;
  return !of_p && camera.lens.bends() ? &camera.lens : nullptr;
}

std::vector<Eigen::Vector3f> read_depth_message(
    MessageReader& message, std::string_view type, std::optional<double> units_per_metre,
    const std::string& where, std::uint64_t largest_size,
    const std::function<std::pair<Intrinsics, const Lens*>(int, int)>& camera_of) {
  std::optional<DepthImage> unpacked;
  ImageMessage image;
  if (type == "sensor_msgs/CompressedImage") {
    unpacked = depth_of(read_compressed_image_message(message), where, largest_size);
    image.width = unpacked->width, image.height = unpacked->height;
  } else {
    image = read_image_message(message);
  }
  const auto [camera, lens] = camera_of(image.width, image.height);
  return unpacked ? back_project(*unpacked, camera, units_per_metre.value_or(unpacked->default_scale()), lens)
                  : points_of(image, camera, lens, units_per_metre, largest_size);
}

void for_each_transform(MessageReader& message, const std::function<void(const TransformMessage&)>& visit) {
  for (std::uint32_t count = message.u32(); count > 0; --count) {
    TransformMessage transform;
    transform.header = read_header(message);
    transform.child_frame = without_slash(message.text());
    transform.translation = read_vector(message);
    transform.rotation = read_quaternion(message);
    visit(transform);
  }
}

bool is_pose_type(std::string_view type) {
  return type == "nav_msgs/Odometry" || type == "nav_msgs/Path" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped" || type == "geometry_msgs/TransformStamped";
}

std::vector<TransformMessage> read_pose_message(MessageReader& message, std::string_view type) {
  TransformMessage pose;
  pose.header = read_header(message);
  if (type == "nav_msgs/Path") {
    std::vector<TransformMessage> poses;
    for (std::uint32_t count = message.u32(); count > 0; --count) {
      poses.push_back(read_pose_message(message, "geometry_msgs/PoseStamped").front());
      poses.back().header.frame = pose.header.frame;
    }
    if (poses.empty() || poses.back().header.stamp_ns != 0) return poses;
    poses.back().header = pose.header;
    return {poses.back()};
  }
  if (type == "nav_msgs/Odometry" || type == "geometry_msgs/TransformStamped")
    pose.child_frame = without_slash(message.text());
  pose.translation = read_vector(message);
  pose.rotation = read_quaternion(message);
  return {pose};
}

}  // namespace octosurf::io
