#include "geometry/morton.hpp"
#include "geometry/voxel_grid.hpp"
#include "occupancy/voxel_payload.hpp"
#include "sensing/reading_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/ground_patch.hpp>

namespace octosurf {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
constexpr float cell_m = 0.05F;        ///< of the flood's grid: half a narrow foot
constexpr double farthest_m = 5;       ///< of a point from the base
constexpr float margin_m = 0.1F;       ///< about the points, in which edges are looked for
constexpr float first_ground_m = 0.5;  ///< from the base to the nearest ground seen, beside the robot's feet
constexpr double deepest_m = 2;        ///< below the base that ground is looked for
/// Voxels, from a free place down, that must be free, too, where the ground is open: as GroundPlane::depth().
constexpr float open_depth = 2.5;
/// Voxels: a pending reading nearer to a plane may be of it.
constexpr float beside_plane = 1.5;
/// Of the radius in which readings are looked for: the least offset of their mean that is none of chance.
/// Half a disc's mean lies at 4/(3 π) = 0.42.
constexpr float lopsided = 0.3F;

/// A surface's plane over the patch.
struct PlaneOver {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< patch's frame
  float offset = 0;                                  ///< normal · p = offset
  float slope_rad = unknown;                         ///< of the surface
  bool level = false;                                ///< one can stand on it
  Eigen::Vector3f height = Eigen::Vector3f::Zero();  ///< of a level plane: height · (x, y, 1)
};

/// The reading of an occupied voxel, in the patch's frame.
struct Reading {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();
  float height = 0;
  std::uint32_t plane = 0;  ///< index; 0: pending
};

/// A level plane beside a place, by its readings.
struct LevelPlane {
  std::uint32_t plane = 0;
  float height = 0, nearest = 0;                    // over the place; squared distance of the nearest reading
  Eigen::Vector3f aside = Eigen::Vector3f::Zero();  // sum of their offsets, and their number
  float off_middle() const { return aside.hnormalized().norm(); }
};

/// What is at a place, seen from ground nearby.
struct Look {
  PatchCell cell = PatchCell::unseen;
  float height = unknown, slope_rad = unknown;
  bool lopsided = false;  ///< its readings lie to one side
};

/// The readings around a robot, by cells of a grid.
class Readings {
 public:
  Readings(const GroundView& view, const Eigen::Isometry3d& T_map_patch, const PatchLayout& layout);

  std::size_t cells() const { return first_.size() - 1; }
  Eigen::Vector2f middle(std::size_t cell) const {
    const auto columns = static_cast<std::size_t>(size_.y());
    return low_ + cell_m * Eigen::Vector2f(static_cast<float>(cell / columns) + 0.5F,
                                           static_cast<float>(cell % columns) + 0.5F);
  }
  std::size_t cell_at(const Eigen::Vector2f& place) const { return index(array_at(place)); }
  /// Calls `visit` with the cells of a square of `reach` cells to each side.
  template <class Visit>
  void for_each_near(std::size_t cell, int reach, const Visit& visit) const {
    const Eigen::Array2i at(static_cast<int>(cell) / size_.y(), static_cast<int>(cell) % size_.y());
    const Eigen::Array2i from = (at - reach).max(0), to = (at + reach).min(size_ - 1);
    for (int x = from.x(); x <= to.x(); ++x)
      for (int y = from.y(); y <= to.y(); ++y) visit(index({x, y}));
  }
  /// Of the highest surface below the base, or reading without one.
  float highest_below_base(std::size_t cell) const;
  Look look(const Eigen::Vector2f& place, float ground, float depth = open_depth) const;
  /// What is supported is not where the ground is open a voxel farther: readings stand for their voxels, so
  /// edges are known to a voxel.
  Look without_edge(Look look, const Eigen::Vector2f& place) const;

 private:
  std::size_t index(const Eigen::Array2i& at) const {
    return static_cast<std::size_t>(at.x() * size_.y() + at.y());
  }
  Eigen::Array2i array_at(const Eigen::Vector2f& place) const {
    return ((place - low_) * (1 / cell_m)).array().cast<int>();  // toward zero
  }
  void add(const OccupancyView::Cube& cube);
  void sort_by_cell();
  std::uint32_t plane_of(SurfaceId id);
  bool is_free(const Eigen::Vector2f& place, float height, bool or_occupied = false) const;
  bool is_open(const Eigen::Vector2f& place, float height, float depth) const;

  const GroundView& view_;
  const PatchLayout& layout_;
  Eigen::Isometry3d T_map_patch_;
  Eigen::Isometry3f T_patch_map_;
  float d_, covered_, bridged_, reach_;
  std::array<Eigen::Vector3f, 64> in_cube_;  // corners of a cube's voxels, from its own
  Eigen::Matrix3f per_part_;                 // of 256 parts of a voxel's edge
  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  Eigen::Array2i size_ = Eigen::Array2i::Zero();
  std::vector<PlaneOver> planes_{{}};
  std::vector<std::pair<SurfaceId, std::uint32_t>> known_;  // ascending
  SurfaceId last_id_ = 0;
  std::uint32_t last_plane_ = 0;
  std::vector<Reading> readings_;     // by cell
  std::vector<std::uint32_t> first_;  // of each cell, and the end
};

Readings::Readings(const GroundView& view, const Eigen::Isometry3d& T_map_patch, const PatchLayout& layout)
    : view_(view),
      layout_(layout),
      T_map_patch_(T_map_patch),
      T_patch_map_(T_map_patch.inverse().cast<float>()),
      d_(static_cast<float>(view.octree().resolution())),
      covered_(d_ / std::numbers::sqrt2_v<float>),
      bridged_(std::max(covered_, (d_ + static_cast<float>(view.widest_unseen_m())) / 2)),
      reach_(std::max(bridged_, 0.4999F * cell_m)) {  // in the middle of a cell its own readings suffice
  per_part_ = T_patch_map_.linear() * (d_ / 256);
  for (unsigned i = 0; i < in_cube_.size(); ++i)
    in_cube_[i] = 256 * per_part_ *
                  Eigen::Vector3f(static_cast<float>(geometry::compact_bits(i)),
                                  static_cast<float>(geometry::compact_bits(i >> 1)),
                                  static_cast<float>(geometry::compact_bits(i >> 2)));
  Eigen::AlignedBox2f box(Eigen::Vector2f::Zero());
  for (const Eigen::Vector2d& point : layout.points) box.extend(point.cast<float>());
  low_ = cell_m * ((box.min().array() - margin_m) / cell_m).floor();
  size_ = ((box.max().array() + margin_m - low_.array()) / cell_m).floor().cast<int>() + 1;
  const Eigen::Vector2f high = low_ + cell_m * size_.cast<float>().matrix();
  Eigen::AlignedBox3d part;
  for (const float x : {low_.x(), high.x()})
    for (const float y : {low_.y(), high.y()})
      for (const double z : {-deepest_m, 2 * layout.headroom_m + layout.max_step_m})  // see flood()
        part.extend(T_map_patch * Eigen::Vector3d(x, y, z));
  readings_.reserve(1 << 14);
  view.octree().for_each_cube(
      part, [this](const OccupancyView::Cube& cube) { return add(cube), true; }, true);
  sort_by_cell();
}

std::uint32_t Readings::plane_of(SurfaceId id) {
  if (id == last_id_) return last_plane_;
  last_id_ = id;
  const auto at = std::lower_bound(known_.begin(), known_.end(), std::pair(id, std::uint32_t{0}));
  if (at != known_.end() && at->first == id) return last_plane_ = at->second;
  last_plane_ = 0;
  if (const Surface* surface = view_.mapped().find(id)) {
    const Plane& plane = surface->plane;
    PlaneOver over;
    over.normal = T_patch_map_.linear() * plane.normal.cast<float>();
    over.offset = static_cast<float>(-plane.signed_distance(T_map_patch_.translation()));
    over.slope_rad = std::acos(std::clamp(over.normal.z(), -1.0F, 1.0F));
    over.level = over.slope_rad <= view_.rules().limits.max_slope_rad;
    if (over.level)
      over.height << -over.normal.x() / over.normal.z(), -over.normal.y() / over.normal.z(),
          over.offset / over.normal.z();
    last_plane_ = static_cast<std::uint32_t>(planes_.size());
    planes_.push_back(over);
  }
  known_.insert(at, {id, last_plane_});
  return last_plane_;
}

void Readings::add(const OccupancyView::Cube& cube) {
  const geometry::VoxelGrid grid(view_.octree().resolution());
  const Eigen::Vector3d low = grid.corner_of({cube.corner[0], cube.corner[1], cube.corner[2]});
  const Eigen::Vector3f corner = T_patch_map_.linear() * (low - T_map_patch_.translation()).cast<float>();
  // A larger cube, imported from an OctoMap, holds no readings: it counts as 4³ large voxels.
  const auto scale = static_cast<float>(1 << (cube.level - 2));
  const Eigen::Vector2f middle = (corner + scale * 2 * in_cube_[7]).head<2>();
  const float reach = 3.5F * d_ * scale;  // half a cube's diagonal
  if (((middle - low_).array() < -reach).any() ||
      ((middle - low_).array() > reach + cell_m * size_.cast<float>()).any())
    return;
  constexpr auto farthest = static_cast<float>(sensing::ReadingModel::clutter_depth / 2);
  const occupancy::VoxelPayload* payload = cube.payloads;
  for (std::uint64_t m = cube.occupied; m != 0; m &= m - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    Eigen::Vector3f part = Eigen::Vector3f::Constant(128);  // of the voxel
    if ((cube.points >> i & 1) != 0) {
      part = Eigen::Vector3i(payload->offset_x, payload->offset_y, payload->offset_z).cast<float>().array() +
             0.5F;
      ++payload;
    }
    Eigen::Vector3f p = corner + scale * (in_cube_[i] + per_part_ * part);
    const std::uint32_t plane = cube.surface[i] == 0 ? 0 : plane_of(cube.surface[i]);
    if (plane != 0) {
      const float off = planes_[plane].normal.dot(p) - planes_[plane].offset;
      if (std::fabs(off) <= farthest) p -= off * planes_[plane].normal;
    }
    if ((p.head<2>().array() >= low_.array()).all() && (array_at(p.head<2>()) < size_).all())
      readings_.push_back({p.head<2>(), p.z(), plane});
  }
}

void Readings::sort_by_cell() {
  first_.assign(static_cast<std::size_t>(size_.prod()) + 1, 0);
  for (const Reading& reading : readings_) ++first_[cell_at(reading.place) + 1];
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  std::vector<Reading> sorted(readings_.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (const Reading& reading : readings_) sorted[next[cell_at(reading.place)]++] = reading;
  readings_ = std::move(sorted);
}

float Readings::highest_below_base(std::size_t cell) const {
  float surface = unknown, reading = unknown;
  for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
    const Reading& one = readings_[i];
    if (one.height > 0) continue;
    float& highest = planes_[one.plane].level ? surface : reading;
    if (!(one.height <= highest)) highest = one.height;  // NaN fails
  }
  return std::isnan(surface) ? reading : surface;
}

bool Readings::is_free(const Eigen::Vector2f& place, float height, bool or_occupied) const {
  const Eigen::Vector3d p = T_map_patch_ * Eigen::Vector3f(place.x(), place.y(), height).cast<double>();
  const OccupancyView::State state = view_.octree().at(p).state;
  return state == OccupancyView::State::free || (or_occupied && state == OccupancyView::State::occupied);
}

/// Free, and free below it to a depth in voxels, or to something else two voxels lower.
bool Readings::is_open(const Eigen::Vector2f& place, float height, float depth) const {
  for (float below = 0; below < depth; ++below)
    if (!is_free(place, height - below * d_, below > 1)) return false;
  return is_free(place, height - depth * d_, true);
}

Look Readings::look(const Eigen::Vector2f& place, float ground, float depth) const {
  const auto step = static_cast<float>(layout_.max_step_m), headroom = static_cast<float>(layout_.headroom_m);
  constexpr float none = -std::numeric_limits<float>::infinity();
  float hanging = none, topmost = none, steep = none, lower = none;  // above a step, within it, below it
  std::array<LevelPlane, 4> planes;
  std::size_t count = 0;
  const Eigen::Array2i from = array_at(place.array() - reach_).max(0),
                       to = array_at(place.array() + reach_).min(size_ - 1);
  for (int x = from.x(); x <= to.x(); ++x)
    for (std::uint32_t i = first_[index({x, from.y()})]; i < first_[index({x, to.y()}) + 1]; ++i) {
      const Reading& one = readings_[i];
      const Eigen::Vector2f off = one.place - place;
      const float distance = off.squaredNorm();
      if (distance > reach_ * reach_) continue;
      const PlaneOver& over = planes_[one.plane];
      const float height = over.level ? over.height.dot(place.homogeneous()) : one.height;
      const bool covers = distance <= covered_ * covered_;
      if (height > ground + step) {
        if (covers && height <= ground + headroom) hanging = std::max(hanging, height);
      } else if (height < ground - step) {
        if (covers) lower = std::max(lower, height);
      } else if (!over.level) {
        // A riser is seen from above only where its step's planes are not.
        float& highest = one.plane == 0 ? topmost : steep;
        if (covers) highest = std::max(highest, height);
      } else {
        std::size_t k = 0;
        while (k < count && planes[k].plane != one.plane) ++k;
        if (k == planes.size()) continue;
        if (k == count) planes[count++] = {one.plane, height, distance};
        planes[k].nearest = std::min(planes[k].nearest, distance);
        planes[k].aside += off.homogeneous();
      }
    }
  // The highest whose readings lie all around; else, as at the edge of a step, that of the nearest reading.
  const auto is_around = [this](const LevelPlane& p) {
    return p.nearest <= covered_ * covered_ && p.off_middle() <= lopsided * reach_;
  };
  const LevelPlane* best = nullptr;
  for (std::size_t k = 0; k < count; ++k) {
    const LevelPlane& one = planes[k];
    if (one.nearest > bridged_ * bridged_) continue;
    const bool around = is_around(one);
    if (best == nullptr || (around != is_around(*best) ? around
                            : around                   ? one.height > best->height
                                                       : one.nearest < best->nearest))
      best = &one;
  }
  const float on_plane = best != nullptr ? best->height : none;
  if (hanging > none) return {PatchCell::occupied, hanging};
  if (topmost > on_plane + beside_plane * d_) return {PatchCell::occupied, topmost};
  if (best != nullptr && (best->nearest <= covered_ * covered_ || !is_open(place, on_plane, depth)))
    return {PatchCell::supported, on_plane, planes_[best->plane].slope_rad,
            best->off_middle() > lopsided * reach_};
  if (steep > none) return {PatchCell::occupied, steep};
  const float level = best != nullptr ? on_plane : ground;
  if (lower > none) return is_free(place, level) ? Look{PatchCell::below, lower} : Look{};
  return is_open(place, level, depth) ? Look{PatchCell::below} : Look{};
}

Look Readings::without_edge(Look here, const Eigen::Vector2f& place) const {
  if (here.cell != PatchCell::supported || !here.lopsided) return here;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Rotation2Df turn(static_cast<float>(k) * std::numbers::pi_v<float> / 4);
    const Eigen::Vector2f beside = place + turn * Eigen::Vector2f(d_, 0);
    // A voxel of air is evidence enough where readings end.
    if (look(beside, here.height, 1).cell == PatchCell::below) here.cell = PatchCell::below;
  }
  return here;
}

/// A cell's ground, from which places in it are seen, and what is in its middle.
struct Flooded {
  float ground = unknown;
  Look look;
};

/// Not on from ground above the base by more than the headroom, over which too little is read.
std::vector<Flooded> flood(const Readings& readings, float max_step, float headroom) {
  std::vector<Flooded> cells(readings.cells());
  std::size_t start = cells.size();
  float nearest = first_ground_m, height = unknown;
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const float distance = readings.middle(cell).norm();
    if (distance >= nearest) continue;
    const float below = readings.highest_below_base(cell);
    if (std::isnan(below)) continue;
    start = cell;
    nearest = distance;
    height = below;
  }
  // What continues the ground goes before what lies beyond its end.
  std::deque<std::pair<std::size_t, float>> next;
  if (start < cells.size()) next.emplace_back(start, height);
  while (!next.empty()) {
    const auto [cell, from] = next.front();
    next.pop_front();
    Flooded& here = cells[cell];
    if (!std::isnan(here.ground)) continue;
    here.look = readings.look(readings.middle(cell), from);
    const bool continues =
        std::fabs(here.look.height - from) <= max_step && here.look.height <= headroom;  // NaN fails
    here.ground = continues ? here.look.height : from;
    readings.for_each_near(cell, 1, [&, ground = here.ground](std::size_t other) {
      if (!std::isnan(cells[other].ground)) return;
      if (continues)
        next.emplace_front(other, ground);
      else
        next.emplace_back(other, ground);
    });
  }
  return cells;
}

/// m, from the middle of each cell to where the ground ends or a step begins that no slope explains.
std::vector<float> distances_to_ends(const Readings& readings, const std::vector<Flooded>& cells,
                                     const GroundView& view) {
  const auto most =
      static_cast<float>(view.octree().resolution() +
                         std::numbers::sqrt2 * cell_m * std::tan(view.rules().limits.max_slope_rad));
  const auto is_end = [&](std::size_t cell) {
    bool end = false;
    readings.for_each_near(cell, 1, [&](std::size_t other) {
      end = end || std::fabs(cells[other].look.height - cells[cell].look.height) > most;
    });
    return end;
  };
  std::vector<float> distances(cells.size(), static_cast<float>(GroundView::farthest_margin_m));
  std::deque<std::pair<std::size_t, std::size_t>> next;  // a cell, and the end nearest to it
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const bool supported = cells[cell].look.cell == PatchCell::supported;
    if (supported && !is_end(cell)) continue;
    distances[cell] = supported ? 0 : -cell_m / 2;
    next.emplace_back(cell, cell);
  }
  while (!next.empty()) {
    const auto [cell, end] = next.front();
    next.pop_front();
    const float beyond = cells[end].look.cell == PatchCell::supported ? 0 : cell_m / 2;
    readings.for_each_near(cell, 1, [&, end = end](std::size_t other) {
      const float distance = (readings.middle(other) - readings.middle(end)).norm() - beyond;
      if (distance >= distances[other]) return;
      distances[other] = distance;
      next.emplace_back(other, end);
    });
  }
  return distances;
}

void require(const Eigen::Isometry3d& T_map_base, const PatchLayout& layout) {
  require_rigid(T_map_base, "T_map_base");
  const auto refuse = [](const char* what, const char* is, const char* hint) {
    throw Error(Error::Kind::usage, what, is, hint);
  };
  if (layout.points.empty()) refuse("layout.points", "are none", "give some, as PatchLayout::grid() does");
  for (const Eigen::Vector2d& point : layout.points)
    if (!(point.norm() <= farthest_m))
      refuse("layout.points", "has one farther than 5 m", "give nearer ones");
  if (!(layout.max_step_m > 0 && layout.max_step_m <= 1))
    refuse("layout.max_step_m", "must be in (0, 1]", "give the robot's highest step");
  if (!(layout.headroom_m > layout.max_step_m && layout.headroom_m <= 5))
    refuse("layout.headroom_m", "must be above max_step_m and at most 5", "give the robot's height");
}

/// At the base, z along up, x above the base's.
Eigen::Isometry3d yaw_frame(const Eigen::Isometry3d& T_map_base, const Eigen::Vector3d& up) {
  Eigen::Isometry3d T = T_map_base;
  const Eigen::Vector3d z = up.normalized();
  Eigen::Vector3d y = z.cross(T_map_base.linear().col(0));
  if (!(y.norm() > 1e-6)) y = T_map_base.linear().col(1) - z.dot(T_map_base.linear().col(1)) * z;
  y.normalize();
  T.linear() << y.cross(z), y, z;
  return T;
}

void fill_in(const std::vector<Eigen::Vector2d>& points, std::vector<float>& heights) {
  const std::vector<float> known = heights;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isnan(known[i])) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < points.size(); ++k)
      if (const double off = (points[k] - points[i]).squaredNorm(); off < nearest && !std::isnan(known[k])) {
        nearest = off;
        heights[i] = known[k];
      }
  }
}

}  // namespace

PatchLayout PatchLayout::grid(double length_m, double width_m, double cell_m, const Eigen::Vector2d& center) {
  const double nx = std::round(length_m / cell_m), ny = std::round(width_m / cell_m);
  if (!(nx >= 1 && ny >= 1 && nx * ny <= 1e5))
    throw Error(Error::Kind::usage, "cell_m", "does not divide the patch into 1 to 100,000 cells",
                "give another size");
  PatchLayout layout;
  for (double x = 0; x < nx; ++x)
    for (double y = 0; y < ny; ++y)
      layout.points.push_back(center + cell_m * Eigen::Vector2d(x - (nx - 1) / 2, y - (ny - 1) / 2));
  return layout;
}

GroundPatch ground_patch(const GroundView& view, const Eigen::Isometry3d& T_map_base,
                         const PatchLayout& layout) {
  require(T_map_base, layout);
  const Readings readings(view, yaw_frame(T_map_base, view.rules().limits.up), layout);
  const std::vector<Flooded> cells =
      flood(readings, static_cast<float>(layout.max_step_m), static_cast<float>(layout.headroom_m));
  const std::vector<float> to_end = distances_to_ends(readings, cells, view);
  GroundPatch patch;
  for (const Eigen::Vector2d& point : layout.points) {
    const Eigen::Vector2f place = point.cast<float>();
    const std::size_t at = readings.cell_at(place);
    Look look = cells[at].look;
    if ((readings.middle(at) - place).norm() > 1e-3F && !std::isnan(cells[at].ground))
      look = readings.look(place, cells[at].ground);
    look = readings.without_edge(look, place);
    patch.height.push_back(look.height);
    patch.cell.push_back(look.cell);
    patch.slope_rad.push_back(look.slope_rad);
    patch.edge_m.push_back(look.cell == PatchCell::supported ? std::max(0.0F, to_end[at]) : 0);
  }
  if (layout.fill) fill_in(layout.points, patch.height);
  return patch;
}

}  // namespace octosurf
