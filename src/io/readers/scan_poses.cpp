#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>

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

/// KITTI's poses are those of the left camera, and its calib.txt has the scanner's pose as `Tr`.
void find_velodyne_in_camera(ListedRecording& recording, const std::optional<PoseForm>& stated,
                             std::vector<std::string>& notes) {
  if (stated && *stated != PoseForm::of_camera) return;
  const fs::path file = find_beside(around(recording.folder), {"calib.txt"}, "--poses");
  for (const auto& line : file.empty() ? std::vector<TextLine>{} : read_text(file)) {
    if (line.words[0] != "Tr:" && line.words[0] != "Tr") continue;
    const auto v = numbers({line.number, {line.words.begin() + 1, line.words.end()}}, file);
    if (v.size() != 12)
      throw Error(Error::Kind::data, at_line(file, line.number), "Tr is not followed by 12 numbers");
    recording.T_posed_sensor = rigid(pose_from_rows(v), at_line(file, line.number));
    recording.pose_form = PoseForm::as_given;
    notes.push_back(file.string() +
                    ": poses of 3x4 numbers are taken as the camera's, as KITTI has them; --pose-form "
                    "as-given if they are the scanner's");
    return;
  }
  if (!stated)
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

/// Times that were rounded are poses of others.
void note_times(const std::string& where, const char* what, std::vector<double> stamps, const char* mend,
                std::vector<std::string>& notes) {
  const std::size_t all = stamps.size();
  const bool whole = all > 1 && std::ranges::all_of(stamps, [](double s) { return s == std::floor(s); });
  std::ranges::sort(stamps);
  const auto again = std::ranges::unique(stamps);
  stamps.erase(again.begin(), again.end());
  if (stamps.size() < all || whole)
    notes.push_back(where + formatted(": %zu %s have %zu different times%s: if they were rounded, %s", all,
                                      what, stamps.size(), whole ? ", whole seconds" : "", mend));
}

/// " (transforms.json is not read: …)"; empty: there is no such file, as of nerfstudio or Polycam.
std::string json_beside(const fs::path& folder) {
  for (const fs::path& place : {folder, fs::absolute(folder).lexically_normal().parent_path()})
    for (const char* const name : {"transforms.json", "cameras"})
      if (fs::exists(place / name))
        return std::string(" (") + name + " is not read: write tx ty tz qx qy qz qw, a line for each)";
  return {};
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
  const std::size_t left = scans - std::min(options.skip, scans), read = std::min(options.first, left);
  std::size_t begin = 0;  // the scan of the first pose
  if (poses.stamped && stamps.size() == scans) {
    drop_bad(poses);
    trajectory = std::make_shared<const Trajectory>(trajectory_of(poses.poses));
    const auto found = std::ranges::count_if(
        stamps, [&](double stamp) { return trajectory->gap_at(to_ns(stamp), largest_pose_gap_ns).empty(); });
    poses.notes.push_back(std::to_string(found) + " of " + count_of(scans, "scan") + " matched by time");
    if (!recordings.front()->bag)  // else perhaps of several sensors
      note_times(recordings.front()->folder.string(), "scans", stamps,
                 "give others by times.txt, or poses without times, in the scans' order", notes);
    stamps.clear();
    for (const FilePose& pose : poses.poses) stamps.push_back(*pose.stamp_s);
    note_times(poses.file.string(), "poses", stamps,
               "write fractions of a second, or no times: one pose for each scan, in their order", notes);
  } else if (scans == poses.poses.size()) {
    poses.notes.push_back("one pose for each scan, in order");
  } else if (read == poses.poses.size()) {
    begin = options.skip;
    poses.notes.push_back("one pose for each of the " + std::to_string(read) + " scans that are read");
  } else {
    fail_count(poses.file, scans, poses.poses.size(), "pose",
               poses.stamped ? "; or name the scans by time (s, ms, us or ns since 1970) to match them by it"
                             : "; --skip and --first choose the scans that they are of");
  }
  for (const std::string& note : poses.notes) notes.push_back("poses: " + poses.file.string() + ": " + note);
  std::size_t next = 0;
  for (ListedRecording* recording : recordings) {
    if (poses.kitti && recording->scans.front().kind == FileKind::velodyne)
      find_velodyne_in_camera(*recording, options.pose_form, notes);
    if (poses.w_first && recording->pose_form == PoseForm::w_first) recording->pose_form = PoseForm::as_given;
    recording->trajectory = trajectory;
    if (trajectory) continue;
    for (auto& scan : recording->scans) {
      // Scans that are not read get the nearest pose: they are skipped.
      const std::size_t at = std::max(next++, begin) - begin;
      scan.pose = poses.poses[std::min(at, poses.poses.size() - 1)];
      if (scan.stamp_s || !scan.pose->stamp_s) continue;
      if (!std::isfinite(*scan.pose->stamp_s))
        throw Error(Error::Kind::data, scan.pose->where, "the time stamp is not finite");
      scan.stamp_s = scan.pose->stamp_s;
    }
  }
}

bool take_poses_in(const fs::path& folder, ListedRecording& recording, std::vector<std::string>& notes) {
  std::vector<std::string> lacking, files;
  for (auto& scan : recording.scans) {
    const std::string name = scan.file.stem().string() + ".txt";
    if (!fs::is_regular_file(folder / name)) lacking.push_back(scan.file.filename().string());
  }
  if (lacking.size() == recording.scans.size()) return false;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".txt" && !is_hidden(entry->path()))
      files.push_back(entry->path().filename().string());
  const auto [first, last] = std::ranges::minmax_element(files, natural_less);
  if (!lacking.empty() && files.size() + lacking.size() > recording.scans.size())
    throw Error(Error::Kind::data, folder.string(),
                "poses from " + *first + " to " + *last + ", but scans from " +
                    recording.scans.front().file.filename().string() + " to " +
                    recording.scans.back().file.filename().string() + ": " + lacking.front() + " has none",
                "call each pose like its scan; or give one file with all poses in order");
  for (auto& scan : recording.scans) scan.pose_file = folder / (scan.file.stem().string() + ".txt");
  notes.push_back("poses: " + folder.string() + ": a file for each scan, called like it");
  return true;
}

void find_poses(ListedRecording& recording, const ScanSourceOptions& options,
                std::vector<std::string>& notes) {
  auto& scans = recording.scans;
  const FileKind kind = scans.front().kind;
  if (kind == FileKind::graph || recording.bag) return;  // their own
  for (auto& scan : scans) scan.pose_file = own_pose_file(scan.file);
  if (std::ranges::any_of(scans, [](const auto& s) { return fs::exists(s.pose_file); })) return;
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
                count_of(scans.size(), "scan") + " without poses" + json_beside(recording.folder),
                "give --poses FILE");
}

void leave_out_unposed(ScanList& list) {
  for (auto& recording : list.recordings) {
    if (!recording.trajectory) continue;
    const auto gap_of = [&](const ListedScan& scan) {
      return recording.trajectory->gap_at(to_ns(*scan.stamp_s), largest_pose_gap_ns);
    };
    const std::string first_gap = gap_of(recording.scans.front());
    std::erase_if(recording.scans, [&](const ListedScan& scan) {
      const std::string gap = gap_of(scan);
      if (!gap.empty())
        list.left_out.push_back(scan.file.string() + ": no pose at its time (" + gap + "); left out");
      return !gap.empty();
    });
    if (recording.scans.empty())
      throw Error(Error::Kind::data, recording.folder.string(),
                  "no scan has a pose at its time; of the first: " + first_gap,
                  "the time stamps of scans and poses must be of one clock, and poses at most 0.1 s apart");
  }
}

}  // namespace octosurf::io
