#include "io/readers/scan_list.hpp"

#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr Intrinsics tum_camera{525, 525, 319.5, 239.5};  // its "default" calibration, used for depth

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

/// By the recording's first file.
void find_floats(ListedRecording& recording, std::vector<std::string>& notes) {
  if (recording.scans.front().kind != FileKind::velodyne) return;
  const fs::path& first = recording.scans.front().file;
  recording.floats = floats_of_velodyne(first);
  if (recording.floats != ListedRecording{}.floats)
    notes.push_back(first.string() + ": " + std::to_string(recording.floats) +
                    " floats a point, by its values: x y z first");
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
  recordings.back().scans.push_back({input, kind});
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

std::vector<fs::path> files_of(const ListedRecording& recording) {
  std::vector<fs::path> files;
  for (const auto& scan : recording.scans) files.push_back(scan.file);
  return files;
}

/// One recording per bag, or per bags of one folder, with its scans; but where one has no scans, as of
/// another recorder of the same drive, all are one.
void open_bags(const ScanSourceOptions& options, ScanList& list) {
  const auto is_bag = [](const ListedRecording& one) { return one.scans.front().kind == FileKind::bag; };
  std::vector<ListedRecording>& all = list.recordings;
  const std::size_t lines = list.left_out.size();
  for (ListedRecording& one : all)
    if (is_bag(one)) one.bag = std::make_shared<BagRecording>(files_of(one), options, list.left_out);
  const auto lacks_scans = [](const ListedRecording& one) { return one.bag && !one.bag->has_scans(); };
  const auto first = std::ranges::find_if(all, is_bag);
  if (std::ranges::any_of(all, lacks_scans) && std::ranges::count_if(all, is_bag) > 1) {
    for (ListedRecording& one : all)
      if (one.bag && &one != &*first) {
        first->scans.insert(first->scans.end(), one.scans.begin(), one.scans.end());
        one.scans.clear();
      }
    std::erase_if(all, [](const ListedRecording& one) { return one.scans.empty(); });
    list.left_out.resize(lines);
    first->bag = std::make_shared<BagRecording>(files_of(*first), options, list.left_out);
  }
  for (ListedRecording& recording : all) {
    if (!recording.bag) continue;
    recording.bag->choose(options, list.left_out);
    const std::string name = recording.scans.front().file.string();
    recording.scans.assign(recording.bag->size(), recording.scans.front());
    for (std::size_t i = 0; i < recording.scans.size(); ++i) {
      recording.scans[i].index = i;
      recording.scans[i].stamp_s = recording.bag->stamp_s(i);
      recording.scans[i].sensor = recording.bag->sensor(i);
    }
    recording.sensors = recording.bag->sensors();
    for (const std::string& note : recording.bag->notes()) list.notes.push_back(name + ": " + note);
  }
}

/// The files of a folder are of one.
void name_sensor(ListedRecording& recording) {
  if (recording.bag) return;
  const FileKind kind = recording.scans.front().kind;
  recording.sensors = {
      {recording.folder.string(), kind == FileKind::image, kind == FileKind::pcd || kind == FileKind::ply}};
}

void check_options(const ScanSourceOptions& options) {
  const auto positive = [](const std::optional<double>& value, const char* name) {
    if (value && !(std::isfinite(*value) && *value > 0))
      throw Error(Error::Kind::usage, name, std::to_string(*value) + " is not a positive number");
  };
  positive(options.depth_scale, "depth_scale");
  positive(options.cloud_scale, "cloud_scale");
  positive(options.rate_hz, "rate_hz");
  for (const double value : options.no_return)
    if (!(std::isfinite(value) && value >= 0))
      throw Error(Error::Kind::usage, "no_return", std::to_string(value) + " is not a range in metres");
  if (const double range = options.clear_no_return_m; !(std::isfinite(range) && range >= 0))
    throw Error(Error::Kind::usage, "clear_no_return_m", std::to_string(range) + " is not a range in metres");
  for (const SelfBox& self : options.self_boxes)
    if (!self.box.min().allFinite() || !self.box.max().allFinite() || self.box.isEmpty())
      throw Error(Error::Kind::usage, "self_boxes", "a box is empty or not finite",
                  "give two corners in metres");
  if (const auto gap = options.max_pose_gap_s; gap && !(*gap >= 0))
    throw Error(Error::Kind::usage, "max_pose_gap", std::to_string(*gap) + " is not a number of seconds");
}

}  // namespace

ScanList list_scans(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  check_options(options);
  if (inputs.empty())
    throw Error(Error::Kind::usage, "", "no input given", "name a folder or files of scans");
  ScanList list;
  bool last_is_files = false;
  for (const auto& input : inputs) {
    if (is_occupancy_map(input))
      throw Error(Error::Kind::usage, input.string(), "an occupancy map, not scans", "give it alone");
    if (!fs::is_directory(input)) {
      add_file(input, list.recordings, last_is_files);
    } else {
      list.recordings.push_back(list_folder(input));
      last_is_files = false;
    }
  }
  open_bags(options, list);
  for (auto& recording : list.recordings) {
    open_graph(recording);
    name_sensor(recording);
    find_camera(recording, options);
    find_floats(recording, list.notes);
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
