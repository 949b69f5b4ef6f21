#pragma once

#include "evaluation/truth.hpp"
#include "simulation/simulate.hpp"

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

/// What the benchmark programs share.
namespace octosurf::bench {

/// Columns as wide as their widest cell; the first is left-aligned, the others right-aligned.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  void rule() { rows_.emplace_back(); }  ///< a line between groups of rows
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;  ///< an empty one is a rule
};

std::string fixed(double value, int digits);

/// The smallest value that at least `share` of the values do not exceed; 0 if there are none.
double percentile(std::vector<double> values, double share);
double sum(const std::vector<double>& values);

/// Wall-clock milliseconds of one call.
double time_ms(const std::function<void()>& work);

/// The kitchen of ../shared/data, or what stands in its place; throws Error(data) if it is missing.
std::filesystem::path kitchen();

/// All meshes of ../shared/data/terrain_meshes, or a line that says that there are none.
std::vector<std::string> terrain_meshes();

/// NAME=VALUE each; throws Error(usage) if one is not.
void set_parameters(Parameters& parameters, const std::vector<std::string>& assignments);
/// The paper's (its section V), at this resolution and r.
Parameters paper_parameters(double resolution, double search_radius);

/// Every `every`-th scan of a recording, at most `limit` (0: all); `visit` also gets the ms it took
/// to read it.
void for_each_scan(const std::filesystem::path& recording, std::size_t every, std::size_t limit,
                   const std::function<void(const Scan&, double read_ms)>& visit);

/// A scene's name, or the file of a mesh: what has an ending.
void set_scene(const std::string& scene, simulation::SimulationOptions& options);

struct Recorded {
  std::vector<Scan> scans;
  evaluation::Truth truth;
};
/// A simulated recording, all in memory.
Recorded record(const simulation::SimulationOptions& options);

struct FittedPlane {
  Plane plane;  ///< its normal has either sign
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
};
/// Least-squares plane of points[i], i in `indices`, of which there must be three or more.
FittedPlane least_squares_plane(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<std::size_t>& indices);

/// Runs a program's body; what goes wrong is one line on stderr and exit code 1 (2 for wrong use).
int guarded_main(const std::function<void()>& body);

void write_json_file(const std::filesystem::path& file, const std::string& json);

}  // namespace octosurf::bench
