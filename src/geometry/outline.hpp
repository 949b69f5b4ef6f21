#pragma once

#include "geometry/cell_bits.hpp"

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// The alpha shape of sites that come and go cell by cell, kept up to date.
///
/// 1. update() gives what its slow twin, alpha_shape() in test/support, gives for the sites that are in, bit
/// for
///    bit and whatever was in before: a set of sites has one Delaunay triangulation, four cocircular ones
///    included (CGAL perturbs symbolically, by the sites' lexicographic order).
/// 2. Cost of update(): O(log n) per site that came or went, plus the length of all rings; about 3 µs
///    a site. Memory about 150 bytes a site.
class Outline {
 public:
  /// Coordinates come in whole multiples of this and below 2¹⁷ in size, so that near rings areas and
  /// orientations are exact, and what is not collinear stays so when the rings are moved.
  static constexpr double quantum = 1.0 / 4096;

  explicit Outline(double alpha);
  ~Outline();
  Outline(Outline&&) noexcept;
  Outline& operator=(Outline&&) noexcept;

  double alpha() const;
  std::size_t sites() const;  ///< as of the last update(); equal ones counted once

  /// Replaces a cell's sites; takes effect with update(), before which no cell comes twice. Equal
  /// sites may stand in several cells.
  void set(PlaneCell cell, std::span<const Eigen::Vector2d> sites);
  std::vector<Polygon> update();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf::geometry
