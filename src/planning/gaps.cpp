#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"
#include "planning/blocked_polygon.hpp"
#include "planning/cell_raster.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "planning/voids.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>

namespace octosurf {
namespace {

using planning::CellRaster;
using planning::Mask;
using State = OccupancyView::State;

/// Whether rays passed a place of the plane, or readings lie there.
class Column {
 public:
  Column(const Surface& surface, const OccupancyView& octree)
      : surface_(surface),
        octree_(octree),
        d_(octree.resolution()),
        depth_(std::max(2.5 * d_, 3 * surface.rms_m + d_ / 2)) {}

  double depth() const { return depth_; }

  struct Seen {
    bool reading = false, free = false /* on the plane */, open = false, blocked = false;
    bool passed = false;  // rays went by close before the plane: nothing hid it from them
  };
  Seen at(const Eigen::Vector2d& uv) const {
    Seen seen;
    const OccupancyView::Voxel on_plane = voxel(uv, 0);
    seen.reading = is_reading(on_plane);
    for (double t = d_; !seen.reading && t < depth_ + d_ / 2; t += d_)
      seen.reading = is_reading(voxel(uv, t)) || is_reading(voxel(uv, -t));
    if (seen.reading) return seen;
    seen.free = on_plane.state == State::free;
    seen.open = seen.free && is_open(uv);
    for (double t = d_; t < depth_ + d_ / 2; t += d_) {
      const OccupancyView::Voxel before = voxel(uv, t);
      seen.passed = seen.passed || (t < 2.5 * d_ && before.state == State::free);  // two voxels
      seen.blocked = seen.blocked || (!seen.open && t > 1.25 * d_ && is_other(before));
    }
    // Three voxels above what readings of the plane itself may reach.
    for (int k = 0; k < 3 && !seen.blocked && !seen.open; ++k)
      seen.blocked = voxel(uv, depth_ + (k + 0.5) * d_).state == State::occupied;
    return seen;
  }

  /// Free on the plane and behind it, whatever lies beside.
  bool open_through(const Eigen::Vector2d& uv) const {
    return voxel(uv, 0).state == State::free && is_open(uv);
  }

 private:
  OccupancyView::Voxel voxel(const Eigen::Vector2d& uv, double height) const {
    return octree_.at(surface_.T_map_surface * Eigen::Vector3d(uv.x(), uv.y(), height));
  }
  bool is_reading(const OccupancyView::Voxel& voxel) const {
    return voxel.state == State::occupied && voxel.surface == surface_.id;
  }
  bool is_other(const OccupancyView::Voxel& voxel) const {
    return voxel.state == State::occupied && voxel.surface != 0 && voxel.surface != surface_.id;
  }
  /// Behind a place that is free: free to the depth, or to another surface that lies less deep. One in the
  /// next voxel may be the same face, seen twice.
  bool is_open(const Eigen::Vector2d& uv) const {
    // Steps of d/2: a step of d can miss a voxel cut at a corner.
    for (double t = d_ / 2; t < depth_ + d_ / 4; t += d_ / 2) {
      const OccupancyView::Voxel behind = voxel(uv, -t);
      if (behind.state != State::free) return t > 1.25 * d_ && is_other(behind);
    }
    return true;
  }

  const Surface& surface_;
  const OccupancyView& octree_;
  double d_, depth_;
};

/// The cells of a surface's plane, of edge d, about its polygons.
class GapFinder {
 public:
  GapFinder(const Surface& surface, const OccupancyView& octree, double widest_bridged_m)
      : surface_(surface),
        octree_(octree),
        d_(octree.resolution()),
        column_(surface, octree),
        widest_radius_(std::min(widest_gap_m, widest_bridged_m) / 2 / d_),
        raster_(surface.polygons, d_, static_cast<int>(std::ceil(widest_radius_)) + 2) {}

  GroundedSurface find() {
    GroundedSurface result{std::make_shared<const Surface>(surface_), {}};
    if (raster_.cells() == 0) return result;
    look();
    settle_open();
    cut_voids();
    bridge();
    add_gaps(result.gaps);
    reshape(result);
    return result;
  }

 private:
  void look() {
    inside_ = raster_.inside(surface_.polygons);
    // Between parts of the surface, and in its holes.
    about_ = raster_.closed(inside_, widest_radius_);
    std::vector<Polygon> filled;
    for (const Polygon& polygon : surface_.polygons) filled.push_back({polygon.outer, {}});
    for (const Polygon& polygon : filled) raster_.add_inside({polygon}, about_);
    const std::size_t n = raster_.cells();
    reading_.assign(n, 0);
    free_ = open_ = blocked_ = passed_ = reading_;
    for (std::size_t i = 0; i < n; ++i) {
      if (about_[i] == 0) continue;
      const Column::Seen seen = column_.at(raster_.middle(i));
      reading_[i] = seen.reading;
      free_[i] = seen.free;
      open_[i] = seen.open;
      blocked_[i] = seen.blocked;
      passed_[i] = seen.passed;
    }
  }

  /// Grows the places that are open straight behind over those beside them that are free on the plane, and
  /// drops what is nowhere two cells wide.
  void settle_open() {
    const double aside = std::tan(steepest_ray) * column_.depth() / d_;
    for (int k = 0; k < static_cast<int>(std::floor(aside)); ++k) {
      const Mask before = open_;
      for (std::size_t i = 0; i < before.size(); ++i)
        if (before[i] == 0 && free_[i] != 0 && about_[i] != 0) open_[i] = raster_.any_beside(before, i);
    }
    open_ = raster_.two_wide(open_);
  }

  /// Adds voids that the outline spans to those, and cuts all.
  void cut_voids() {
    const CellRaster fine(surface_.polygons, d_ / 2, 2);
    Mask spanned(fine.cells(), 0);
    planning::mark_voids(
        surface_, octree_, [this](const Eigen::Vector2d& uv) { return column_.open_through(uv); }, fine,
        spanned);
    const std::vector<std::size_t> cells = fine.marked(spanned);
    cut_ = raster_.rows(raster_.marked(open_));
    for (Ring2& row : fine.rows(cells)) cut_.push_back(std::move(row));
    for (const std::size_t i : cells)
      raster_.for_each_within(fine.middle(i), d_ / 2, [&](std::size_t cell) { open_[cell] = 1; });
  }

  /// Decides for each unseen cell by the widest disc that holds it within its gap.
  void bridge() {
    const std::size_t n = raster_.cells();
    Mask gap(n, 0);
    for (std::size_t i = 0; i < n; ++i) gap[i] = about_[i] != 0 && inside_[i] == 0;
    const std::vector<float> off_open = raster_.distance_to(open_),
                             off_blocked = raster_.distance_to(blocked_);
    bridged_.assign(n, 0);
    // What no disc of a cell's radius holds is rounding of the outline, and goes with what is beside it.
    for (std::size_t i = 0; i < n; ++i)
      bridged_[i] = gap[i] != 0 && widest_radius_ >= 1 && off_open[i] > 2 && off_blocked[i] > 2;
    half_ = raster_.depth_in(gap);
    Mask empty = gap, passed = gap;
    for (std::size_t i = 0; i < n; ++i) {
      empty[i] = gap[i] != 0 && reading_[i] == 0;
      passed[i] = empty[i] != 0 && passed_[i] != 0;
    }
    const std::vector<std::int32_t> of_readings = raster_.summed(reading_), of_about = raster_.summed(about_),
                                    of_empty = raster_.summed(empty), of_passed = raster_.summed(passed),
                                    of_inside = raster_.summed(inside_);
    for (double radius = 1; radius <= widest_radius_ * widening; radius *= widening) {
      Mask core = raster_.eroded(gap, radius);
      if (std::find(core.begin(), core.end(), 1) == core.end()) break;
      const std::vector<float> off_core = raster_.distance_to(core);
      // Discs that meet a void, or something that stands there.
      for (std::size_t i = 0; i < n; ++i)
        core[i] = core[i] != 0 && (off_open[i] <= radius + 1 || off_blocked[i] <= radius + 1);
      const std::vector<float> off_spoiled = raster_.distance_to(core);
      const std::vector<std::int32_t> of_solid = raster_.summed(raster_.opened(reading_, radius));
      const int wide = static_cast<int>(std::ceil(radius)),
                around = static_cast<int>(std::ceil(3 * radius)) + 1;
      const auto between_lines = [&](std::size_t i) {
        return 2 * raster_.sum(of_solid, i, around) < raster_.sum(of_inside, i, around);
      };
      // Of one cell more than there are: a share of 1 has no logarithm.
      const auto by_chance = [&](std::size_t i) {
        const double read = raster_.sum(of_readings, i, around), all = raster_.sum(of_about, i, around);
        return -std::log1p(-read / (all + 1)) * std::numbers::pi * radius * radius < rarest &&
               raster_.sum(of_passed, i, wide) >= most * raster_.sum(of_empty, i, wide);
      };
      for (std::size_t i = 0; i < n; ++i)
        if (off_core[i] < radius)
          bridged_[i] = radius <= widest_radius_ && off_spoiled[i] >= radius && blocked_[i] == 0 &&
                        (between_lines(i) || by_chance(i));
    }
    // Unseen cells beside a void are part of it.
    void_ = open_;
    for (std::size_t i = 0; i < n; ++i)
      if (gap[i] != 0 && bridged_[i] == 0 && reading_[i] == 0 && blocked_[i] == 0 && off_open[i] <= 2)
        void_[i] = 1;
  }

  Ground kind(std::size_t i) const {
    if (void_[i] != 0) return Ground::open;
    if (about_[i] == 0 || inside_[i] != 0) return Ground::supported;
    return blocked_[i] != 0 ? Ground::blocked : Ground::unseen;
  }

  void add_gaps(std::vector<Gap>& gaps) const {
    const std::size_t n = raster_.cells();
    Mask taken(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      const Ground ground = kind(i);
      if (taken[i] != 0 || ground == Ground::supported) continue;
      const bool across = bridged_[i] != 0;
      bool at_border = false;
      std::vector<std::size_t> part = raster_.connected(
          i, taken, [&](std::size_t k) { return kind(k) == ground && (bridged_[k] != 0) == across; },
          [&](std::size_t k) { at_border |= about_[k] == 0; });
      float widest = 0;
      bool within = false;
      for (const std::size_t k : part) {
        within |= inside_[k] != 0;
        widest = std::max(widest, half_[k]);
      }
      // Notches of the outer rim are edges, not gaps.
      if ((at_border && !across && !within) || part.size() < 4) continue;
      std::sort(part.begin(), part.end());
      std::vector<Polygon> outline = planning::reshaped({}, raster_.rows(part), {});
      const auto largest = std::max_element(
          outline.begin(), outline.end(),
          [](const Polygon& a, const Polygon& b) { return geometry::area_of(a) < geometry::area_of(b); });
      gaps.push_back({ground, across, std::max(1.0F, 2 * widest - 1) * d_, std::move(*largest)});
    }
  }

  void reshape(GroundedSurface& result) const {
    const auto any = [](const Mask& mask) { return std::find(mask.begin(), mask.end(), 1) != mask.end(); };
    if (!any(bridged_) && cut_.empty()) return;
    // A cell more, so that nothing is left of a gap beside a slanting side.
    std::vector<Polygon> polygons =
        planning::reshaped(surface_.polygons, raster_.rows(raster_.marked(bridged_), 1), cut_);
    std::erase_if(polygons, [&](Polygon& polygon) {
      std::erase_if(polygon.holes, [&](const Ring2& hole) { return -geometry::signed_area(hole) < d_ * d_; });
      return geometry::signed_area(polygon.outer) < d_ * d_;
    });
    result.surface = planning::with_outline(surface_, std::move(polygons));
  }

  static constexpr double widening = 1.25;  // from disc to disc: widths are told apart by a quarter
  // Nats: readings that fall anywhere leave a disc empty in one of 10⁴ places, the number of places in which
  // such gaps are looked for, as for planes (docs/detection.md).
  static constexpr double rarest = 9;
  // Of a gap's voxels before the plane, which rays that pass in steps of d may miss here and there.
  static constexpr double most = 0.75;

  // Rays of 30° and more to the plane are told apart from those along it.
  static constexpr double steepest_ray = 1.0471975511965976;

  const Surface& surface_;
  const OccupancyView& octree_;
  double d_;
  Column column_;
  double widest_radius_;  // cells, of a bridged gap
  CellRaster raster_;
  std::vector<Ring2> cut_;  // rectangles of voids
  Mask inside_, about_, reading_, free_, open_, blocked_, passed_, bridged_, void_;
  std::vector<float> half_;
};

}  // namespace

GroundedSurface find_gaps(const Surface& surface, const OccupancyView& octree, double widest_bridged_m) {
  if (octree.resolution() <= 0) return {std::make_shared<const Surface>(surface), {}};
  return GapFinder(surface, octree, widest_bridged_m).find();
}

std::shared_ptr<const Snapshot> with_gaps(const Snapshot& snapshot, const OccupancyView& octree,
                                          double widest_bridged_m,
                                          std::map<SurfaceId, std::vector<Gap>>* gaps) {
  auto result = std::make_shared<Snapshot>(snapshot);
  for (SurfacePtr& surface : result->surfaces) {
    GroundedSurface found = find_gaps(*surface, octree, widest_bridged_m);
    surface = std::move(found.surface);
    if (gaps != nullptr && !found.gaps.empty()) (*gaps)[surface->id] = std::move(found.gaps);
  }
  return result;
}

double widest_unseen_of(const ContactShape& shape, double share) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : shape.outline) box.extend(p);
  return share * (box.isEmpty() ? 2 * shape.radius : box.sizes().minCoeff());
}

Ground ground_at(const Surface& surface, const OccupancyView& octree, const Eigen::Vector2d& uv) {
  for (const Polygon& polygon : surface.polygons)
    if (planning::contains(polygon, uv)) return Ground::supported;
  if (octree.resolution() <= 0) return Ground::unseen;
  const Column::Seen seen = Column(surface, octree).at(uv);
  return seen.open ? Ground::open : seen.blocked ? Ground::blocked : Ground::unseen;
}

std::array<double, ground_names.size()> ground_under(const Surface& surface, const OccupancyView& octree,
                                                     const ContactShape& shape,
                                                     const Eigen::Isometry3d& T_map_contact) {
  std::array<double, ground_names.size()> shares{};
  const Ring2 outline = shape.outline.empty() ? planning::around_disc(shape.radius) : shape.outline;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : outline) box.extend(p);
  const Eigen::Isometry3d T_surface_contact = surface.T_map_surface.inverse() * T_map_contact;
  // Effort: any size may be asked for. Nine points at least.
  constexpr double samples_along = 64;
  const double narrow_side = box.sizes().minCoeff(), half_of_voxel = octree.resolution() / 2;
  const double step = std::max(half_of_voxel > 0 ? std::min(half_of_voxel, narrow_side / 3) : narrow_side / 3,
                               box.sizes().maxCoeff() / samples_along);
  double sum = 0;
  for (double y = box.min().y() + step / 2; y < box.max().y(); y += step)
    for (double x = box.min().x() + step / 2; x < box.max().x(); x += step) {
      if (!geometry::inside(outline, {x, y})) continue;
      const Eigen::Vector2d uv = (T_surface_contact * Eigen::Vector3d(x, y, 0)).head<2>();
      ++shares[static_cast<std::size_t>(ground_at(surface, octree, uv))];
      ++sum;
    }
  for (double& share : shares) share /= std::max(1.0, sum);
  return shares;
}

}  // namespace octosurf
