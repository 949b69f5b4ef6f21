#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Marks on square cells of a plane, 64 to a word, row by row. What is marked covers what it stands for: a
/// shape marks every cell that it touches, so that what is not marked is free for certain.
class BitRaster {
 public:
  static constexpr double rounding = 1e-6;  ///< cells: what comes so near to a cell touches it

  /// The cells that cover a box, counted from the plane's origin; none of an empty box.
  BitRaster(const Eigen::AlignedBox2d& box, double edge);
  /// m, for a surface: an eighth of a voxel if it is small, as a tread or a stone, where that decides; else a
  /// quarter, or twice as large until its box has at most 2²⁸ cells. 2 cm stands for a missing resolution.
  static double edge_for(const Surface& surface);

  double edge() const { return edge_; }
  Eigen::AlignedBox2d box() const { return {place_of({0, 0}), place_of({width_, height_})}; }

  /// Convex polygons, or segments, reaching by so many cells more. O(rows and vertices).
  void mark(const Ring2& convex, double more = rounding);
  bool touched_by(const Ring2& convex, double more = rounding) const;
  /// Calls `visit(middle, whether it is marked)` for the cells that a convex polygon touches.
  void for_each_touched(const Ring2& convex,
                        const std::function<void(const Eigen::Vector2d& middle, bool marked)>& visit) const;
  /// All but the cells inside polygons that none of their edges touches.
  void mark_outside(const std::vector<Polygon>& polygons);
  BitRaster blank() const;           ///< the same cells without marks
  void add(const BitRaster& other);  ///< the marks that another raster of equal cells has here, too

  /// Marks each cell in which a place may lie at which a convex polygon, moved there from the origin, touches
  /// a marked cell. O(words · rows of the polygon).
  BitRaster dilated(const Ring2& convex) const;
  /// Polygons within the cells without marks, simplified by less than a cell: each lies within its cells.
  std::vector<Polygon> free_polygons() const;

 private:
  using Word = std::uint64_t;
  static constexpr int bits = 64;

  Word* row(int y) { return words_.data() + static_cast<std::ptrdiff_t>(y) * row_words_; }
  const Word* row(int y) const { return words_.data() + static_cast<std::ptrdiff_t>(y) * row_words_; }
  bool is_free(int x, int y) const {
    return x >= 0 && y >= 0 && x < width_ && y < height_ && (row(y)[x / bits] >> (x % bits) & 1) == 0;
  }
  /// Calls `visit(index of a word, mask)` for cells `from` to `to` of a row, until it returns true.
  template <class Visit>
  bool in_run(int y, int from, int to, const Visit& visit) const;
  /// The same for the cells that a convex polygon touches.
  template <class Visit>
  bool in_rows(const Ring2& convex, double more, const Visit& visit) const;
  void separate_corners();
  std::vector<Eigen::Vector2i> corners_at(int x, int y, BitRaster& traced) const;
  Ring2 simplified(const std::vector<Eigen::Vector2i>& corners, BitRaster& taken) const;
  Eigen::Vector2d place_of(const Eigen::Vector2i& corner) const {
    return edge_ * (corner + Eigen::Vector2i(x0_, y0_)).cast<double>();
  }

  double edge_;
  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0, row_words_ = 0;
  std::vector<Word> words_;
};

}  // namespace octosurf::planning
