#pragma once

#include "alignment/samples.hpp"
#include "sensing/noise_model.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <octosurf/occupancy.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// What a search without a guess decides by.
struct PlaceLimits {
  /// Least edge of the finest cells, m: what a wall, the error of a sensor and half a degree 10 m away need.
  double cell_m = 0.12;
  std::size_t points = 256;  ///< of a run, evenly by direction: a share of a half is then known to 3 %
  double least_share = 0.5;  ///< of these on matter: with less, most of the run is from elsewhere
  /// Of the best place's share: another one may explain a tenth less, and its cells a tenth more by chance.
  double near_best = 0.8;
  double apart_m = 0.45, apart_rad = 0.13;  ///< one place: what refining reaches from it
  std::size_t most_places = 32;             ///< more that fit are no answer
  std::size_t most_nodes = 4'000'000;       ///< looked at: some two seconds
};

/// Cells of an octree with matter, and for each how far from it the next ones are: the smallest k for which a
/// cell of [x, x + 2^k)³ has some. One such number bounds the score of all translations of a block at once,
/// of every size. The octree's own inner nodes, maxima of their children, bound aligned cubes only; a block's
/// points lie in windows anywhere, hence this copy, of a byte a cell. Matter is widened by half a cell, so
/// that the nearest of whole translations misses nothing.
class CellPyramid {
 public:
  CellPyramid(const OccupancyView& octree, double least_edge);

  static constexpr int top = 5;  ///< largest window: 2^top cells
  double edge() const { return edge_; }
  const Eigen::Array3i& size() const { return size_; }
  const Eigen::Vector3d& low() const { return low_; }  ///< corner of cell 0, m
  /// Whether cells [x, x + 2^level), likewise y and z, may have matter; at the low border a larger window.
  bool any(int x, int y, int z, int level) const {
    const int last = -(1 << level);
    if (x >= size_.x() || y >= size_.y() || z >= size_.z() || x <= last || y <= last || z <= last)
      return false;
    x = x < 0 ? 0 : x, y = y < 0 ? 0 : y, z = z < 0 ? 0 : z;
    return levels_[index_of(x, y, z)] <= level;
  }

 private:
  void widen();
  std::size_t index_of(int x, int y, int z) const {
    return static_cast<std::size_t>((z * size_.y() + y) * size_.x() + x);
  }

  double edge_ = 0;
  Eigen::Array3i size_ = Eigen::Array3i::Zero();
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  std::vector<std::uint8_t> levels_;  // by cell, x first
};

/// The scans of a run as one, in the frame of the last one's sensor: readings of at most 16 of them, in rows
/// as they were, with the place from which each was taken.
Scan joined(std::span<const Scan> scans);

/// Where the run may have been taken.
struct Places {
  std::vector<Eigen::Isometry3d> poses;  ///< of its sensor, map frame; best first
  bool complete = true;                  ///< none is missing that has `near_best` of the best one's share
};

/// All poses at which a run fits, by branch and bound over translations for each turn about `up` (Olson 2015;
/// Hess et al. 2016). `tilts`: turns of the run's frame to one with the map's up, each searched. `region`
/// holds the sensor; empty: anywhere.
///
/// Exact are translations, of whole cells for given points. Not exact: turns go in steps by which what is at
/// nine tenths of the range moves a cell, so that its points may be half a cell off; of a run only some
/// points are used; places nearer than `apart` to a better one are not told from it.
Places search_places(const CellPyramid& cells, const Scan& run, const sensing::NoiseModel& noise,
                     const RangeLimits& range, double resolution, const Eigen::Vector3d& up,
                     std::span<const Eigen::Matrix3d> tilts, const Eigen::AlignedBox3d& region,
                     const PlaceLimits& limits);

}  // namespace octosurf::alignment
