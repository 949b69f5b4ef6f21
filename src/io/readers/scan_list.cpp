#include "io/readers/scan_list.hpp"

#include "io/readers/cloud_file.hpp"
#include "io/text_file.hpp"
#include "sensing/pose_form.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr Intrinsics tum_camera{525, 525, 319.5, 239.5};  // its "default" calibration, used for depth

void find_camera(ListedRecording& recording, const ScanSourceOptions& options) {
  if (recording.scans.front().kind != FileKind::image) return;
  recording.depth_scale = options.depth_scale.value_or(is_tum(recording.folder) ? 5000 : 1000);
  fs::path whole = fs::absolute(recording.folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  const fs::path file = options.intrinsics
                            ? *options.intrinsics
                            : find_beside({whole, whole.parent_path()},
                                          {"camera-intrinsics.txt", "intrinsics.txt"}, "--intrinsics");
  if (!file.empty())
    recording.camera = read_intrinsics(file);
  else if (is_tum(recording.folder))
    recording.camera = tum_camera;
  else
    throw Error(Error::Kind::data, recording.folder.string(), "depth images without camera intrinsics",
                "give --intrinsics FILE (3x3 K, or fx fy cx cy)");
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
    recording.bag->choose(options);
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
void name_sensors(ListedRecording& recording, const ScanSourceOptions& options) {
  if (!recording.bag) {
    const FileKind kind = recording.scans.front().kind;
    const bool images = kind == FileKind::image;
    recording.sensors = {{recording.folder.string(), images, kind == FileKind::pcd || kind == FileKind::ply,
                          images ? SensorKind::depth_camera : SensorKind::lidar}};
    for (ListedScan& scan : recording.scans) {
      if (scan.kind != FileKind::pcd || !is_column(scan.file)) continue;
      recording.sensors.resize(2, {recording.folder.string(), false, true, SensorKind::depth_camera});
      scan.sensor = 1;
    }
  }
  for (RecordedSensor& sensor : recording.sensors)
    if (!sensor.images) sensor.kind = options.sensor.value_or(sensor.kind);
  for (const ListedScan& scan : recording.scans)
    if (const auto& sensor = recording.sensors[scan.sensor];
        sensor.images && options.sensor == SensorKind::lidar)
      throw Error(Error::Kind::usage, "--sensor lidar",
                  sensor.name + " has depth images, which are a camera's",
                  "--max-range lifts their limit of 4 m");
    else if (sensor.images && options.pose_form == PoseForm::in_map)
      throw Error(Error::Kind::usage, "--pose-form in-map", sensor.name + " has depth images",
                  "it is for clouds in the map's frame");
}

void check_options(const ScanSourceOptions& options) {
  if (const auto& scale = options.depth_scale; scale && !(std::isfinite(*scale) && *scale > 0))
    throw Error(Error::Kind::usage, "depth_scale", std::to_string(*scale) + " is not a positive number");
  for (const double value : options.no_return)
    if (!(std::isfinite(value) && value >= 0))
      throw Error(Error::Kind::usage, "no_return", std::to_string(value) + " is not a range in metres");
  for (const SelfBox& self : options.self_boxes)
    if (!self.box.min().allFinite() || !self.box.max().allFinite() || self.box.isEmpty())
      throw Error(Error::Kind::usage, "self_boxes", "a box is empty or not finite",
                  "give two corners in metres");
  if (options.viewpoint && !options.viewpoint->allFinite())
    throw Error(Error::Kind::usage, "viewpoint", "is not finite", "give X Y Z in metres");
}

}  // namespace

Eigen::Isometry3d ListedRecording::sensor_at(const Eigen::Isometry3d& pose) const {
  return sensing::pose_from(pose_form, pose) * T_posed_sensor;
}

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
    recording.pose_form = options.pose_form.value_or(PoseForm::as_given);
    if (recording.bag && recording.bag->moves_clouds() && recording.pose_form == PoseForm::in_map)
      recording.pose_form = PoseForm::as_given;  // done by the bag
    open_graph(recording);
    name_sensors(recording, options);
    find_camera(recording, options);
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
