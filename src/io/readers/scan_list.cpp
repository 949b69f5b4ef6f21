#include "io/readers/scan_list.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr Intrinsics tum_camera{525, 525, 319.5, 239.5};  // its "default" calibration, used for depth

[[noreturn]] void differ(const fs::path& file, std::size_t scans, std::size_t others, const char* what) {
  throw Error(Error::Kind::data, file.string(), count_of(others, what) + " for " + count_of(scans, "scan"),
              std::string("give one ") + what + " per scan, in the order of the scans");
}

/// The one file of these names in these folders; empty if there is none.
fs::path find_beside(const std::vector<fs::path>& folders, const std::vector<std::string>& names,
                     const char* option) {
  for (const auto& folder : folders) {
    std::vector<fs::path> found;
    for (const auto& name : names)
      if (fs::is_regular_file(folder / name)) found.push_back(folder / name);
    if (found.size() > 1)
      throw Error(Error::Kind::data, folder.string(),
                  "holds both " + found[0].filename().string() + " and " + found[1].filename().string(),
                  std::string("choose one with ") + option);
    if (!found.empty()) return found[0];
  }
  return {};
}

/// With the images, in the folder over them, or beside the poses.
fs::path find_intrinsics(const fs::path& folder, const std::optional<fs::path>& poses) {
  fs::path whole = fs::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  std::vector<fs::path> places{whole, whole.parent_path()};
  if (poses) places.push_back(fs::absolute(*poses).parent_path());
  for (const auto& place : places) {
    std::vector<std::string> names{"camera-intrinsics.txt", "intrinsics.txt", "camera.txt", "K.txt"};
    std::error_code error;
    for (fs::directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error))
      if (entry->path().extension() == ".K") names.push_back(entry->path().filename().string());
    const fs::path found = find_beside({place}, names, "--intrinsics");
    if (!found.empty()) return found;
  }
  return {};
}

/// X.depth.png → X.pose.txt (7-Scenes).
fs::path own_pose_file(const fs::path& image) {
  const fs::path stem = image.stem();
  if (stem.extension() != ".depth") return {};
  return image.parent_path() / (stem.stem().string() + ".pose.txt");
}

void find_stamps(ListedRecording& recording) {
  auto& scans = recording.scans;
  if (scans.front().stamp_s || scans.front().kind == FileKind::graph || recording.bag) return;
  const fs::path times = find_beside(around(recording.folder), {"times.txt"}, "--rate");
  if (!times.empty()) {
    const auto lines = read_text(times);
    if (lines.size() != scans.size()) differ(times, scans.size(), lines.size(), "time stamp");
    for (std::size_t i = 0; i < scans.size(); ++i)
      scans[i].stamp_s = time_stamp(lines[i].words[0], times, lines[i].number);
    return;
  }
  if (!std::all_of(scans.begin(), scans.end(), [](const auto& s) { return stamp_in_name(s.file); })) return;
  for (auto& scan : scans) scan.stamp_s = stamp_in_name(scan.file);
}

void find_camera(ListedRecording& recording, const ScanSourceOptions& options) {
  if (recording.scans.front().kind != FileKind::image) return;
  recording.depth_scale = options.depth_scale.value_or(is_tum(recording.folder) ? 5000 : 1000);
  const fs::path file =
      options.intrinsics ? *options.intrinsics : find_intrinsics(recording.folder, options.poses);
  if (!file.empty())
    recording.camera = read_intrinsics(file);
  else if (is_tum(recording.folder))
    recording.camera = tum_camera;
  else
    throw Error(Error::Kind::data, recording.folder.string(), "depth images without camera intrinsics",
                "give --intrinsics FILE (3x3 K, or fx fy cx cy)");
}

/// KITTI's poses are those of the left camera; its calib.txt has the scanner's pose.
void find_velodyne_in_camera(ListedRecording& recording) {
  const fs::path file = find_beside(around(recording.folder), {"calib.txt"}, "--poses");
  if (file.empty()) return;
  for (const auto& line : read_text(file)) {
    if (line.words[0] != "Tr:") continue;
    const TextLine values{line.number, {line.words.begin() + 1, line.words.end()}};
    const auto v = numbers(values, file);
    if (v.size() != 12)
      throw Error(Error::Kind::data, at_line(file, line.number), "Tr: is not followed by 12 numbers");
    recording.T_posed_sensor = rigid(pose_from_rows(v), at_line(file, line.number));
  }
}

/// Assigns the poses of one file: by time if both sides have it, else by order.
void pose_all(const std::vector<ListedRecording*>& recordings, const PoseFile& poses,
              const ScanSourceOptions& options) {
  std::size_t scans = 0;
  bool stamped = poses.stamped;
  for (const ListedRecording* recording : recordings) {
    scans += recording->scans.size();
    stamped = stamped && recording->scans.front().stamp_s;
  }
  if (!stamped && scans != poses.poses.size()) differ(poses.file, scans, poses.poses.size(), "pose");
  const auto trajectory =
      stamped ? std::make_shared<const Trajectory>(poses, options.max_pose_gap_s.value_or(largest_pose_gap_s))
              : nullptr;
  std::size_t next = 0;
  for (ListedRecording* recording : recordings) {
    if (poses.kitti && recording->scans.front().kind == FileKind::velodyne)
      find_velodyne_in_camera(*recording);
    recording->trajectory = trajectory;
    if (stamped) continue;
    for (auto& scan : recording->scans) {
      scan.pose = poses.poses[next++];
      if (!scan.stamp_s) scan.stamp_s = scan.pose->stamp_s;
    }
  }
}

/// Poses beside the scans, if the scans need any.
void find_poses(ListedRecording& recording, const ScanSourceOptions& options) {
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
  if (!file.empty()) return pose_all({&recording}, read_poses(file), options);
  const bool needed = kind == FileKind::image || kind == FileKind::velodyne;
  if (needed && (scans.size() > 1 || is_tum(recording.folder)))
    throw Error(Error::Kind::data, recording.folder.string(),
                count_of(scans.size(), "scan") + " without poses", "give --poses FILE");
}

/// Scans without a pose at their time are left out, as in TUM's own tools, but reported.
void leave_out_unposed(ScanList& list) {
  for (auto& recording : list.recordings) {
    if (!recording.trajectory) continue;
    const auto unposed = [&](const ListedScan& scan) { return !recording.trajectory->covers(*scan.stamp_s); };
    for (const auto& scan : recording.scans)
      if (unposed(scan)) list.left_out.push_back(scan.file.string() + ": no pose at its time; left out");
    std::erase_if(recording.scans, unposed);
    if (recording.scans.empty())
      throw Error(Error::Kind::data, recording.folder.string(), "no scan has a pose at its time",
                  "the time stamps of scans and poses must be of one clock");
  }
}

/// Consecutive files from one folder are one recording, in the order given.
void add_file(const fs::path& input, std::vector<ListedRecording>& recordings, bool& last_is_files) {
  const FileKind kind = kind_of(input);
  const fs::path folder = input.has_parent_path() ? input.parent_path() : fs::path(".");
  const bool continues = last_is_files && kind != FileKind::graph && recordings.back().folder == folder &&
                         same_family(recordings.back().scans.front().kind, kind);
  if (!continues) {
    recordings.emplace_back();
    recordings.back().folder = folder;
  }
  recordings.back().scans.emplace_back();
  recordings.back().scans.back().file = input;
  recordings.back().scans.back().kind = kind;
  last_is_files = kind != FileKind::graph;
}

/// One recording per .graph, with its scans.
void open_graph(ListedRecording& recording) {
  if (recording.scans.front().kind != FileKind::graph) return;
  if (recording.scans.size() > 1)
    throw Error(Error::Kind::data, recording.folder.string(), "holds several .graph files",
                "name the one that is meant");
  recording.graph = std::make_shared<const ScanGraphFile>(recording.scans.front().file);
  recording.scans.resize(recording.graph->size(), recording.scans.front());
  for (std::size_t i = 0; i < recording.scans.size(); ++i) recording.scans[i].index = i;
}

/// One recording per bag, or per bags of one folder, with its scans.
void open_bags(ListedRecording& recording, const ScanSourceOptions& options, ScanList& list) {
  if (recording.scans.front().kind != FileKind::bag) return;
  std::vector<fs::path> files;
  for (const auto& scan : recording.scans) files.push_back(scan.file);
  recording.bag = std::make_shared<BagRecording>(files, options, list.left_out);
  recording.scans.assign(recording.bag->size(), recording.scans.front());
  for (std::size_t i = 0; i < recording.scans.size(); ++i) {
    recording.scans[i].index = i;
    recording.scans[i].stamp_s = recording.bag->stamp_s(i);
  }
  for (const std::string& note : recording.bag->notes())
    list.notes.push_back(files.front().string() + ": " + note);
}

void check_options(const ScanSourceOptions& options) {
  const auto positive = [](const std::optional<double>& value, const char* name) {
    if (value && !(std::isfinite(*value) && *value > 0))
      throw Error(Error::Kind::usage, name, std::to_string(*value) + " is not a positive number");
  };
  positive(options.depth_scale, "depth_scale");
  positive(options.rate_hz, "rate_hz");
  if (const auto gap = options.max_pose_gap_s; gap && !(*gap >= 0))
    throw Error(Error::Kind::usage, "max_pose_gap", std::to_string(*gap) + " is not a number of seconds");
}

}  // namespace

std::optional<double> stamp_in_name(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t digits = std::min(stem.find_first_not_of("0123456789"), stem.size());
  const char *begin = stem.data() + (stem[digits] == '_' && digits > 0 ? digits + 1 : 0),
             *end = stem.data() + stem.size();
  double stamp = 0;
  const auto [stop, error] = std::from_chars(begin, end, stamp, std::chars_format::fixed);
  if (error != std::errc() || stop != end || stem.find('.') == std::string::npos || !std::isfinite(stamp))
    return std::nullopt;
  return stamp;
}

ScanList list_scans(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  check_options(options);
  if (inputs.empty())
    throw Error(Error::Kind::usage, "", "no input given", "name a folder or files of scans");
  ScanList list;
  bool last_is_files = false;
  for (const auto& input : inputs) {
    if (classify(input) == InputKind::occupancy_map)
      throw Error(Error::Kind::usage, input.string(), "an occupancy map, not scans", "give it alone");
    if (!fs::is_directory(input)) {
      add_file(input, list.recordings, last_is_files);
    } else {
      list.recordings.push_back(list_folder(input));
      last_is_files = false;
    }
  }
  for (auto& recording : list.recordings) {
    open_graph(recording);
    open_bags(recording, options, list);
    find_camera(recording, options);
    find_stamps(recording);
    if (!options.poses) find_poses(recording, options);
  }
  if (options.poses) {
    std::vector<ListedRecording*> all;
    for (auto& recording : list.recordings) {
      if (recording.graph)
        throw Error(Error::Kind::usage, recording.scans.front().file.string(),
                    "a .graph has poses of its own", "leave --poses away");
      all.push_back(&recording);
    }
    pose_all(all, read_poses(*options.poses), options);
  }
  leave_out_unposed(list);
  return list;
}

}  // namespace octosurf::io
