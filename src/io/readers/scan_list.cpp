#include "io/readers/scan_list.hpp"

#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr Intrinsics tum_camera{525, 525, 319.5, 239.5};  // its "default" calibration, used for depth

[[noreturn]] void differ(const fs::path& file, std::size_t scans, std::size_t others, const char* what,
                         const char* or_else = "") {
  throw Error(Error::Kind::data, file.string(), count_of(others, what) + " for " + count_of(scans, "scan"),
              std::string("give one ") + what + " per scan, in the order of the scans" + or_else);
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

void convert_stamps(std::vector<ListedScan>& scans) {
  std::vector<double> stamps;
  for (const ListedScan& scan : scans) stamps.push_back(*scan.stamp_s);
  to_seconds(stamps);
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].stamp_s = stamps[i];
}

void find_stamps(ListedRecording& recording) {
  auto& scans = recording.scans;
  if (recording.bag) return;
  if (scans.front().stamp_s) return convert_stamps(scans);  // of depth.txt
  if (scans.front().kind == FileKind::graph) return;
  const fs::path times = find_beside(around(recording.folder), {"times.txt"}, "--rate");
  if (!times.empty()) {
    const auto lines = read_text(times);
    if (lines.size() != scans.size()) differ(times, scans.size(), lines.size(), "time stamp");
    for (std::size_t i = 0; i < scans.size(); ++i)
      scans[i].stamp_s = time_stamp(lines[i].words[0], times, lines[i].number);
    return convert_stamps(scans);
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

/// By the first file of the recording that has readings enough.
void find_floats(ListedRecording& recording, const ScanSourceOptions& options,
                 std::vector<std::string>& notes) {
  if (recording.scans.front().kind != FileKind::velodyne) return;
  if (options.fields) {
    recording.floats = *options.fields;
    return;
  }
  const fs::path& first = recording.scans.front().file;
  recording.floats = floats_of_velodyne(first);
  if (recording.floats != ListedRecording{}.floats)
    notes.push_back(first.string() + ": " + std::to_string(recording.floats) +
                    " floats a point, by its values: x y z first; --fields says otherwise");
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

/// The trajectory with its times in the scans' unit, if they are covered by that alone.
Trajectory in_unit_of(const std::vector<double>& stamps, Trajectory trajectory,
                      std::vector<std::string>& notes) {
  const auto covered = [&](const Trajectory& candidate) {
    return std::ranges::count_if(stamps, [&](double stamp) { return candidate.covers(stamp); });
  };
  if (covered(trajectory) > 0) return trajectory;
  for (const double factor : {1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9}) {
    Trajectory scaled = trajectory.scaled(factor);
    if (2 * covered(scaled) <= static_cast<std::ptrdiff_t>(stamps.size())) continue;
    std::ostringstream text;
    text << "its times are multiplied by " << factor << " to be in the scans' unit";
    notes.push_back(text.str());
    return scaled;
  }
  return trajectory;
}

/// What a user should know of poses matched by time.
std::string describe_match(const std::vector<double>& stamps, const Trajectory& trajectory) {
  std::size_t found = 0, between = 0;
  double largest = 0;
  for (const double stamp : stamps) {
    found += trajectory.covers(stamp) ? 1 : 0;
    if (const auto step = trajectory.step_at(stamp)) {
      ++between;
      largest = std::max(largest, *step);
    }
  }
  std::ostringstream text;
  text.precision(3);
  text << found << " of " << count_of(stamps.size(), "scan") << " matched by time";
  if (between > 0) text << ", " << between << " interpolated between poses at most " << largest << " s apart";
  return text.str();
}

/// Assigns the poses of one file: by time if both sides have it, else by order.
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
  if (poses.stamped && stamps.size() == scans) {
    drop_bad(poses);
    trajectory = std::make_shared<const Trajectory>(in_unit_of(
        stamps, Trajectory(poses, options.max_pose_gap_s.value_or(largest_pose_gap_s)), poses.notes));
    poses.notes.push_back(describe_match(stamps, *trajectory));
  } else if (scans != poses.poses.size()) {
    differ(poses.file, scans, poses.poses.size(), "pose",
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

/// Files called like the scans, with one pose each (ScanNet's pose/12.txt for depth/12.png). False if there
/// is none for the first.
bool take_poses_in(const fs::path& folder, ListedRecording& recording, std::vector<std::string>& notes) {
  const auto pose_file = [&](const ListedScan& scan) {
    return folder / (scan.file.stem().string() + ".txt");
  };
  if (!fs::is_regular_file(pose_file(recording.scans.front()))) return false;
  for (auto& scan : recording.scans) scan.pose_file = pose_file(scan);
  notes.push_back("poses: " + folder.string() + ": a file for each scan, called like it");
  return true;
}

/// Poses beside the scans, if the scans need any.
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

/// Scans without a pose at their time are left out, as in TUM's own tools, but reported.
void leave_out_unposed(ScanList& list) {
  for (auto& recording : list.recordings) {
    if (!recording.trajectory) continue;
    const auto unposed = [&](const ListedScan& scan) { return !recording.trajectory->covers(*scan.stamp_s); };
    for (const auto& scan : recording.scans)
      if (unposed(scan))
        list.left_out.push_back(scan.file.string() + ": no pose at its time (" +
                                recording.trajectory->gap_at(*scan.stamp_s) + "); left out");
    const std::string first_gap = recording.trajectory->gap_at(*recording.scans.front().stamp_s);
    std::erase_if(recording.scans, unposed);
    if (recording.scans.empty())
      throw Error(
          Error::Kind::data, recording.folder.string(),
          "no scan has a pose at its time; of the first: " + first_gap,
          "the time stamps of scans and poses must be of one clock; --max-pose-gap allows larger steps");
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
  positive(options.cloud_scale, "cloud_scale");
  positive(options.rate_hz, "rate_hz");
  if (options.fields && (*options.fields < 3 || *options.fields > largest_step / sizeof(float)))
    throw Error(Error::Kind::usage, "fields", std::to_string(*options.fields) + " floats hold no point");
  for (const double value : options.no_return)
    if (!(std::isfinite(value) && value >= 0))
      throw Error(Error::Kind::usage, "no_return", std::to_string(value) + " is not a range in metres");
  if (const auto gap = options.max_pose_gap_s; gap && !(*gap >= 0))
    throw Error(Error::Kind::usage, "max_pose_gap", std::to_string(*gap) + " is not a number of seconds");
}

}  // namespace

std::optional<double> stamp_in_name(const fs::path& file) {
  constexpr const char* digit = "0123456789";
  const std::string stem = file.stem().string();
  // The number at the end, after a word, or after another number and '_'.
  const std::size_t before = stem.find_last_not_of("0123456789.");
  std::string_view text = std::string_view(stem).substr(before == std::string::npos ? 0 : before + 1);
  const auto number_of = [](std::string_view word) -> std::optional<double> {
    double value = 0;
    const auto [stop, error] =
        std::from_chars(word.data(), word.data() + word.size(), value, std::chars_format::fixed);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(value)) return {};
    return value;
  };
  const auto value = number_of(text);
  if (!value) return {};
  // "000002_-7.5": before 1970, as of a simulated clock.
  const bool negative =
      before != std::string::npos && before > 0 && stem[before] == '-' && stem[before - 1] == '_';
  const std::size_t between = negative ? before - 1 : before;
  const bool only_numbers = before == std::string::npos ||
                            (stem[between] == '_' && between > 0 && stem.find_first_not_of(digit) == between);
  if (text.find('.') != std::string_view::npos) {
    constexpr double year_1973 = 1e8;  // after a word, smaller numbers are of other things
    if (only_numbers && negative) return -*value;
    if (only_numbers || *value >= year_1973) return value;
    return {};
  }
  // Whole seconds since 1970 and nanoseconds, as ROS has them.
  constexpr std::size_t seconds_digits = 10, ns_digits = 9;
  if (before != std::string::npos && text.size() <= ns_digits) {
    const std::string_view head = std::string_view(stem).substr(0, before);
    const std::size_t word = head.find_last_not_of(digit);
    const std::string_view seconds = head.substr(word == std::string_view::npos ? 0 : word + 1);
    if (seconds.size() == seconds_digits && seconds[0] != '0') return *number_of(seconds) + 1e-9 * *value;
  }
  // One number without a point is a time if it has as many digits as one since 1970 in s, ms, us or ns.
  if (text[0] == '0') return {};
  switch (text.size()) {
    case seconds_digits:
      return *value;
    case seconds_digits + 3:
      return *value / 1e3;
    case seconds_digits + 6:
      return *value / 1e6;
    case seconds_digits + 9:
      return *value / 1e9;
    default:
      return {};
  }
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
    find_floats(recording, options, list.notes);
    find_stamps(recording);
    if (!options.poses) find_poses(recording, options, list.notes);
  }
  if (options.poses) {
    std::vector<ListedRecording*> all;
    for (auto& recording : list.recordings) {
      if (recording.graph)
        throw Error(Error::Kind::usage, recording.scans.front().file.string(),
                    "a .graph has poses of its own", "leave --poses away");
      if (fs::is_directory(*options.poses) && !take_poses_in(*options.poses, recording, list.notes))
        throw Error(Error::Kind::data, options.poses->string(),
                    "has no " + recording.scans.front().file.stem().string() + ".txt",
                    "give a file of poses, or a folder of files called like the scans");
      all.push_back(&recording);
    }
    if (fs::is_directory(*options.poses)) return list;
    pose_all(all, read_poses(*options.poses), options, list.notes);
  }
  leave_out_unposed(list);
  return list;
}

}  // namespace octosurf::io
