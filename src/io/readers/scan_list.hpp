#pragma once

#include "io/readers/bag_recording.hpp"
#include "io/readers/depth_image.hpp"
#include "io/readers/file_kind.hpp"
#include "io/readers/pose_file.hpp"
#include "io/readers/scan_graph.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf::io {

/// Location of a scan that was not read yet.
struct ListedScan {
  std::filesystem::path file;
  FileKind kind = FileKind::unknown;
  std::size_t index = 0;              ///< of the scans in a .graph or a bag
  std::uint32_t sensor = 0;           ///< of ListedRecording::sensors
  std::optional<FilePose> pose{};     ///< from a file that holds the poses of many scans
  std::filesystem::path pose_file{};  ///< of this scan alone; empty: none
  std::optional<double> stamp_s{};
};

/// Common data of the scans of one folder (or of consecutive files from one folder).
struct ListedRecording {
  std::filesystem::path folder;  ///< the scans stand here
  std::vector<ListedScan> scans;
  std::vector<RecordedSensor> sensors;
  std::optional<Intrinsics> camera;  ///< of images
  double depth_scale = 1000;
  std::shared_ptr<const ScanGraphFile> graph;
  std::shared_ptr<BagRecording> bag;
  std::shared_ptr<const Trajectory> trajectory;  ///< poses by time; overrides the scans' own
  PoseForm pose_form = PoseForm::as_given;
  /// Sensor frame to the frame of the pose file.
  Eigen::Isometry3d T_posed_sensor = Eigen::Isometry3d::Identity();

  /// T_map_sensor of a pose as the recording has it.
  Eigen::Isometry3d sensor_at(const Eigen::Isometry3d& pose) const;
};

struct ScanList {
  std::vector<ListedRecording> recordings;
  std::vector<std::string> left_out;  ///< one line for every scan that has no pose at its time
  std::vector<std::string> notes;     ///< one line for every choice made
};

/// Finds the scans of open_scans() with their poses, intrinsics and time stamps; same errors.
ScanList list_scans(const std::vector<std::filesystem::path>& inputs, const ScanSourceOptions& options);

/// Points as their file or message has them, in metres by options.depth_scale, with the pose that the
/// recording has for them. Throws Error(data) if the scan or its pose is bad.
RawScan read_posed(const ListedRecording& recording, const ListedScan& listed,
                   const ScanSourceOptions& options);

/// Seconds, if the file is called like a time: 1305031102.160407.png, 000012_1305031102.160407.pcd, or
/// s, ms, us or ns since 1970, or 1305031102_160407000.
std::optional<double> stamp_in_name(const std::filesystem::path& file);

/// The scans of one folder, in natural order, without poses and intrinsics; depth.txt gives stamps.
ListedRecording list_folder(const std::filesystem::path& folder);

/// Stamps from times.txt, depth.txt, or the files' names, in seconds; none if there are none. Throws
/// Error(data), also for names whose nanoseconds miss their leading zeros.
void find_stamps(ListedRecording& recording);

/// Poses beside the scans, if the scans need any.
void find_poses(ListedRecording& recording, const ScanSourceOptions& options,
                std::vector<std::string>& notes);

/// Assigns the poses of one file: by time if both sides have it, else by order.
void pose_all(const std::vector<ListedRecording*>& recordings, PoseFile poses,
              const ScanSourceOptions& options, std::vector<std::string>& notes);

/// Files called like the scans, with one pose each (ScanNet's pose/12.txt for depth/12.png); false: there are
/// none. Throws Error(data) if scans lack theirs and others are left over.
bool take_poses_in(const std::filesystem::path& folder, ListedRecording& recording,
                   std::vector<std::string>& notes);

/// Scans without a pose at their time are left out, as in TUM's own tools, but reported.
void leave_out_unposed(ScanList& list);

/// full2 before full10.
bool natural_less(const std::string& a, const std::string& b);

/// Whether files of these kinds can be in one recording.
bool same_family(FileKind a, FileKind b);

/// True for a TUM RGB-D folder and for its folder `depth`.
bool is_tum(const std::filesystem::path& folder);

/// The folder, and the one above if the name (frames, scans, …) is that of a recording's subfolder.
std::vector<std::filesystem::path> around(const std::filesystem::path& folder);

/// The one file of these names in these folders; empty if there is none. Throws Error(data) that names
/// `option` if there are two.
std::filesystem::path find_beside(const std::vector<std::filesystem::path>& folders,
                                  const std::vector<std::string>& names, const char* option);

/// Throws Error(data): so many `what` in the file, and so many scans.
[[noreturn]] void fail_count(const std::filesystem::path& file, std::size_t scans, std::size_t others,
                             const char* what, const char* or_else = "");

}  // namespace octosurf::io
