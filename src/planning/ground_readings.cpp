#include "planning/ground_readings.hpp"

#include "geometry/lanes.hpp"
#include "geometry/morton.hpp"
#include "geometry/voxel_grid.hpp"
#include "occupancy/voxel_payload.hpp"
#include "planning/column.hpp"
#include "planning/rings.hpp"
#include "sensing/reading_model.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace octosurf::planning {
namespace {

constexpr float margin_m = 0.1F;  ///< about the points, searched for edges
constexpr double deepest_m = 2;   ///< below the base, searched for ground
/// Voxels: a pending reading nearer to a plane may be of it.
constexpr float beside_plane = 1.5;
/// Share of the search radius: the least offset of the readings' mean that is not chance.
/// Half a disc's mean lies at 4/(3 π) = 0.42.
constexpr float lopsided = 0.3F;
/// m, of a reading to its plane: farther ones are not moved onto it.
constexpr auto farthest_moved = static_cast<float>(sensing::ReadingModel::clutter_depth / 2);

using geometry::Lanes;
constexpr std::size_t lanes = 4;

constexpr float none = -std::numeric_limits<float>::infinity();

}  // namespace

/// A level plane beside a place, by its readings.
struct GroundReadings::LevelPlane {
  std::uint32_t plane = 0;
  float height = 0, nearest = 0;                    // over the place; squared distance of the nearest reading
  Eigen::Vector3f aside = Eigen::Vector3f::Zero();  // sum of their offsets, and their number
  float off_middle() const { return aside.hnormalized().norm(); }
};

GroundReadings::GroundReadings(const GroundView& view, const Eigen::Isometry3d& T_map_patch,
                               const PatchLayout& layout, float highest_ground)
    : view_(view),
      layout_(layout),
      T_map_patch_(T_map_patch),
      T_patch_map_(T_map_patch.inverse().cast<float>()),
      d_(static_cast<float>(view.octree().resolution())),
      covered_(d_ / std::numbers::sqrt2_v<float>),
      bridged_(std::max(covered_, (d_ + static_cast<float>(view.widest_unseen_m())) / 2)),
      reach_(std::max(bridged_, 0.4999F * cell_m)) {  // in the middle of a cell its own readings suffice
  const GroundPlane any{0, d_, 0, {}};
  planes_[0].depth = static_cast<float>(any.depth()) / d_;
  aside_of_ = any.aside();
  per_part_ = T_patch_map_.linear() * (d_ / 256);
  for (unsigned i = 0; i < 64; ++i)
    for (unsigned axis = 0; axis < 3; ++axis)
      in_cube_[axis][i] = 256 * static_cast<float>(geometry::compact_bits(i >> axis));
  Eigen::AlignedBox2f box(Eigen::Vector2f::Zero());
  for (const Eigen::Vector2d& point : layout.points) box.extend(point.cast<float>());
  low_ = cell_m * ((box.min().array() - margin_m) / cell_m).floor();
  size_ = ((box.max().array() + margin_m - low_.array()) / cell_m).floor().cast<int>() + 1;
  const Eigen::Vector2f high = low_ + cell_m * size_.cast<float>().matrix();
  const Eigen::AlignedBox3d part =
      box_over(T_map_patch, {low_.cast<double>(), high.cast<double>()}, -deepest_m,
               highest_ground + layout.max_step_m + layout.headroom_m);
  first_.assign(static_cast<std::size_t>(size_.prod()) + 1, 0);
  readings_.reserve(1 << 13);
  cell_of_.reserve(1 << 13);
  occupancy::for_each_cube(
      view.octree(), part, [this](const occupancy::Cube& cube) { return add(cube), true; }, true);
  sort_by_cell();
}

/// Of a surface whose plane is not at hand.
std::uint32_t GroundReadings::find_plane(SurfaceId id) {
  const auto at = std::lower_bound(known_.begin(), known_.end(), std::pair(id, std::uint32_t{0}));
  if (at != known_.end() && at->first == id) return at->second;
  std::uint32_t index = 0;
  if (const Surface* surface = view_.mapped().find(id)) {
    const Plane& plane = surface->plane;
    PlaneOver over;
    over.normal = T_patch_map_.linear() * plane.normal.cast<float>();
    over.offset = static_cast<float>(-plane.signed_distance(T_map_patch_.translation()));
    over.slope_rad = std::acos(std::clamp(over.normal.z(), -1.0F, 1.0F));
    over.id = id;
    over.depth = static_cast<float>(GroundPlane{id, d_, surface->rms_m, {}}.depth()) / d_;
    over.level = over.slope_rad <= view_.rules().limits.max_slope_rad;
    if (over.level)
      over.height << -over.normal.x() / over.normal.z(), -over.normal.y() / over.normal.z(),
          over.offset / over.normal.z();
    index = static_cast<std::uint32_t>(planes_.size());
    planes_.push_back(over);
  }
  known_.insert(at, {id, index});
  return index;
}

void GroundReadings::add(const occupancy::Cube& cube) {
  const geometry::VoxelGrid grid(view_.octree().resolution());
  const Eigen::Vector3d low = grid.corner_of({cube.corner[0], cube.corner[1], cube.corner[2]});
  const Eigen::Vector3f corner = T_patch_map_.linear() * (low - T_map_patch_.translation()).cast<float>();
  // A larger cube, imported from an OctoMap, holds no readings: it counts as 4³ large voxels.
  const auto scale = static_cast<float>(1 << (cube.level - 2));
  const Eigen::Vector2f middle = (corner + scale * 512 * per_part_.rowwise().sum()).head<2>();
  const float reach = 3.5F * d_ * scale;  // half a cube's diagonal
  if (((middle - low_).array() < -reach).any() ||
      ((middle - low_).array() > reach + cell_m * size_.cast<float>()).any())
    return;
  std::array<std::array<float, 64>, 3> part;  // in 256 parts of a voxel's edge, from the cube's corner
  std::array<std::uint32_t, 64> plane;
  std::size_t count = 0;
  const occupancy::VoxelPayload* payload = cube.payloads;
  for (std::uint64_t m = cube.occupied; m != 0; m &= m - 1, ++count) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    Eigen::Array3f in_voxel = Eigen::Array3f::Constant(128);
    plane[count] = 0;
    if ((cube.points >> i & 1) != 0) {
      in_voxel = Eigen::Array3i(payload->offset_x, payload->offset_y, payload->offset_z).cast<float>() + 0.5F;
      plane[count] = plane_of(cube.numbers->id(payload->surface));
      ++payload;
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      part[axis][count] = in_cube_[axis][i] + in_voxel[static_cast<Eigen::Index>(axis)];
  }
  for (std::size_t i = count; i % lanes != 0; ++i) plane[i] = 0, part[0][i] = part[1][i] = part[2][i] = 0;
  const auto along = [&](Eigen::Index row, std::size_t i) {
    Lanes sum = Lanes{} + corner[row];
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      sum += scale * per_part_(row, axis) * geometry::load_lanes(&part[static_cast<std::size_t>(axis)][i]);
    return sum;
  };
  for (std::size_t i = 0; i < count; i += lanes) {
    Lanes normal_x{}, normal_y{}, normal_z{}, offset{};
    for (std::size_t k = 0; k < lanes; ++k) {
      const PlaneOver& over = planes_[plane[i + k]];
      normal_x[k] = over.normal.x(), normal_y[k] = over.normal.y(), normal_z[k] = over.normal.z();
      offset[k] = over.offset;
    }
    Lanes x = along(0, i), y = along(1, i), z = along(2, i);
    Lanes off = normal_x * x + normal_y * y + normal_z * z - offset;
    off = geometry::where((off <= farthest_moved) & (off >= -farthest_moved), off);
    x -= off * normal_x, y -= off * normal_y, z -= off * normal_z;
    const Lanes at_x = (x - low_.x()) * (1 / cell_m), at_y = (y - low_.y()) * (1 / cell_m);
    const geometry::LaneMask row = __builtin_convertvector(at_x, geometry::LaneMask),
                             column = __builtin_convertvector(at_y, geometry::LaneMask),
                             inside = (at_x >= 0) & (at_y >= 0) & (row < size_.x()) & (column < size_.y()),
                             cell = row * size_.y() + column;
    for (std::size_t k = 0; k < std::min(lanes, count - i); ++k) {
      if (inside[k] == 0) continue;
      readings_.push_back({{x[k], y[k]}, z[k], plane[i + k]});
      cell_of_.push_back(static_cast<std::uint32_t>(cell[k]));
      ++first_[static_cast<std::size_t>(cell[k]) + 1];
    }
  }
}

void GroundReadings::sort_by_cell() {
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  std::vector<Reading> sorted(readings_.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < readings_.size(); ++i) sorted[next[cell_of_[i]]++] = readings_[i];
  readings_ = std::move(sorted);
}

float GroundReadings::highest_below_base(std::size_t cell) const {
  float surface = no_height, reading = no_height;
  for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
    const Reading& one = readings_[i];
    if (one.height > 0) continue;
    float& highest = planes_[one.plane].level ? surface : reading;
    if (!(one.height <= highest)) highest = one.height;  // NaN fails
  }
  return std::isnan(surface) ? reading : surface;
}

bool GroundReadings::is_free(const Eigen::Vector2f& place, float height, bool or_occupied) const {
  const Eigen::Vector3d p = T_map_patch_ * Eigen::Vector3f(place.x(), place.y(), height).cast<double>();
  const OccupancyView::State state = view_.octree().at(p).state;
  return state == OccupancyView::State::free || (or_occupied && state == OccupancyView::State::occupied);
}

/// Free, and free below it to a depth in voxels, or to something else two voxels lower.
bool GroundReadings::is_open(const Eigen::Vector2f& place, float height, float depth) const {
  for (float below = 0; below < depth; ++below)
    if (!is_free(place, height - below * d_, below > 1)) return false;
  return is_free(place, height - depth * d_, true);
}

/// What was read around a place, by its height over the ground. It is filled and read inline: in memory that
/// others may see, it takes a third more time.
struct GroundReadings::Around {
  float ground, step, headroom;
  std::array<LevelPlane, 8> planes{};
  std::size_t count = 0;
  float hanging = none, lower = none;  // what covers the place, more than a step above and below
  float topmost = none, steep = none;  // within a step: pending, and of steep surfaces

  /// Of what covers the place.
  [[gnu::always_inline]] void note(float height, float& within_step) {
    if (height < ground - step)
      lower = std::max(lower, height);
    else if (height <= ground + step)
      within_step = std::max(within_step, height);
    else if (height <= ground + headroom)
      hanging = std::max(hanging, height);
  }
  /// That of a level surface; null: of another one, or of too many.
  [[gnu::always_inline]] LevelPlane* plane_of(std::uint32_t plane, const PlaneOver& over,
                                              const Eigen::Vector2f& place) {
    std::size_t k = 0;
    while (k < count && planes[k].plane != plane) ++k;
    if (k == count) {
      if (!over.level || count == planes.size()) return nullptr;
      planes[count++] = {plane, over.height.dot(place.homogeneous()), std::numeric_limits<float>::max()};
    }
    return &planes[k];
  }
};

[[gnu::always_inline]] inline GroundReadings::Around GroundReadings::around(const Eigen::Vector2f& place,
                                                                            float ground) const {
  Around found{ground, static_cast<float>(layout_.max_step_m), static_cast<float>(layout_.headroom_m)};
  const Eigen::Array2i from = array_at(place.array() - reach_).max(0),
                       to = array_at(place.array() + reach_).min(size_ - 1);
  const float within = reach_ * reach_, covered = covered_ * covered_;
  for (int x = from.x(); x <= to.x(); ++x) {
    const std::uint32_t end = first_[index({x, to.y()}) + 1];
    for (std::uint32_t i = first_[index({x, from.y()})]; i < end; ++i) {
      const Reading& one = readings_[i];
      const Eigen::Vector2f off = one.place - place;
      const float distance = off.squaredNorm();
      if (distance > within) continue;
      if (LevelPlane* const level = found.plane_of(one.plane, planes_[one.plane], place)) {
        level->nearest = std::min(level->nearest, distance);
        level->aside += off.homogeneous();
      } else if (distance <= covered) {
        // A riser is seen from above only where its step's planes are not.
        found.note(one.height, one.plane == 0 ? found.topmost : found.steep);
      }
    }
  }
  for (const LevelPlane& level : std::span(found.planes).first(found.count))
    if (std::fabs(level.height - ground) > found.step && level.nearest <= covered_ * covered_) {
      float none_within = none;
      found.note(level.height, none_within);
    }
  return found;
}

/// The highest level plane within a step whose readings lie all around; else, as at the edge of a step, that
/// of the nearest reading; null: none within half the widest gap.
[[gnu::always_inline]] inline const GroundReadings::LevelPlane* GroundReadings::ground_of(
    const Around& found) const {
  const auto is_around = [this](const LevelPlane& p) {
    return p.nearest <= covered_ * covered_ && p.off_middle() <= lopsided * reach_;
  };
  const LevelPlane* best = nullptr;
  for (const LevelPlane& one : std::span(found.planes).first(found.count)) {
    if (std::fabs(one.height - found.ground) > found.step || one.nearest > bridged_ * bridged_) continue;
    const bool around = is_around(one);
    if (best == nullptr || (around != is_around(*best) ? around
                            : around                   ? one.height > best->height
                                                       : one.nearest < best->nearest))
      best = &one;
  }
  return best;
}

Look GroundReadings::look(const Eigen::Vector2f& place, float ground, std::optional<float> depth) const {
  const Around found = around(place, ground);
  const LevelPlane* const best = ground_of(found);
  const float on_plane = best != nullptr ? best->height : none;
  const float to_depth = depth.value_or(planes_[best != nullptr ? best->plane : 0].depth);
  if (found.hanging > none) return {PatchCell::occupied, found.hanging};
  if (found.topmost > on_plane + beside_plane * d_) return {PatchCell::occupied, found.topmost};
  if (best != nullptr && (best->nearest <= covered_ * covered_ || !is_open(place, on_plane, to_depth)))
    return {PatchCell::supported,
            on_plane,
            planes_[best->plane].slope_rad,
            planes_[best->plane].id,
            best->nearest > covered_ * covered_,
            best->off_middle() > lopsided * reach_};
  if (found.steep > none) return {PatchCell::occupied, found.steep};
  const float level = best != nullptr ? on_plane : ground;
  if (found.lower > none) return is_free(place, level) ? Look{PatchCell::below, found.lower} : Look{};
  return is_open(place, level, to_depth) ? Look{PatchCell::below} : Look{};
}

Look GroundReadings::without_edge(Look here, const Eigen::Vector2f& place) const {
  if (here.cell != PatchCell::supported) return here;
  const auto in_map = [&](const Eigen::Vector2f& at) -> Eigen::Vector3d {
    return T_map_patch_ * Eigen::Vector3f(at.x(), at.y(), here.height).cast<double>();
  };
  if (here.sparse && view_.ground_within(here.surface, in_map(place)) == Ground::open)
    here.cell = PatchCell::below;
  for (int k = 0; k < 8 && here.lopsided && here.cell == PatchCell::supported; ++k) {
    const Eigen::Vector2f aside =
        Eigen::Rotation2Df(static_cast<float>(k) * std::numbers::pi_v<float> / 4) * Eigen::Vector2f(d_, 0);
    // Without air a voxel below there is no need to look closer.
    if (look(place + aside, here.height, 1).cell != PatchCell::below) continue;
    const auto within = view_.ground_within(here.surface, in_map(place + aside));
    bool open = within == Ground::open;
    // Beyond the ground, along free places to one that is open, as a slanted ray goes.
    Eigen::Vector2f at = place + aside;
    for (int i = 0; within != Ground::supported && !open && i <= aside_of_ && is_free(at, here.height);
         ++i, at += aside)
      open = view_.ground_at(here.surface, in_map(at)) == Ground::open;
    if (open) here.cell = PatchCell::below;
  }
  return here;
}

}  // namespace octosurf::planning
