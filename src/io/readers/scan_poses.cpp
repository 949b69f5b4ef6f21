#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

/// X.depth.png → X.pose.txt (7-Scenes).
fs::path own_pose_file(const fs::path& image) {
  const fs::path stem = image.stem();
  if (stem.extension() != ".depth") return {};
  return image.parent_path() / (stem.stem().string() + ".pose.txt");
}

/// KITTI's poses are those of the left camera; its calib.txt has the scanner's pose as `Tr` of the odometry,
/// or as `Tr_velo_to_cam` or `Tr_velo_cam`, before a rectification, of the object and tracking sets.
void find_velodyne_in_camera(ListedRecording& recording, std::vector<std::string>& notes) {
  const fs::path file = find_beside(around(recording.folder), {"calib.txt"}, "--poses");
  bool found = false;
  Eigen::Isometry3d rectification = Eigen::Isometry3d::Identity();
  for (const auto& line : file.empty() ? std::vector<TextLine>{} : read_text(file)) {
    std::string name(line.words[0]);
    if (name.ends_with(':')) name.pop_back();
    const bool rectifies = name == "R0_rect" || name == "R_rect";
    if (!rectifies && name != "Tr" && name != "Tr_velo_to_cam" && name != "Tr_velo_cam") continue;
    const TextLine values{line.number, {line.words.begin() + 1, line.words.end()}};
    const auto v = numbers(values, file);
    if (v.size() != (rectifies ? 9U : 12U))
      throw Error(Error::Kind::data, at_line(file, line.number),
                  name + " is not followed by " + (rectifies ? "9" : "12") + " numbers");
    if (rectifies) {
      const std::vector<double> rows{v[0], v[1], v[2], 0, v[3], v[4], v[5], 0, v[6], v[7], v[8], 0};
      rectification = rigid(pose_from_rows(rows), at_line(file, line.number));
    } else {
      recording.T_posed_sensor = rigid(pose_from_rows(v), at_line(file, line.number));
      found = true;
    }
  }
  recording.T_posed_sensor = found ? rectification * recording.T_posed_sensor : Eigen::Isometry3d::Identity();
  if (!found)
    notes.push_back(
        recording.folder.string() +
        ": poses of 3x4 numbers are taken as the scanner's, as no calib.txt with Tr lies beside; if "
        "they are the camera's, --pose-form of-camera");
}

/// Leaves out poses that are no rigid motion or have no time, as tf2 does.
void drop_bad(PoseFile& poses) {
  const std::size_t before = poses.poses.size();
  std::string first;
  std::erase_if(poses.poses, [&](const FilePose& pose) {
    const bool bad = !is_good(pose);
    if (bad && first.empty()) first = pose.where;
    return bad;
  });
  if (poses.poses.empty())
    throw Error(Error::Kind::data, first, "pose is not a rigid motion, nor is any of the file",
                "give poses as rotation and translation, quaternions of unit length");
  const std::size_t left = before - poses.poses.size();
  if (left > 0)
    poses.notes.push_back(count_of(left, "pose") +
                          " left out, no rigid motion at a finite time, the first at " + first);
}

/// What a user should know of poses matched by time.
std::string describe_match(const std::vector<double>& stamps, const Trajectory& trajectory,
                           std::int64_t gap_ns) {
  std::size_t found = 0, between = 0;
  double largest = 0;
  for (const double stamp : stamps) {
    found += trajectory.covers(to_ns(stamp), gap_ns) ? 1 : 0;
    if (const auto step = trajectory.step_at(to_ns(stamp), gap_ns)) {
      ++between;
      largest = std::max(largest, static_cast<double>(*step) / 1e9);
    }
  }
  std::ostringstream text;
  text.precision(3);
  text << found << " of " << count_of(stamps.size(), "scan") << " matched by time";
  if (between > 0) text << ", " << between << " interpolated between poses at most " << largest << " s apart";
  return text.str();
}

}  // namespace

void pose_all(const std::vector<ListedRecording*>& recordings, PoseFile poses,
              const ScanSourceOptions& options, std::vector<std::string>& notes) {
  std::vector<double> stamps;
  std::size_t scans = 0;
  for (const ListedRecording* recording : recordings)
    for (const ListedScan& scan : recording->scans) {
      ++scans;
      if (scan.stamp_s) stamps.push_back(*scan.stamp_s);
    }
  std::shared_ptr<const Trajectory> trajectory;
  const std::int64_t gap_ns = to_ns(options.max_pose_gap_s.value_or(largest_pose_gap_s));
  if (poses.stamped && stamps.size() == scans) {
    drop_bad(poses);
    trajectory = std::make_shared<const Trajectory>(trajectory_of(poses.poses));
    poses.notes.push_back(describe_match(stamps, *trajectory, gap_ns));
    if (!trajectory->jumps().empty()) poses.notes.push_back(text_of_jumps(*trajectory));
  } else if (scans != poses.poses.size()) {
    fail_count(poses.file, scans, poses.poses.size(), "pose",
               poses.stamped ? "; or stamp the scans, by their names, to match them by time" : "");
  } else {
    poses.notes.push_back("one pose for each scan, in order");
  }
  for (const std::string& note : poses.notes) notes.push_back("poses: " + poses.file.string() + ": " + note);
  std::size_t next = 0;
  for (ListedRecording* recording : recordings) {
    if (poses.kitti && recording->scans.front().kind == FileKind::velodyne)
      find_velodyne_in_camera(*recording, notes);
    recording->trajectory = trajectory;
    recording->pose_gap_ns = gap_ns;
    if (trajectory) continue;
    for (auto& scan : recording->scans) {
      scan.pose = poses.poses[next++];
      if (scan.stamp_s || !scan.pose->stamp_s) continue;
      if (!std::isfinite(*scan.pose->stamp_s))
        throw Error(Error::Kind::data, scan.pose->where, "the time stamp is not finite");
      scan.stamp_s = scan.pose->stamp_s;
    }
  }
}

bool take_poses_in(const fs::path& folder, ListedRecording& recording, std::vector<std::string>& notes) {
  const auto pose_file = [&](const ListedScan& scan) {
    return folder / (scan.file.stem().string() + ".txt");
  };
  if (!fs::is_regular_file(pose_file(recording.scans.front()))) return false;
  for (auto& scan : recording.scans) scan.pose_file = pose_file(scan);
  notes.push_back("poses: " + folder.string() + ": a file for each scan, called like it");
  return true;
}

void find_poses(ListedRecording& recording, const ScanSourceOptions& options,
                std::vector<std::string>& notes) {
  auto& scans = recording.scans;
  const FileKind kind = scans.front().kind;
  if (kind == FileKind::graph || recording.bag) return;  // their own
  for (auto& scan : scans) scan.pose_file = own_pose_file(scan.file);
  if (std::any_of(scans.begin(), scans.end(), [](const auto& s) { return fs::exists(s.pose_file); })) return;
  for (auto& scan : scans) scan.pose_file.clear();

  const std::vector<std::string> names = is_tum(recording.folder)
                                             ? std::vector<std::string>{"groundtruth.txt"}
                                             : std::vector<std::string>{"pose.txt", "poses.txt"};
  const fs::path file = find_beside(around(recording.folder), names, "--poses");
  if (!file.empty()) return pose_all({&recording}, read_poses(file), options, notes);
  for (const fs::path& place : around(recording.folder))
    for (const char* const name : {"pose", "poses"})
      if (take_poses_in(place / name, recording, notes)) return;
  const bool needed = kind == FileKind::image || kind == FileKind::velodyne;
  if (needed && (scans.size() > 1 || is_tum(recording.folder)))
    throw Error(Error::Kind::data, recording.folder.string(),
                count_of(scans.size(), "scan") + " without poses", "give --poses FILE");
}

void leave_out_unposed(ScanList& list) {
  for (auto& recording : list.recordings) {
    if (!recording.trajectory) continue;
    const auto gap_of = [&](const ListedScan& scan) {
      const std::string gap = recording.trajectory->gap_at(to_ns(*scan.stamp_s), recording.pose_gap_ns);
      std::ostringstream most;
      most << ", and --max-pose-gap is " << static_cast<double>(recording.pose_gap_ns) / 1e9 << " s";
      return gap.ends_with("apart") ? gap + most.str() : gap;
    };
    const std::string first_gap = gap_of(recording.scans.front());
    std::erase_if(recording.scans, [&](const ListedScan& scan) {
      const std::string gap = gap_of(scan);
      if (!gap.empty())
        list.left_out.push_back(scan.file.string() + ": no pose at its time (" + gap + "); left out");
      return !gap.empty();
    });
    if (recording.scans.empty())
      throw Error(
          Error::Kind::data, recording.folder.string(),
          "no scan has a pose at its time; of the first: " + first_gap,
          "the time stamps of scans and poses must be of one clock; --max-pose-gap allows larger steps");
  }
}

}  // namespace octosurf::io
