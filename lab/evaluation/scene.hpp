#pragma once

#include "evaluation/evaluate.hpp"
#include "evaluation/planar_region.hpp"
#include "evaluation/truth.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <vector>

namespace octosurf::evaluation {

inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// A surface or a true face, ready for queries.
struct Patch {
  Plane plane;
  Eigen::Isometry3d T_map_patch;
  PlanarRegion region;
  Eigen::AlignedBox3d box;  ///< of its rings, map frame
};

/// Which cells of a face's grid were seen.
class VisibleCells {
 public:
  /// Throws Error(data) naming `where` if runs overlap or are empty.
  VisibleCells(std::vector<CellRun> runs, double cell, const std::string& where);

  std::size_t count() const { return count_; }
  /// Some visible cell meets the square of half width `reach` (m) around uv.
  bool near(const Eigen::Vector2d& uv, double reach) const;

  template <class Visit>
  void for_each_centre(Visit&& visit) const {
    for (const CellRun& run : runs_) {
      for (int i = 0; i < run.count; ++i) {
        visit(Eigen::Vector2d((run.column + 0.5 + i) * cell_, (run.row + 0.5) * cell_));
      }
    }
  }

 private:
  std::vector<CellRun> runs_;  // by row, then column
  double cell_;
  std::size_t count_ = 0;
};

/// A face and a surface whose boxes meet and whose normals differ by at most the support angle.
struct Pair {
  std::size_t face = 0, surface = 0;
  bool aligned = false;     ///< within the narrower angle: may cover and lie on
  std::size_t covered = 0;  ///< visible cells of the face that the surface covers
  std::size_t lying = 0;    ///< samples of the surface that lie on the face
};

/// What evaluate() works on; faces and surfaces by index in truth and snapshot.
struct Scene {
  const Snapshot* snapshot = nullptr;
  const Truth* truth = nullptr;
  EvaluationOptions options;
  double tolerance = 0;
  std::vector<Patch> faces, surfaces;
  std::vector<VisibleCells> visible;
  std::vector<Pair> pairs;
  std::vector<std::vector<std::size_t>> pairs_of_face, pairs_of_surface;  ///< ascending

  double reach() const;  ///< m: how near a visible cell makes a ring point visible
  double visible_m2(std::size_t face) const;
};

/// Checks everything (see evaluate()) and finds the pairs. Cost O(faces · surfaces) box tests.
Scene prepare(const Snapshot& snapshot, const Truth& truth, const EvaluationOptions& options);

/// Point of the patch's plane seen from another patch's frame: x, y in its plane, z off it.
inline Eigen::Vector3d transfer(const Eigen::Isometry3d& T, const Eigen::Vector2d& uv) {
  return T.linear().leftCols<2>() * uv + T.translation();
}

/// Distances between what was seen of a face's rings and the rings of the surfaces on it (definition 8),
/// appended.
void append_boundary_distances(const Scene& scene, std::size_t face, const std::vector<std::size_t>& surfaces,
                               std::vector<double>& distances);

/// The holes of a face that are asked for (definition 9), given the surface that covers it.
std::vector<HoleScore> score_holes(const Scene& scene, std::size_t face, std::size_t surface);

}  // namespace octosurf::evaluation
