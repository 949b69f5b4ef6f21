#include "detection/tiles.hpp"

#include "detection/constants.hpp"
#include "detection/patch_graph.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::detection {
namespace {

constexpr int smallest_square = 8;  // cells along each side: a tile of the hash

/// A part of a surface.
struct SurfacePart {
  Patch sums;
  double pairs = 0;  // of an inlier in it and an adjacent occupied cell of another part
  bool agrees = true;
};

class Tiles {
 public:
  Tiles(const surfaces::SurfaceModel& surface, const sensing::ReadingModel& model)
      : surface_(surface), inliers_(surface.sorted_inliers()) {
    cells_.reserve(inliers_.size());
    for (const surfaces::Inlier& inlier : inliers_) cells_.push_back(surface.cell_of(inlier.position));
    whole_.plane = surface.plane();
    whole_.origin = surface.reference();
    whole_.pose_variance = model.pose_variance();
    const double variance = variance_in_tiles();
    for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c) {
      weights_[c] = model.weight(c, model.cos_incidence_of(c, variance));
      log_peaks_[c] = model.log_peak(c, model.cos_incidence_of(c, variance));
    }
    for (const surfaces::Inlier& inlier : inliers_) add(inlier, whole_);
  }

  /// Adds the inliers of the squares of `size` cells along each side that disagree; returns the number of
  /// squares.
  std::size_t add_squares(int size, std::vector<geometry::VoxelKey>& keys) const {
    const auto divided = [size](int k) { return k >= 0 ? k / size : (k - size + 1) / size; };
    return add(
        [&](geometry::PlaneCell cell) {
          return geometry::PlaneCell{divided(cell.u), divided(cell.v)}.packed();
        },
        keys);
  }
  /// The same for the halves on both sides of the centre, along and across.
  void add_halves(std::vector<geometry::VoxelKey>& keys) const {
    double u = 0, v = 0;
    for (const geometry::PlaneCell cell : cells_) {
      u += cell.u;
      v += cell.v;
    }
    const auto n = static_cast<double>(cells_.size());
    add([middle = u / n](geometry::PlaneCell cell) { return std::uint64_t{cell.u < middle}; }, keys);
    add([middle = v / n](geometry::PlaneCell cell) { return std::uint64_t{cell.v < middle}; }, keys);
  }

 private:
  /// m², about each tile's own plane: about the common plane it would be larger for a surface that is curved
  /// or two.
  double variance_in_tiles() const {
    tsl::robin_map<std::uint64_t, geometry::Moments, geometry::PackedKeyHash> tiles;
    for (std::size_t i = 0; i < inliers_.size(); ++i)
      tiles[geometry::CellBits::tile_of(cells_[i]).packed()].add(inliers_[i].position.cast<double>() -
                                                                 whole_.origin);
    std::vector<std::pair<double, double>> sums;  // of squares, and of degrees of freedom
    for (const auto& [place, moments] : tiles)
      if (moments.count >= static_cast<double>(Constants::fewest_of_plane))
        sums.emplace_back(moments.count * geometry::fit_plane(moments).variances[0], moments.count - 3);
    std::sort(sums.begin(), sums.end());  // same rounding for any order of tiles
    double squares = 0, free = 0;
    for (const auto& [of_tile, its_free] : sums) {
      squares += of_tile;
      free += its_free;
    }
    return free > 0 ? squares / free : 0;
  }

  void add(const surfaces::Inlier& inlier, Patch& sums) const {
    sums.moments.add(inlier.position.cast<double>() - whole_.origin, weights_[inlier.range_class]);
    sums.log_peaks += log_peaks_[inlier.range_class];
    ++sums.readings;
  }

  template <class PartOf>
  std::size_t add(const PartOf& part_of, std::vector<geometry::VoxelKey>& keys) const {
    tsl::robin_map<std::uint64_t, SurfacePart, geometry::PackedKeyHash> parts;
    for (std::size_t i = 0; i < inliers_.size(); ++i) {
      SurfacePart& part = parts[part_of(cells_[i])];
      add(inliers_[i], part.sums);
      part.pairs += pairs_across(cells_[i], part_of);
    }
    for (auto at = parts.begin(); at != parts.end(); ++at) at.value().agrees = agrees(at->second);
    for (std::size_t i = 0; i < inliers_.size(); ++i)
      if (!parts.at(part_of(cells_[i])).agrees) keys.push_back(inliers_[i].key);
    return parts.size();
  }

  template <class PartOf>
  int pairs_across(geometry::PlaneCell cell, const PartOf& part_of) const {
    const std::uint64_t own = part_of(cell);
    const auto [u, v] = cell;
    const bool inside = part_of({u - 1, v - 1}) == own && part_of({u + 1, v - 1}) == own &&
                        part_of({u - 1, v + 1}) == own && part_of({u + 1, v + 1}) == own;
    if (inside) return 0;
    int pairs = 0;
    for (int y = v - 1; y <= v + 1; ++y)
      for (int x = u - 1; x <= u + 1; ++x) pairs += part_of({x, y}) != own && surface_.occupied({x, y});
    return pairs;
  }

  /// Whether it is one plane with the rest of the surface.
  bool agrees(const SurfacePart& of_surface) const {
    Patch part = of_surface.sums, rest = whole_;
    rest.moments.add(part.moments, -1);
    rest.log_peaks -= part.log_peaks;
    rest.readings -= part.readings;
    if (std::min(part.readings, rest.readings) < Constants::fewest_of_plane) return true;
    part.plane = whole_.plane;
    part.origin = whole_.origin;
    part.pose_variance = whole_.pose_variance;
    part.fit();
    rest.fit();
    part.hits = part.readings;  // not available from sums
    rest.hits = rest.readings;
    return gain_of_merging(rest, part, part.centroid(), of_surface.pairs) > 0;
  }

  const surfaces::SurfaceModel& surface_;
  Patch whole_;
  std::vector<surfaces::Inlier> inliers_;  // in key order: same rounding for any order of insertion
  std::vector<geometry::PlaneCell> cells_;
  std::array<double, sensing::NoiseModel::classes> weights_{}, log_peaks_{};
};

}  // namespace

std::vector<geometry::VoxelKey> where_tiles_disagree(const surfaces::SurfaceModel& surface,
                                                     const sensing::ReadingModel& model) {
  const Tiles tiles(surface, model);
  std::vector<geometry::VoxelKey> keys;
  for (int size = smallest_square; tiles.add_squares(size, keys) > 4;) size *= 2;
  tiles.add_halves(keys);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace octosurf::detection
