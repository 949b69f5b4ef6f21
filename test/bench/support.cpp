#include "bench/support.hpp"

#include "simulation/recording.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <numeric>
#include <sstream>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::bench {
namespace {

/// Characters, not bytes: headers hold signs such as ° and ².
std::size_t shown_width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_)
    for (std::size_t column = 0; column < row.size(); ++column) {
      if (column == widths.size()) widths.push_back(0);
      widths[column] = std::max(widths[column], shown_width(row[column]));
    }
  const std::size_t total = std::accumulate(widths.begin(), widths.end(), 2 * (widths.size() - 1));
  std::ostringstream out;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t column = 0; column < rows_[r].size(); ++column) {
      const std::string padding(widths[column] - shown_width(rows_[r][column]), ' ');
      out << (column == 0 ? "" : "  ")
          << (column == 0 ? rows_[r][column] + padding : padding + rows_[r][column]);
    }
    if (r == 0 || rows_[r].empty()) out << (r == 0 ? "\n" : "") << std::string(total, '-');
    out << '\n';
  }
  return out.str();
}

std::string fixed(double value, int digits) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << value;
  return out.str();
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

double time_ms(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

std::filesystem::path kitchen() {
  const std::filesystem::path folder = std::filesystem::path(OCTOSURF_DATA_DIR) / "rgbd_7scenes_redkitchen";
  if (!std::filesystem::is_directory(folder))
    throw Error(Error::Kind::data, folder.string(), "is missing", "name another recording with --input");
  return folder;
}

std::vector<std::string> terrain_meshes() {
  const std::filesystem::path folder = std::filesystem::path(OCTOSURF_DATA_DIR) / "terrain_meshes";
  std::vector<std::string> meshes;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == ".stl") meshes.push_back(entry.path().string());
  std::sort(meshes.begin(), meshes.end());
  if (meshes.empty()) std::printf("terrain meshes: skipped, %s has none\n", folder.string().c_str());
  return meshes;
}

void set_parameters(Parameters& parameters, const std::vector<std::string>& assignments) {
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos)
      throw Error(Error::Kind::usage, "--set " + assignment, "has no value", "write --set NAME=VALUE");
    set_parameter(parameters, assignment.substr(0, equals), assignment.substr(equals + 1));
  }
}

Parameters paper_parameters(double resolution, double search_radius) {
  Parameters parameters = Parameters::paper();
  parameters.occupancy.resolution = resolution;
  parameters.surfaces.surface_tolerance = parameters.surfaces.sensor_noise + resolution * std::sqrt(3.0);
  parameters.detection.search_radius = parameters.detection.normal_radius = search_radius;
  return parameters;
}

void for_each_scan(const std::filesystem::path& recording, std::size_t every, std::size_t limit,
                   const std::function<void(const Scan&, double read_ms)>& visit) {
  const auto source = open_scans({recording});
  std::size_t visited = 0;
  for (std::size_t index = 0; limit == 0 || visited < limit; ++index) {
    std::optional<Scan> scan;
    const double read_ms = time_ms([&] { scan = source->next(); });
    if (!scan) return;
    if (index % every != 0) continue;
    visit(*scan, read_ms);
    ++visited;
  }
}

void set_scene(const std::string& scene, simulation::SimulationOptions& options) {
  if (std::filesystem::path(scene).has_extension())
    options.mesh = scene;
  else
    options.scene = scene;
}

Recorded record(const simulation::SimulationOptions& options) {
  const simulation::Recording recording(options);
  Recorded recorded;
  simulation::Recording::Visibility visibility = recording.visibility();
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const simulation::Readings ideal = recording.ideal(i);
    visibility.add(i, ideal);
    recorded.scans.push_back(recording.labelled_scan(i, ideal).scan);
  }
  recorded.truth = visibility.truth();
  return recorded;
}

FittedPlane least_squares_plane(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<std::size_t>& indices) {
  FittedPlane fitted;
  for (const std::size_t i : indices)
    fitted.centroid += points[i].cast<double>() / static_cast<double>(indices.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : indices) {
    const Eigen::Vector3d v = points[i].cast<double>() - fitted.centroid;
    scatter += v * v.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  fitted.plane.normal = solver.eigenvectors().col(0).normalized();
  fitted.plane.offset = fitted.plane.normal.dot(fitted.centroid);
  return fitted;
}

int guarded_main(const std::function<void()>& body) {
  try {
    body();
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return error.kind() == Error::Kind::usage ? 2 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

void write_json_file(const std::filesystem::path& file, const std::string& json) {
  std::ofstream out(file);
  out << json << '\n';
  out.flush();
  if (!out) throw Error(Error::Kind::output, file.string(), "cannot be written", "choose another place");
}

}  // namespace octosurf::bench
