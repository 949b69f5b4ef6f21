#include "simulation/simulate.hpp"

#include "simulation/files.hpp"
#include "simulation/mesh.hpp"
#include "simulation/recording.hpp"
#include "simulation/scene.hpp"
#include "simulation/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::simulation {

namespace {

constexpr std::size_t max_frames = 1'000'000;
constexpr double worth_finding_m2 = 0.05;  // of a face, as the scores count them

void require_range(const std::string& option, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  std::ostringstream what;
  what << value << " lies outside [" << low << ", " << high << "]";
  throw Error(Error::Kind::usage, option, what.str(), "choose a value in it");
}

std::string numbered(const char* prefix, std::size_t i) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%s-%06zu", prefix, i);
  return name.data();
}

std::string seconds(double stamp_s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6f", stamp_s);
  return text.data();
}

/// Writes scans as they come; returns how many points each holds.
class Writer {
 public:
  Writer(const Recording& recording, std::filesystem::path dir, bool depth)
      : recording_(recording), dir_(std::move(dir)), depth_(depth) {}

  std::size_t write(std::size_t i, const Readings& ideal) {
    return depth_ ? write_depth(i, recording_.measured(i, ideal)) : write_cloud(i, ideal);
  }

  void finish() const {
    write_text(dir_ / (depth_ ? "timestamps.txt" : "poses.txt"), stamps_);
    if (!depth_) return;
    std::ostringstream K;
    K << depth_focal << "\t0\t" << depth_center_x << "\n0\t" << depth_focal << "\t" << depth_center_y
      << "\n0\t0\t1\n";
    write_text(dir_ / "camera-intrinsics.txt", K.str());
  }

 private:
  std::size_t write_depth(std::size_t i, const Readings& readings) {
    const std::string name = numbered("frame", i);
    std::vector<std::uint16_t> millimetres(readings.t.size());
    std::transform(readings.t.begin(), readings.t.end(), millimetres.begin(),
                   [](float t) { return static_cast<std::uint16_t>(std::lround(t * 1000)); });
    write_png(dir_ / (name + ".depth.png"), millimetres, depth_width);
    write_png(dir_ / (name + ".label.png"), readings.labels, depth_width);
    write_text(dir_ / (name + ".pose.txt"), matrix_pose(recording_.T_map_sensor(i)));
    stamps_ += name + " " + seconds(recording_.stamp_s(i)) + "\n";
    return readings.t.size() - std::count(millimetres.begin(), millimetres.end(), 0);
  }

  std::size_t write_cloud(std::size_t i, const Readings& ideal) {
    const LabelledScan scan = recording_.labelled_scan(i, ideal);
    write_pcd(dir_ / (numbered("scan", i) + ".pcd"), scan);
    stamps_ += seconds(scan.scan.stamp_s) + " " + tum_pose(scan.scan.T_map_sensor) + "\n";
    return scan.scan.points.size();
  }

  const Recording& recording_;
  std::filesystem::path dir_;
  bool depth_;
  std::string stamps_;
};

SimulationSummary summarize(const Recording& recording, const evaluation::Truth& truth, std::size_t points) {
  SimulationSummary summary;
  summary.scans = recording.size();
  summary.points = points;
  summary.faces = truth.faces.size();
  for (const auto& face : truth.faces)
    if (face.visible_area_m2 >= worth_finding_m2) {
      ++summary.visible_faces;
      if (face.gone) ++summary.gone_faces;
    }
  summary.mesh = recording.mesh();
  summary.duration_s = recording.stamp_s(recording.size() - 1);
  return summary;
}

}  // namespace

void SimulationOptions::validate() const {
  if (mesh.empty()) require_known("scene", scene, scene_names());
  MeshOptions{mesh_up, mesh_scale}.validate();
  require_known("sensor", sensor, sensor_names());
  if (frames) require_range("frames", static_cast<double>(*frames), 1, max_frames);
  require_range("noise-scale", noise_scale, 0, 100);
  require_range("length", length, 4, 1000);
  require_range("laps", laps, 1, 50);
  require_range("drift-m", drift_m, 0, 10);
  require_range("drift-deg", drift_rad * 180 / std::numbers::pi, 0, 90);
}

SimulationSummary simulate(const SimulationOptions& options, const std::filesystem::path& dir,
                           const std::function<void(std::size_t, std::size_t)>& progress) {
  const Recording recording(options);
  prepare_folder(dir, options.force);
  Recording::Visibility visible = recording.visibility();
  Writer writer(recording, dir, make_sensor(options.sensor).image_width > 0);
  std::size_t points = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Readings ideal = recording.ideal(i);
    visible.add(i, ideal);
    points += writer.write(i, ideal);
    if (progress) progress(i + 1, recording.size());
  }
  writer.finish();
  const evaluation::Truth truth = visible.truth();
  evaluation::save_truth(truth, dir / "truth.json");
  return summarize(recording, truth, points);
}

}  // namespace octosurf::simulation
