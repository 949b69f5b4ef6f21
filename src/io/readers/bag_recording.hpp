#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/bag_index.hpp"
#include "io/readers/scan_motion.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/scan.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::io {

/// Properties of one sensor's scans.
struct RecordedSensor {
  std::string name;           ///< its topic, or the folder of its files
  bool images = false;        ///< depth images, not clouds
  bool moves_within = false;  ///< its clouds may have point times, and motion to undo
  SensorKind kind = SensorKind::lidar;
};

/// The posed scans of a bag: its clouds and depth images by header time.
class BagRecording {
 public:
  /// Reads the bag once. Throws Error(data) for a damaged one; with options.skip_bad, damaged parts add a
  /// line to `left_out` instead.
  BagRecording(const std::vector<std::filesystem::path>& files, const ScanSourceOptions& options,
               std::vector<std::string>& left_out);

  /// Clouds in the map's frame are read as seen from the sensor, whatever the form of poses.
  bool moves_clouds() const { return !robot_.empty(); }
  /// Some topic has scans.
  bool has_scans() const;
  /// Takes topics, camera and poses as the options name them, or the only ones; with options.poses, no poses.
  /// Call it once. Throws Error(data) if requested topics or frames are missing, or if there are several.
  void choose(const ScanSourceOptions& options);

  std::size_t size() const { return scans_.size(); }
  double stamp_s(std::size_t scan) const { return static_cast<double>(scans_[scan].stamp_ns) / 1e9; }
  std::uint32_t sensor(std::size_t scan) const { return scans_[scan].topic; }  ///< of sensors()
  /// One for each topic of the bag.
  std::vector<RecordedSensor> sensors() const;

  /// Throws Error(data) with topic and time if the scan or its pose is bad.
  RawScan read(std::size_t scan);
  /// Of the scan's frame at a time, or else NoPose.
  Eigen::Isometry3d pose_at(std::size_t scan, double stamp_s) const;

  /// T_frame_sensor at the scan's time, by tf; or else NoPose.
  Eigen::Isometry3d sensor_in(const std::string& frame, std::size_t scan) const;

  /// What was taken, a line each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void choose_scans(const BagOptions& options);
  void choose_cameras(const ScanSourceOptions& options);
  void choose_camera(const TopicContents& images);
  void choose_tree();
  void choose_poses(const BagOptions& options);
  void choose_pose_topic(const TopicContents& topic, const BagOptions& options);
  void note_left_out();
  void settle_doubts(const BagOptions& options);
  void require_one_clock() const;
  void choose_fixed_frame(const BagOptions& options, const std::string& why);
  void choose_unit(const TopicContents& images);
  [[noreturn]] void refuse(const std::string& what, const std::string& hint) const;
  const TopicContents& named(const std::string& topic, const char* option, const char* what,
                             bool (*fits)(const TopicContents&)) const;
  Eigen::Isometry3d pose(const std::string& frame, std::int64_t stamp_ns) const;
  Eigen::Isometry3d pose_on_topic(std::int64_t stamp_ns) const;
  std::string name_of(const ListedMessage& scan) const;

  struct Camera {
    Intrinsics given;                     ///< for all its images, unless there are
    const TopicContents* info = nullptr;  ///< messages, in index_
    bool rectified = false;
  };
  /// With the lens whose distortion is to be undone; null: none.
  std::pair<Intrinsics, const Lens*> camera_of(const ListedMessage& listed, int width, int height,
                                               const std::string& where) const;

  std::vector<std::filesystem::path> files_;
  std::uint64_t bytes_ = 0;  // of the files
  std::unique_ptr<Bag> bag_;
  BagIndex index_;
  TransformTree tree_;  // of index_.trees
  std::vector<ListedMessage> scans_;
  std::map<std::uint32_t, Camera> cameras_;    // by the images' topic
  std::optional<double> depth_scale_;          // as stated
  std::map<std::uint32_t, double> units_;      // per metre, by the images' topic, as the bag says
  bool posed_ = true, in_map_ = false;         // as the options say
  const TopicContents* pose_topic_ = nullptr;  // in index_; null: tf
  std::string pose_child_;                     // frame of its poses; empty: the sensor's
  std::string fixed_frame_;
  std::string robot_;  // clouds are in the map's frame, and are seen from here; empty: they are not
  std::vector<std::string> notes_;
};

}  // namespace octosurf::io
