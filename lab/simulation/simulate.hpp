#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace octosurf::simulation {

/// What to record. Equal options give equal bytes.
struct SimulationOptions {
  std::string scene = "room";    ///< one of scene_names(); unused with `mesh`
  std::filesystem::path mesh;    ///< STL, OBJ, PLY or DAE: the scene is this terrain, in its own size
  std::string mesh_up;           ///< its axis that is up: x, y, z, -x, -y, -z; empty: z, or what a DAE says
  double mesh_scale = 1;         ///< m per unit of the file
  std::string sensor = "depth";  ///< depth, depth-real, tilting, spinning
  std::uint64_t seed = 1;        ///< dimensions, noise, and how the world is turned, shifted, scaled
  std::optional<std::size_t> frames;  ///< empty: as many as show the scene well
  double noise_scale = 1;             ///< factor on the sensor's noise; 0: none
  double length = 20;                 ///< m, of the corridor (4 to 1000)
  int laps = 1;                       ///< times the path is walked
  double drift_m = 0;                 ///< m per lap by which the recorded poses slide away
  double drift_rad = 0;               ///< rad per lap by which they turn about the vertical
  bool force = false;                 ///< replace a recording in the folder

  /// Throws Error(usage) naming option, value and rule.
  void validate() const;
};

/// What was found in the file of a mesh.
struct MeshSummary {
  std::size_t triangles = 0;
  std::size_t dropped = 0;     ///< of no width
  std::size_t open_edges = 0;  ///< of one triangle only: solids may be open there
};

/// What simulate() wrote.
struct SimulationSummary {
  std::size_t scans = 0;
  std::size_t points = 0;         ///< readings, over all scans
  std::size_t faces = 0;          ///< planar faces of the scene
  std::size_t visible_faces = 0;  ///< of them, with at least 0.05 m² seen
  std::size_t gone_faces = 0;     ///< of the visible, gone before the end
  double duration_s = 0;          ///< last scan's time stamp
  std::optional<MeshSummary> mesh;
};

/// Records a scene into the folder `dir`:
/// - depth, depth-real: a 7-Scenes folder (frame-NNNNNN.depth.png in mm with 0 for no reading,
///   frame-NNNNNN.pose.txt, camera-intrinsics.txt), besides frame-NNNNNN.label.png (16-bit face ids,
///   0 for none) and timestamps.txt (name and seconds a line);
/// - tilting, spinning: scan-NNNNNN.pcd (binary; x y z label, sensor's frame; VIEWPOINT is the pose)
///   and poses.txt (stamp tx ty tz qx qy qz qw);
/// - truth.json (evaluation/truth.hpp), in the map frame of the undrifted poses.
/// Calls `progress` after each scan. Throws Error(data) for a mesh that cannot be used (mesh.hpp),
/// Error(usage) for nonsense options or if the folder is
/// not empty and `force` is off, Error(output) if something cannot be written.
SimulationSummary simulate(const SimulationOptions& options, const std::filesystem::path& dir,
                           const std::function<void(std::size_t done, std::size_t total)>& progress = {});

}  // namespace octosurf::simulation
