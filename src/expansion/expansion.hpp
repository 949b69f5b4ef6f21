#pragma once

#include "surfaces/ledger.hpp"

#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace octosurf::expansion {

/// Surface expansion (paper III-B): points that belong to surfaces that are known already.
///
/// A point fits a surface if it lies within the tolerance of its distance off the plane, was seen
/// from the surface's front, and its own normal is within the smoothness angle of the surface's; where that
/// normal is not certain (edges, clutter) the tolerance is halved instead. Nothing may stand on the
/// plane between the point and the surface: a shelf's board divides the wall behind it. Of several surfaces
/// that a point fits, the one with the smallest distance in units of tolerance gets it, the larger
/// on a tie.
class Expansion {
 public:
  using Index = occupancy::PointWindow::Index;

  explicit Expansion(surfaces::Ledger& ledger);

  /// III-B1: points that lie inside a surface's polygon. Returns those that are left.
  std::vector<Index> add_inliers(std::span<const Index> points);

  /// III-B2: points within h of a surface along its plane, then outward from each of them through
  /// the octree until nothing fits any more; inliers of neighbours that fit much better here are
  /// reassigned. Surfaces that met on one plane are merged, the larger keeping its id.
  void expand(std::span<const Index> points);

  /// The same outward growth, from all inliers of `surfaces` (new ones).
  void grow(std::span<const SurfaceId> surfaces);

  /// grow(), from surfaces that another map had found. Where they meet those that are here, now or later,
  /// these keep their ids, however small.
  void adopt(std::span<const SurfaceId> surfaces);

  /// Merges surfaces that make one plane with a neighbour that this scan touched: their planes may be certain
  /// enough by now, although they were not when the two met. Looks only at the rims of surfaces that have
  /// changed by a quarter.
  void rejoin();

 private:
  /// |distance| / tolerance, if the point fits.
  std::optional<double> misfit(Index i, const surfaces::SurfaceModel& surface);
  enum class Reach { inside, within_h, adjacent };
  /// The surface has an inlier within so many cells, and the way there is not obstructed (obstructed.hpp).
  bool reaches(Index i, const surfaces::SurfaceModel& surface, int cells);
  surfaces::SurfaceModel* best_surface(Index i, Reach reach);
  void flood();
  void visit_neighbour(Index i, surfaces::SurfaceModel& surface);
  void note_contacts(Index i);
  void merge_contacts();

  surfaces::Ledger& ledger_;
  int h_cells_;
  bool robust_;  // Parameters::aligned(); else the paper's expansion
  float cos_smooth_;
  std::vector<Index> frontier_;
  std::set<SurfaceId> adopted_;
  struct Contact {
    int points = 0, obstructed = 0, touching = 0;     // of one that fit the other
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // their sum
  };
  std::map<std::pair<SurfaceId, SurfaceId>, Contact> contacts_;
};

}  // namespace octosurf::expansion
