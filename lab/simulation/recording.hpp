#pragma once

#include "evaluation/truth.hpp"
#include "simulation/simulate.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::simulation {

/// One value per ray of the sensor.
struct Readings {
  std::vector<float> t;               ///< the point is t · ray; 0: no reading
  std::vector<std::uint16_t> labels;  ///< TrueFace::id, 0 for none and for curved things
  std::vector<float> incidence_rad;   ///< of the ray to the normal; of `depth-real` only, else empty
};

/// A scan and the true face of each of its points.
struct LabelledScan {
  Scan scan;
  std::vector<std::uint16_t> labels;  ///< scan.points.size()
};

/// A simulated recording in memory: the same scans that simulate() writes, one at a time.
///
/// 1. Deterministic in the options; scan i does not depend on which others were asked for.
/// 2. Scans hold what a reader of the written files sees: depth is rounded to millimetres.
/// Const functions may be called from several threads.
class Recording {
 public:
  /// Builds the scene; throws Error(usage) if options.validate() does, Error(data) for an unusable mesh.
  explicit Recording(const SimulationOptions& options);

  std::size_t size() const;                 ///< scans
  std::optional<MeshSummary> mesh() const;  ///< empty for scenes that are no mesh

  /// One ray per reading, sensor's frame. Depth camera: row by row, 640 × 480, z = 1 (so t is the
  /// depth); lidars: of length 1.
  const std::vector<Eigen::Vector3f>& rays() const;

  double stamp_s(std::size_t i) const;
  Eigen::Isometry3d true_pose(std::size_t i) const;     ///< T_map_sensor as it was
  Eigen::Isometry3d T_map_sensor(std::size_t i) const;  ///< as recorded: with drift

  /// Free of noise, unrounded. What `depth-real` drops is left out: it was not seen.
  Readings ideal(std::size_t i) const;
  Readings measured(std::size_t i, const Readings& ideal) const;  ///< with noise, as written

  /// Scan i with the recorded pose; rays without a reading are left out.
  LabelledScan labelled_scan(std::size_t i) const { return labelled_scan(i, ideal(i)); }
  LabelledScan labelled_scan(std::size_t i, const Readings& ideal) const;
  Scan scan(std::size_t i) const { return labelled_scan(i).scan; }

  /// Faces without visibility; ids are 1 … n in order.
  const std::vector<evaluation::TrueFace>& faces() const&;
  void faces() const&& = delete;  // would dangle in `for (… : Recording(options).faces())`
  /// Casts every scan to find what was visible.
  evaluation::Truth truth() const;
  /// Gathers what truth() needs; for callers that cast the scans themselves.
  class Visibility;
  Visibility visibility() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// Gathers the cells of each face in which rays ended.
class Recording::Visibility {
 public:
  explicit Visibility(const Recording& recording);

  /// Scan i's noise-free readings. Between neighbouring pixels on one face, if they are less than
  /// 5 cm apart, the face counts as seen, too: at 4 m pixels stand further apart than cells.
  void add(std::size_t i, const Readings& ideal);
  evaluation::Truth truth() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace octosurf::simulation
