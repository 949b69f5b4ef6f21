#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf {

/// Selection of a bag's topics and frames. An empty field is chosen automatically if there is only one
/// candidate, which ScanSource::notes() reports; with several, an Error lists them.
struct BagOptions {
  /// PointCloud2, or depth as Image or CompressedImage.
  std::vector<std::string> topics;
  /// Poses by Odometry, PoseStamped, PoseWithCovarianceStamped or TransformStamped, instead of by tf.
  std::optional<std::string> pose_topic;
  /// The frame whose poses the pose topic contains; empty: Odometry's child frame, else the sensor's. Of
  /// clouds that are in the map's frame: where their rays start.
  std::optional<std::string> pose_frame;
  /// The frame of the map in tf; empty: `map`, if the sensor hangs below it, else the root above the sensor.
  std::optional<std::string> fixed_frame;
  /// CameraInfo of the depth images; empty: `camera_info` beside the images' topic.
  std::optional<std::string> info_topic;
  /// Of several trees with the same frames (/a/tf, /b/tf) the one to take; empty: that of the scans'
  /// namespace.
  std::optional<std::string> tf = {};
  /// Take the recorder's time for all stamps, where drivers have clocks of their own.
  bool recorded_stamps = false;
};

/// Whether a sensor's motion within a scan is undone (octosurf/deskew.hpp).
enum class Deskew {
  automatic,  ///< where points have times, and poses are as frequent as scans
  off         ///< never; Scan::times_s says when points were taken, if they say so
};

/// A box that holds parts of the robot, in a frame that moves with it.
struct SelfBox {
  Eigen::AlignedBox3d box;           ///< m
  std::optional<std::string> frame;  ///< of a bag's tf; empty: the sensor's
};

/// Options of open_scans().
struct ScanSourceOptions {
  /// One pose per scan, over all inputs in order, or a stamped trajectory for scans with time stamps; or a
  /// folder of files with one pose each, called like the scans.
  /// Overrides poses found beside or inside the scans. See below for the formats.
  std::optional<std::filesystem::path> poses;
  /// Of depth images: 3×3 K, or `fx fy cx cy`. Overrides a file found beside the images.
  std::optional<std::filesystem::path> intrinsics;
  /// Depth image units per metre; empty: 5000 for TUM folders, else 1000.
  std::optional<double> depth_scale;
  /// Floats of a point in velodyne files, x y z first; empty: 4, or what their values say.
  std::optional<std::size_t> fields;
  /// Scans per second if there are no time stamps; empty: 30 for depth cameras, 10 for lidar.
  std::optional<double> rate_hz;
  /// Maximum time between neighbouring poses for interpolation; empty: 0.1 for files of poses, 0.25 for bags.
  std::optional<double> max_pose_gap_s;
  /// Subtracted from all coordinates, m, to bring them within reach of octree and float; empty: 0, or whole
  /// metres near the first scan if it lies farther than `origin_beyond_m` from 0 (UTM, ECEF).
  std::optional<Eigen::Vector3d> origin;
  double origin_beyond_m = 8192;  ///< m; from here on float rounds by more than half a millimetre
  BagOptions bag;                 ///< of bags
  /// Continue after a scan that cannot be read or whose pose is not a rigid motion.
  bool skip_bad = false;
  /// Whether the motion within scans is undone.
  Deskew deskew = Deskew::automatic;
  /// Of clouds; empty: by their readings' directions, see guess_sensor(). Depth images are a camera's.
  std::optional<SensorKind> sensor = {};
  /// Units per metre of clouds, and of poses in the same file; empty: 1.
  std::optional<double> cloud_scale = {};
  /// m: ranges (of cameras: depths) that stand for no return, to the millimetre. Empty: values beyond 4 m
  /// that many readings share, with hardly any before them; notes() reports them.
  std::vector<double> no_return = {};
  /// Readings in them are the robot itself: no readings, nor do their rays free space.
  std::vector<SelfBox> self_boxes = {};
  /// m: rays without a return free space up to this range: pixels of depth images (float: +∞) four from
  /// any reading at least, and readings of clouds that stand for no return. 0: off, as dark things give none.
  double clear_no_return_m = 0;
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
  /// source without any good scan; with skip_bad, bad ones go to skipped(). Time stamps never decrease from
  /// one input to the next. About 3 ms for a 640×480 PNG.
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

  /// One line for every automatic choice: a bag's topics, camera and poses, kinds of sensors, values without
  /// a return. The last may come with any scan.
  virtual std::vector<std::string> notes() const { return {}; }

  /// Poses come from files of poses or a bag, not from the scans' own files.
  virtual bool posed_elsewhere() const { return false; }

  /// Subtracted from all coordinates of the inputs, m.
  virtual Eigen::Vector3d origin() const { return Eigen::Vector3d::Zero(); }
};

/// Kind of an input.
enum class InputKind {
  scans,         ///< a folder or file that open_scans reads
  occupancy_map  ///< OctoMap's .bt or .ot
};

/// Determined by content, then by file extension. Throws Error(data) if there is no such file, or it is
/// neither.
InputKind classify(const std::filesystem::path& input);

/// Opens folders and files; several are consecutive recordings. Supported inputs:
///
/// - 7-Scenes: `X.depth.png` with `X.pose.txt` (camera to map), in the folder or in `frames/`.
/// - TUM RGB-D: a folder with `depth.txt` and `groundtruth.txt`. A pose is interpolated between its
///   neighbours in time if they are at most 0.1 s apart, else the nearest within 0.02 s is taken.
///   Intrinsics default to 525 525 319.5 239.5.
/// - 16-bit depth images (PNG; PGM P5, P2), in the folder, `frames/` or `depth/`. If some are named
///   `*depth*`, only those.
/// - PCD (any version, padding, counts of 0) and PLY (either byte order, lists), in the folder, `scans/` or
///   `clouds/`; in the sensor's frame. A PCD's VIEWPOINT is its pose; a PLY has none.
/// - KITTI velodyne: `*.bin`, in the folder or `velodyne/`, of 4 floats a point, or of 3 to 8 as told apart
///   by their values. KITTI poses (3×4) are the camera's: if `calib.txt` has a line `Tr:` (velodyne to
///   camera), T_map_velodyne = pose · Tr. `times.txt`.
/// - OctoMap `.graph`.
/// - Bags of ROS 1 (2.0) and ROS 2 (`.db3`, also with its -wal, `.mcap`; a file, or the folder with
///   `metadata.yaml`; if one has no scans, all are one recording): PointCloud2 of any layout with x, y, z as
///   float32 or float64, or Livox' CustomMsg, without its noise; depth as Image (16UC1, mono16 in
///   millimetres, 32FC1 in metres) or CompressedImage (16-bit PNG; compressedDepth as PNG or RVL) with the
///   last CameraInfo before it, whose K (P for images called `rect`), binning and roi are used; lens
///   distortion is not corrected. In the order of their headers' time stamps; where the poses' clock is set
///   back, another pass begins. Poses come from tf, static and moving, or from a topic, interpolated unless
///   one has the scan's exact time; a scan without a pose is a bad one. Clouds in a frame that stands still
///   (map, odom, camera_init, …) are seen from the robot. No index is needed. A truncated bag is rejected, or
///   with skip_bad read up to the cut.
///
/// A `pose.txt` or `poses.txt` beside the scans is used, and a `camera-intrinsics.txt`, `intrinsics.txt`,
/// `camera.txt`, `K.txt` or `*.K` beside them, in the folder above or beside the file of poses. Scans of a
/// folder come in natural order (full2 before full10), files in the order given. PCDs and PLYs, a single
/// image and a single velodyne scan are taken to be in the map frame if there is no pose for them. Files
/// called like a time (`1305031102.16.png`; `1403636579763555584.png` in ns, likewise us, ms), alone or
/// behind a word or number (`000012_1305031102.16.pcd`, `cloud_1403636579_763555584.pcd`), are stamped with
/// it.
///
/// Clouds whose points lie farther than 8192 m from 0 (no sensor reaches so far) are in the map's frame, and
/// their VIEWPOINT or pose says where the sensor was.
///
/// Depth is along the optical axis: a pixel (u, v) of depth z is ((u−cx) z/fx, (v−cy) z/fy, z). Depths 0 and
/// 65535 give no points, nor do flying pixels: up to four at an edge, between the nearer and the farther
/// surface. Points exactly at a cloud's origin and values that stand for no return are set to NaN.
///
/// The sensor of a cloud is recognised by its readings' directions, in any order: an even raster is a depth
/// camera's. The first of up to 20 scans of each topic or folder that has 100 readings decides, on opening;
/// of smaller ones an organised cloud is a camera's.
///
/// Formats of pose files are recognised by their columns (blanks or commas, `#` comments): `tx ty tz qx qy qz
/// qw`; 3×4 row-major; 4×4 row-major in one line or in four; each in one line also with a time stamp in
/// front. A 4×4 whose last row is `0 0 0 TIME` carries a time stamp. Of a table with a header (EuRoC's CSV,
/// rostopic echo -p) the columns are found by its names. Poses are T_map_sensor. Time stamps may be in s, ms,
/// us or ns: recognised by their size, or else by the scans'. If poses and scans have time stamps, they are
/// matched by time, whatever their numbers. Poses that are no rigid motion are then left out, which notes()
/// reports.
///
/// Motion within a scan is undone by its points' times: a field called t, time, timestamp, offset_time or
/// alike in PointCloud2, PCD and PLY, or Livox' message. Its unit (s, ms, µs, ns) is recognised by the length
/// of a scan, its zero by the scans' time stamps: either the same clock, or times after the stamp. notes()
/// reports both and how far points move; for a bag's lidar without such times, how far it moves within a
/// scan.
///
/// Throws Error(usage) for invalid options, Error(data) for errors found before reading any scan: missing
/// or empty input, no poses, no intrinsics, different counts.
std::unique_ptr<ScanSource> open_scans(const std::vector<std::filesystem::path>& inputs,
                                       const ScanSourceOptions& options = {});

}  // namespace octosurf
