#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::evaluation {

/// A stretch of visible cells in one row of a face's grid: cells (column … column+count−1, row).
struct CellRun {
  int row = 0;
  int column = 0;
  int count = 0;
};

/// One planar face of a simulated scene, as it stands at the end of the recording.
struct TrueFace {
  std::uint32_t id = 0;  ///< ≥ 1; the label of the points that hit it
  std::string name;      ///< e.g. "table/top"
  Plane plane;           ///< normal toward the open side
  Eigen::Isometry3d T_map_face = Eigen::Isometry3d::Identity();  ///< z = plane.normal
  std::vector<Polygon> polygons;  ///< in the face's (u, v), only what is not covered by other solids
  /// What the sensor saw: cell (column, row) spans [column, column+1)·cell × [row, row+1)·cell in
  /// (u, v) and is listed if its centre lies in `polygons` and at least `Truth::visible_hits` rays
  /// ended in it, or it lies between neighbouring pixels less than 5 cells apart on the face.
  std::vector<CellRun> visible;
  double visible_area_m2 = 0;
  bool gone = false;  ///< its object was removed or moved away before the recording ended
  /// Ids of the others that join_faces() has put into it; not in the file.
  std::vector<std::uint32_t> joined;
  double largest_part_m2 = 0;  ///< of a joined face: seen of the one it began with
};

/// One stair of a simulated scene, as it was built; a mesh's are not known.
struct TrueStair {
  std::string kind;    ///< flight, landing, spiral, open
  double riser_m = 0;  ///< of every step
  double tread_m = 0;  ///< between the middles of the edges; landings are none
  /// Front edges from below, left and right end of each.
  std::vector<std::array<Eigen::Vector3d, 2>> edges;
};

/// What is true of a simulated recording; written beside the scans as `truth.json`.
struct Truth {
  std::string scene;
  std::string sensor;
  std::uint64_t seed = 0;
  double cell = 0.01;  ///< m, edge of the visibility cells
  int visible_hits = 1;
  std::vector<TrueFace> faces;  ///< faces of curved things are not listed; their points have label 0
  std::vector<TrueStair> stairs;
};

void save_truth(const Truth& truth, const std::filesystem::path& file);
/// Throws Error(data) for anything but a truth file.
Truth load_truth(const std::filesystem::path& file);

}  // namespace octosurf::evaluation
