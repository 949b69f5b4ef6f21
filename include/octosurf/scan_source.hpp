#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/pose_forms.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// A bag's topics and frames. Where one is not named, the only one is taken, which ScanSource::notes()
/// reports; of several an Error lists them.
struct BagOptions {
  /// PointCloud2, or depth as Image or CompressedImage.
  std::vector<std::string> topics = {};
  /// Poses by Odometry, Path, PoseStamped, PoseWithCovarianceStamped or TransformStamped, instead of by tf.
  std::optional<std::string> pose_topic = {};
  /// The frame whose poses the pose topic contains; empty: Odometry's child frame, else the sensor's. Of
  /// clouds whose frame is the map's: where their rays start.
  std::optional<std::string> pose_frame = {};
  /// The frame of the map in tf; empty: `map`, if the sensor hangs below it, else the root above the sensor.
  std::optional<std::string> fixed_frame = {};
  bool recorded_stamps = false;  ///< the recorder's time for all stamps, where drivers' clocks differ
};

/// A box that holds parts of the robot, in a frame that moves with it.
struct SelfBox {
  Eigen::AlignedBox3d box;           ///< m
  std::optional<std::string> frame;  ///< of a bag's tf; empty: the sensor's
};

/// Options of open_scans().
struct ScanSourceOptions {
  /// One pose per scan, over all inputs in order; a stamped trajectory; or a folder of files with one pose
  /// each, called like the scans. Overrides poses found beside or inside the scans.
  std::optional<std::filesystem::path> poses = {};
  /// Of depth images: 3×3 K, or `fx fy cx cy`. Overrides a file found beside the images.
  std::optional<std::filesystem::path> intrinsics = {};
  /// Units per metre of depth images, and of clouds with the poses in their files; empty: of images what the
  /// bag says (librealsense's Depth_Units), 5000 for TUM folders, 1000 for other whole numbers, 1 for floats;
  /// of clouds 1.
  std::optional<double> depth_scale = {};
  /// Empty: as given; but 3×4 poses of KITTI's scans are the camera's if calib.txt says where the scanner is.
  std::optional<PoseForm> pose_form = {};
  /// Where clouds without a pose were seen from, in their frame, m. Empty: their origin; a single cloud that
  /// cannot have been seen from there (over a quarter of it would lie behind the rest): above it, along z.
  std::optional<Eigen::Vector3d> viewpoint = {};
  /// Subtracted from all coordinates, m, to bring them within reach of octree and float; empty: 0, or whole
  /// metres near the first scan if it lies farther than `origin_beyond_m` from 0 (UTM, ECEF).
  std::optional<Eigen::Vector3d> origin = {};
  double origin_beyond_m = 8192;  ///< m; from here on float rounds by more than half a millimetre
  BagOptions bag = {};            ///< of bags
  bool skip_bad = false;          ///< continue after a scan that cannot be read or has no rigid pose
  /// Of clouds; empty: a lidar's, unless their frame is an optical one (sensor_of_frame()) or a PCD is one
  /// column, as scans of a camera are kept. Depth images are a camera's.
  std::optional<SensorKind> sensor = {};
  /// m: ranges (of cameras: depths) that stand for no return, to the millimetre, besides 0, what is not
  /// finite and a format's largest number.
  std::vector<double> no_return = {};
  /// Readings in them are the robot itself: no readings, nor do their rays free space.
  std::vector<SelfBox> self_boxes = {};
  std::size_t skip = 0;  ///< scans that will be left out at the beginning
  /// Most that will be read from there on: poses that are as many as these, and not as all, are theirs.
  std::size_t first = std::numeric_limits<std::size_t>::max();
};

/// A sequence of posed scans, decoded on demand.
class ScanSource {
 public:
  ScanSource() = default;
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;
  virtual ~ScanSource() = default;

  /// Number of scans listed, bad ones included.
  virtual std::size_t size() const = 0;

  /// The next scan, or empty at the end. Throws Error(data) with the scan's name for a bad one, and for a
  /// source without any good scan; with skip_bad, bad ones go to skipped().
  virtual std::optional<Scan> next() = 0;

  /// Leaves out the next scans; false if there are fewer. With skip_bad only good ones count, so each is
  /// decoded; without it none is decoded, and bad ones count.
  virtual bool skip(std::size_t count) {
    for (; count > 0; --count)
      if (!next()) return false;
    return true;
  }

  /// One line for every scan left out so far, with the reason: bad ones with skip_bad, and always a
  /// recording's images without a pose at their time.
  virtual const std::vector<std::string>& skipped() const = 0;

  /// One line for everything that no option states: a bag's topics, camera and poses, and what is undone.
  virtual std::vector<std::string> notes() const { return {}; }

  /// A camera's if any scan is; scans say it one by one.
  virtual SensorKind sensor() const { return SensorKind::depth_camera; }

  /// Subtracted from all coordinates of the inputs, m.
  virtual Eigen::Vector3d origin() const { return Eigen::Vector3d::Zero(); }
};

/// Whether an input is OctoMap's .bt or .ot, not a folder or file of scans: by content, then by file
/// extension. Throws Error(data) if there is no such file, or it is neither.
bool is_occupancy_map(const std::filesystem::path& input);

/// Opens folders and files; several are consecutive recordings. docs/formats.md §4 lists inputs and pose
/// files, docs/usage.md what is read of bags.
///
/// - Scans of a folder come in natural order (full2 before full10), files in the order given, messages in the
///   order of their headers' time stamps. A bag's scan without a pose is a bad one.
/// - A pixel (u, v) of depth z is ((u−cx) z/fx, (v−cy) z/fy, z). Flying pixels, up to four at an edge
///   between the nearer and the farther surface, give no points. Values that stand for no return become NaN.
/// - Poses are interpolated between neighbours at most 0.1 s apart, 0.25 s in bags. Scans without time stamps
///   are 30 a second of cameras, 10 of lidars.
/// - Motion within a scan is undone (deskew.hpp) by its points' times, a field called t, time, timestamp,
///   offset_time or alike, or Livox' message, if poses are as frequent as scans; else Scan::times_s has them.
///
/// Throws Error(usage) for invalid options, Error(data) for errors found before reading any scan: missing
/// or empty input, no poses, no intrinsics, different counts.
std::unique_ptr<ScanSource> open_scans(const std::vector<std::filesystem::path>& inputs,
                                       const ScanSourceOptions& options = {});

}  // namespace octosurf
