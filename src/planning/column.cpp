#include "planning/column.hpp"

#include "geometry/morton.hpp"
#include "geometry/voxel_grid.hpp"
#include "occupancy/payload.hpp"
#include "planning/rings.hpp"

#include <array>
#include <bit>

namespace octosurf::planning {
namespace {

constexpr std::size_t brick_voxels = 64;
/// Morton index of a voxel within its brick, of one coordinate.
constexpr std::array<std::uint8_t, 4> spread{0, 1, 8, 9};

}  // namespace

Columns::Columns(const OccupancyView& octree, const GroundPlane& plane, const Eigen::AlignedBox2d& part)
    : plane_(plane) {
  const double d = plane.d, reach = plane.depth() + 3 * d;  // see at()
  // On the border between two voxels rounding decides.
  const Eigen::AlignedBox3d box = box_about(box_over(plane.T_map_plane, part, -reach, reach), d / 2);
  const Eigen::Array3d low = (box.min() / d).array().floor() + geometry::VoxelGrid::origin,
                       high = (box.max() / d).array().floor() + geometry::VoxelGrid::origin;
  low_ = (low.max(0).min(65532)).cast<int>() / 4 * 4;
  bricks_ = ((high.max(0).min(65535)).cast<int>() - low_) / 4 + 1;
  origin_ = (plane.T_map_plane.translation() / d).array() + geometry::VoxelGrid::origin - low_.cast<double>();
  along_u_ = plane.T_map_plane.linear().col(0) / d;
  along_v_ = plane.T_map_plane.linear().col(1) / d;
  along_normal_ = plane.T_map_plane.linear().col(2) / d;
  thickness_ = reach / d;
  contents_.assign(static_cast<std::size_t>(bricks_.prod()) * brick_voxels, Content::unknown);
  occupancy::for_each_cube(octree, box, [this](const occupancy::Cube& cube) { return copy(cube), true; });
}

void Columns::copy(const occupancy::Cube& cube) {
  const Eigen::Array3i corner(cube.corner[0], cube.corner[1], cube.corner[2]);
  const Eigen::Array3i first = ((corner - low_) / 4).max(0),
                       last = ((corner - low_) / 4 + (1 << (cube.level - 2)) - 1).min(bricks_ - 1);
  constexpr double half_diagonal = 3.5;  // voxels, of a brick
  const Eigen::Vector3d normal = along_normal_ * plane_.d;
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) {
        const Eigen::Vector3d middle = 4 * Eigen::Vector3d(x, y, z) + Eigen::Vector3d::Constant(2);
        if (std::fabs(normal.dot(middle - origin_)) > thickness_ + half_diagonal) continue;
        Content* contents = contents_.data() +
                            brick_voxels * static_cast<std::size_t>((z * bricks_.y() + y) * bricks_.x() + x);
        if (cube.known == ~std::uint64_t{0})
          std::fill_n(contents, brick_voxels, Content::free);
        else
          for (std::uint64_t m = cube.known; m != 0; m &= m - 1)
            contents[std::countr_zero(m)] = Content::free;
        for (std::uint64_t m = cube.occupied; m != 0; m &= m - 1) {
          const auto i = static_cast<unsigned>(std::countr_zero(m));
          const SurfaceId id = cube.surface(i);
          contents[i] = id == plane_.id ? Content::own : id != 0 ? Content::other : Content::pending;
        }
      }
}

Columns::Content Columns::content(const Eigen::Vector3d& place, double height) const {
  const Eigen::Array3d at = place + height * along_normal_;
  if (!(at >= 0).all() || !(at < 4 * bricks_.cast<double>()).all()) return Content::unknown;
  const Eigen::Array3i key = at.cast<int>();
  const auto in_brick = [](int k) {
    return static_cast<std::size_t>(spread[static_cast<std::size_t>(k & 3)]);
  };
  const auto brick = static_cast<std::size_t>(((key.z() >> 2) * bricks_.y() + (key.y() >> 2)) * bricks_.x() +
                                              (key.x() >> 2));
  return contents_[brick * brick_voxels +
                   (in_brick(key.x()) | in_brick(key.y()) << 1 | in_brick(key.z()) << 2)];
}

Columns::Seen Columns::at(const Eigen::Vector2d& uv) const {
  const double d = plane_.d, depth = plane_.depth();
  const Eigen::Vector3d place = place_of(uv);
  const Content on_plane = content(place);
  Seen seen;
  seen.reading = on_plane == Content::own;
  for (double t = d; !seen.reading && t < depth + d / 2; t += d)
    seen.reading = content(place, t) == Content::own || content(place, -t) == Content::own;
  if (seen.reading) return seen;
  seen.free = on_plane == Content::free;
  seen.open = seen.free && is_open(place);
  for (double t = d; t < depth + d / 2; t += d) {
    const Content before = content(place, t);
    seen.passed = seen.passed || (t < 2.5 * d && before == Content::free);  // two voxels
    seen.blocked = seen.blocked || (!seen.open && t > 1.25 * d && before == Content::other);
  }
  // Three voxels above what readings of the plane itself may reach.
  for (int k = 0; k < 3 && !seen.blocked && !seen.open; ++k)
    seen.blocked = content(place, depth + (k + 0.5) * d) >= Content::own;
  return seen;
}

/// Behind a free place: free to the depth, or to another surface before it. One in the next voxel may be the
/// same face, mapped twice.
bool Columns::is_open(const Eigen::Vector3d& place) const {
  const double d = plane_.d;
  // Steps of d/2: a step of d can miss a voxel cut at a corner.
  for (double t = d / 2; t < plane_.depth() + d / 4; t += d / 2) {
    const Content behind = content(place, -t);
    if (behind != Content::free) return t > 1.25 * d && behind == Content::other;
  }
  return true;
}

namespace {

/// rad. Two standard deviations of a stored view, of 6 bits a coordinate (sensing/reading_code.hpp).
constexpr double view_error = 0.035;
/// Voxels: largest error of a crossing, by the view's error, that counts as evidence.
constexpr double farthest_off = 0.75;
/// Voxels: half of a void's least width, two voxels, less the d/4 by which the nearest cell may miss its
/// middle.
constexpr double least_radius = 0.75;
/// Voxels. Outlines close gaps up to h, five voxels by default.
constexpr double largest_radius = 8;
static_assert(deepest_evidence * view_error >= farthest_off &&
                  2 * slanted_reach * view_error >= farthest_off &&
                  void_reach >= 2 * largest_radius + 2 * farthest_off,
              "what decides on a void lies within these reaches");
/// Of ranges: noise grows with their square, so a reading from so much farther off is twice as uncertain.
constexpr double much_farther = 1.3;  // classes of range are a factor of √2 apart

/// A reading of the surface, or the place where a ray passed its plane.
struct Place {
  Eigen::Vector2d at;
  double range;      ///< m, of the reading; negative: it does not count
  double error = 0;  ///< m, of where it passed
};

/// Places by the cells of a raster about them.
class PlaceGrid {
 public:
  /// Sorts the places, and keeps them.
  PlaceGrid(std::vector<Place>& places, double cell)
      : places_(places),
        raster_((box_of(places).min() / cell).array().floor().cast<int>(),
                (box_of(places).max() / cell).array().floor().cast<int>() + 1, cell),
        begin_(sort_by_cell(places, raster_.cells(),
                            [this](const Place& place) { return raster_.cell_at(place.at); })) {}

  /// Calls visit(place) for all in the cells that a box meets.
  template <typename Visit>
  void visit(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    const Eigen::Vector2i low = raster_.place_of(raster_.cell_at(box.min())),
                          high = raster_.place_of(raster_.cell_at(box.max()));
    for (int y = low.y(); y <= high.y(); ++y)
      for (std::uint32_t i = begin_[raster_.index_of({low.x(), y})],
                         end = begin_[raster_.index_of({high.x(), y}) + 1];
           i < end; ++i)
        visit(places_[i]);
  }

 private:
  static Eigen::AlignedBox2d box_of(const std::vector<Place>& places) {
    Eigen::AlignedBox2d box(Eigen::Vector2d::Zero());
    for (const Place& place : places) box.extend(place.at);
    return box;
  }

  std::vector<Place>& places_;
  CellRaster raster_;
  std::vector<std::uint32_t> begin_;
};

class Voids {
 public:
  Voids(const GroundPlane& plane, const OccupancyView& octree, const CellRaster& cells, const Mask& inside)
      : plane_(plane),
        T_plane_map_(plane.T_map_plane.inverse()),
        octree_(octree),
        cells_(cells),
        inside_(inside),
        d_(plane.d) {
    for (unsigned i = 0; i < middles_.size(); ++i)
      middles_[i] = d_ * (T_plane_map_.linear() * (in_cube(i).cast<double>().array() + 0.5).matrix());
  }

  void mark(const Columns& columns, Mask& voids) {
    collect_passed();
    std::vector<std::size_t> open;
    cells_.for_each_in(cells_.box(), [&](std::size_t i, const Eigen::Vector2d& middle) {
      if (inside_[i] != 0 && columns.open_through(middle)) open.push_back(i);
    });
    Eigen::AlignedBox2d evidence;
    for (const Place& place : passed_) evidence.extend(place.at);
    for (const std::size_t cell : open) evidence.extend(cells_.middle(cell));
    if (evidence.isEmpty()) return;
    // The middles of discs, and what bounds these.
    const Eigen::AlignedBox2d middles = box_about(evidence, largest_radius * d_);
    collect_readings(box_about(middles, largest_radius * d_));
    drop_uncertain_readings();
    Mask empty(inside_.size(), 0);
    cells_.for_each_in(middles, [&](std::size_t i, const Eigen::Vector2d& middle) {
      empty[i] = inside_[i] != 0 && middles.contains(middle);
    });
    for (const Place& reading : readings_)
      cells_.for_each_within(reading.at, least_radius * d_, [&](std::size_t cell) { empty[cell] = 0; });
    for (const std::size_t cell : open)
      if (empty[cell] != 0) passed_.push_back({cells_.middle(cell), 0, d_ / 2});
    const PlaceGrid readings(readings_, d_), passed(passed_, d_);
    for (const std::size_t cell : cells_.marked(empty)) {
      const Eigen::Vector2d at = cells_.middle(cell);
      if (!any_within(largest_radius * d_, at, passed)) continue;
      const double radius = radius_about(at, readings);
      if (any_within(radius, at, passed))
        cells_.for_each_within(at, radius + d_ / 4, [&](std::size_t other) { voids[other] = 1; });
    }
  }

 private:
  /// Where rays to readings behind the plane crossed it, inside the outline.
  void collect_passed() {
    const double tolerance = std::max(d_, 3 * plane_.rms_m + d_ / 2);  // nearer: may be this face
    // Deeper crossings are too uncertain, even straight on.
    const double deepest = farthest_off * d_ / view_error;
    const Eigen::Vector3f normal = plane_.T_map_plane.linear().col(2).cast<float>();
    for_each_reading(
        box_about(cells_.box(), slanted_reach * d_), -deepest, -tolerance, false,
        [&](const occupancy::VoxelPayload& payload, const Eigen::Vector3d& middle, const auto& place) {
          const Eigen::Vector3f& view_of_map = sensing::views[payload.view];
          const double toward = normal.dot(view_of_map), certain = farthest_off * d_ * toward * toward;
          if (!(toward > 0) || view_error * (-middle.z() - d_) > certain) return;
          const Eigen::Vector3d p = place();
          const double error = view_error * -p.z() / (toward * toward);
          if (-p.z() < tolerance || error > farthest_off * d_) return;
          const Eigen::Vector3d view = T_plane_map_.linear() * view_of_map.cast<double>();
          const Eigen::Vector2d at = (p - p.z() / view.z() * view).head<2>();
          if (cells_.box().contains(at) && inside_[cells_.cell_at(at)] != 0)
            passed_.push_back({at, sensing::range_of_class(payload.range_class), error});
        });
  }

  void collect_readings(const Eigen::AlignedBox2d& part) {
    const double thick = std::max(plane_.depth(), 3 * plane_.rms_m + d_);
    for_each_reading(
        part.intersection(cells_.box()), -thick, thick, true,
        [&](const occupancy::VoxelPayload& payload, const Eigen::Vector3d&, const auto& place) {
          readings_.push_back({place().template head<2>(), sensing::range_of_class(payload.range_class)});
        });
  }

  /// Calls `visit(payload, middle of its voxel, place())` for the surface's own readings, or for all others,
  /// in voxels over a part of the plane and between two heights, with a margin of some voxels; places in the
  /// plane's frame.
  template <class Visit>
  void for_each_reading(const Eigen::AlignedBox2d& part, double below, double above, bool own,
                        const Visit& visit) const {
    const geometry::VoxelGrid grid(d_);
    const double half_cube = 3.5 * d_;
    const Eigen::AlignedBox2d wide = box_about(part, half_cube);
    const auto in_cube = [&](const occupancy::Cube& cube) {
      const Eigen::Vector3d corner = T_plane_map_ * grid.corner_of(key_of(cube, 0)),
                            middle = corner + middles_.back() + middles_.front();
      if (middle.z() < below - half_cube || middle.z() > above + half_cube ||
          !wide.contains(middle.head<2>()))
        return true;
      const occupancy::VoxelPayload* payload = cube.payloads;
      for (std::uint64_t m = cube.points; m != 0; m &= m - 1, ++payload) {
        if ((cube.numbers->id(payload->surface) == plane_.id) != own) continue;
        const auto i = static_cast<unsigned>(std::countr_zero(m));
        visit(*payload, corner + middles_[i], [&]() -> Eigen::Vector3d {
          return T_plane_map_ * occupancy::load_point(*payload, grid, key_of(cube, i));
        });
      }
      return true;
    };
    occupancy::for_each_cube(octree_, box_about(box_over(plane_.T_map_plane, part, below, above), half_cube),
                             in_cube, true);
  }

  static Eigen::Vector3i in_cube(unsigned i) {
    return {static_cast<int>(geometry::compact_bits(i)), static_cast<int>(geometry::compact_bits(i >> 1)),
            static_cast<int>(geometry::compact_bits(i >> 2))};
  }
  static geometry::VoxelKey key_of(const occupancy::Cube& cube, unsigned i) {
    const Eigen::Vector3i in = in_cube(i);
    const auto key = [&](int axis) {
      return static_cast<std::uint16_t>(cube.corner[static_cast<std::size_t>(axis)] + in[axis]);
    };
    return {key(0), key(1), key(2)};
  }
  /// Far readings scatter beyond edges into slots, where no nearer one replaces them: they do not count where
  /// a ray from much nearer passed.
  void drop_uncertain_readings() {
    if (readings_.empty()) return;
    const PlaceGrid grid(readings_, d_);
    for (const Place& passed : passed_)
      grid.visit(box_about(passed.at, least_radius * d_), [&](Place& reading) {
        if (reading.range > much_farther * passed.range &&
            (reading.at - passed.at).norm() <= least_radius * d_)
          reading.range = -1;
      });
    std::erase_if(readings_, [](const Place& reading) { return reading.range < 0; });
  }

  /// m: of the largest disc about a place without readings, up to the largest that counts.
  double radius_about(const Eigen::Vector2d& at, const PlaceGrid& readings) const {
    for (double reach = 2 * d_;; reach *= 2) {
      const double limit = std::min(reach, largest_radius * d_);
      double best = limit * limit;
      readings.visit(box_about(at, limit),
                     [&](const Place& reading) { best = std::min(best, (reading.at - at).squaredNorm()); });
      if (best < limit * limit || limit < reach) return std::sqrt(best);
    }
  }

  /// Whether rays passed a disc, however far off they may have been.
  static bool any_within(double radius, const Eigen::Vector2d& at, const PlaceGrid& passed) {
    bool any = false;
    passed.visit(box_about(at, radius),
                 [&](const Place& place) { any = any || (place.at - at).norm() + place.error <= radius; });
    return any;
  }

  const GroundPlane& plane_;
  Eigen::Isometry3d T_plane_map_;
  const OccupancyView& octree_;
  const CellRaster& cells_;
  const Mask& inside_;
  double d_;
  std::array<Eigen::Vector3d, 64> middles_;  // of a cube's voxels, from its corner, plane's frame
  std::vector<Place> readings_, passed_;
};

}  // namespace

void mark_voids(const GroundPlane& plane, const OccupancyView& octree, const Columns& columns,
                const CellRaster& cells, const Mask& inside, Mask& voids) {
  Voids(plane, octree, cells, inside).mark(columns, voids);
}

}  // namespace octosurf::planning
