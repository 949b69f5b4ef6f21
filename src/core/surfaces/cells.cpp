#include "surfaces/cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace octosurf::surfaces {
namespace {

using geometry::VoxelKey;
using occupancy::VoxelPoint;

int level_of(const Parameters& parameters) {
  const double widest =
      std::min(2 * parameters.surfaces.min_surface_width / 3, parameters.max_hole_size() / 4) * (1 + 1e-9);
  int level = 0;
  while (std::ldexp(parameters.occupancy.resolution, level + 1) <= widest) ++level;
  return level;
}

/// As for an octree of cells.
Parameters parameters_of(Parameters parameters, int level) {
  const double n = std::ldexp(parameters.min_surface_points(), -2 * level);  // of the same area
  parameters.detection.min_surface_points = std::max(3, static_cast<int>(std::ceil(n)));
  parameters.surfaces.max_hole_size = parameters.max_hole_size();
  parameters.occupancy.resolution = std::ldexp(parameters.occupancy.resolution, level);
  return parameters;
}

}  // namespace

Cells::Cells(const MapView& voxels) : voxels_(voxels) {
  if (const int level = level_of(voxels.parameters); level > 0) coarse_.emplace(voxels, *this, level);
}

Cells::Coarse::Coarse(const MapView& v, const Cells& cells, int level)
    : voxels(v),
      parameters(parameters_of(v.parameters, level)),
      grid(parameters.occupancy.resolution),
      window([this](VoxelKey corner, std::vector<VoxelPoint>& points) { read_block(corner, points); }),
      neighbours(window, grid.resolution()),
      map{parameters, v.octree,   grid,  v.surfaces,    v.cylinders, v.noise,
          window,     neighbours, cells, v.for_threads, level} {}

void Cells::Coarse::read_block(VoxelKey corner, std::vector<VoxelPoint>& points) {
  constexpr unsigned cells = 512;
  const auto cell_at = [&](unsigned place) {
    return VoxelKey{static_cast<std::uint16_t>(corner.x + (place & 7)),
                    static_cast<std::uint16_t>(corner.y + (place >> 3 & 7)),
                    static_cast<std::uint16_t>(corner.z + (place >> 6))};
  };
  if (!(map.cell_of(map.first_voxel_of(corner)) == corner)) return;  // beyond the last voxel
  std::array<std::uint32_t, cells + 1> ends{};
  in_block.clear();
  voxels.window.for_each_in(map.first_voxel_of(corner), map.last_voxel_of(cell_at(cells - 1)),
                            [&](PointId i) {
                              const VoxelKey cell = map.cell_of(voxels.window[i].key);
                              const unsigned place = (cell.x & 7U) | (cell.y & 7U) << 3 | (cell.z & 7U) << 6;
                              in_block.emplace_back(place, i);
                              ++ends[place + 1];
                            });
  const auto before = static_cast<std::uint32_t>(members.size());
  ends[0] = before;
  for (unsigned k = 0; k < cells; ++k) ends[k + 1] += ends[k];
  members.resize(before + in_block.size());
  for (const auto& [place, i] : in_block) members[ends[place]++] = i;  // from the begin of each to its end
  cell_of.resize(voxels.window.size(), PointId::none);
  std::uint32_t from = before;
  for (unsigned place = 0; place < cells; from = ends[place++]) {
    if (ends[place] == from) continue;
    const std::span<PointId> its = std::span(members).subspan(from, ends[place] - from);
    for (const PointId i : its) cell_of[index_of(i)] = PointId{static_cast<std::uint32_t>(first.size() - 1)};
    points.push_back(represent(its, cell_at(place)));
    first.push_back(ends[place]);
  }
}

SurfaceId Cells::Coarse::most_common_surface(std::span<const PointId> its) const {
  const auto surface_of = [this](PointId i) { return voxels.window[i].surface; };
  const SurfaceId first_one = surface_of(its[0]);
  if (std::all_of(its.begin(), its.end(), [&](PointId i) { return surface_of(i) == first_one; }))
    return first_one;
  std::pair<std::ptrdiff_t, SurfaceId> most;  // minus its votes
  for (const PointId i : its) {
    const SurfaceId id = surface_of(i);
    most = std::min(most, std::pair(-std::count_if(its.begin(), its.end(),
                                                   [&](PointId j) { return surface_of(j) == id; }),
                                    id));
  }
  return most.second;
}

VoxelPoint Cells::Coarse::represent(std::span<PointId> its, VoxelKey cell) const {
  const SurfaceId surface = most_common_surface(its);
  const auto is_of_it = [&](PointId i) { return voxels.window[i].surface == surface; };
  std::sort(its.begin(), its.end());  // sums do not depend on what was in front before
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float count = 0;
  for (const PointId i : its) {
    if (!is_of_it(i)) continue;
    sum += voxels.window[i].position;
    ++count;
  }
  float least = std::numeric_limits<float>::infinity();
  std::size_t nearest = 0;
  for (std::size_t k = 0; k < its.size(); ++k) {
    if (!is_of_it(its[k])) continue;
    const float off = (count * voxels.window[its[k]].position - sum).squaredNorm();
    if (std::pair(off, its[k]) > std::pair(least, its[nearest])) continue;
    least = off;
    nearest = k;
  }
  std::swap(its[0], its[nearest]);
  VoxelPoint point = voxels.window[its[0]];
  point.key = cell;
  return point;
}

std::vector<PointId> Cells::of(std::span<const PointId> points) const {
  std::vector<PointId> cells;
  cells.reserve(points.size());
  for (const PointId i : points) cells.push_back(of(i));
  map().window.put_in_order(cells);
  return cells;
}

std::size_t Cells::pending_in(PointId cell) const {
  std::size_t pending = 0;
  for_each_voxel(cell, [&](PointId i) { pending += voxels_.is_pending(i); });
  return pending;
}

std::vector<PointId> Cells::pending_in(std::span<const PointId> cells) const {
  std::vector<PointId> pending;
  for (const PointId cell : cells)
    for_each_voxel(cell, [&](PointId i) {
      if (voxels_.is_pending(i)) pending.push_back(i);
    });
  voxels_.window.put_in_order(pending);
  return pending;
}

void Cells::reassigned(PointId voxel) {
  if (!coarse_ || index_of(voxel) >= coarse_->cell_of.size()) return;
  const PointId cell = coarse_->cell_of[index_of(voxel)];
  if (cell == PointId::none) return;
  const std::uint32_t from = coarse_->first[index_of(cell)], to = coarse_->first[index_of(cell) + 1];
  coarse_->window.replace(cell, coarse_->represent(std::span(coarse_->members).subspan(from, to - from),
                                                   coarse_->window[cell].key));
}

ThreadViews::~ThreadViews() = default;

void ThreadViews::prepare(int threads) const {
  if (others_.size() + 1 < static_cast<std::size_t>(threads))
    others_.resize(static_cast<std::size_t>(threads - 1));
}

const MapView& ThreadViews::of(int thread) const {
  if (thread == 0) return own_;
  auto& [view, applied] = others_[static_cast<std::size_t>(thread - 1)];
  if (view == nullptr) {
    view = std::make_unique<LoadedView>(own_);
    applied = assigned_.size();
  }
  for (; applied < assigned_.size(); ++applied)
    if (const auto& [key, surface] = assigned_[applied]; view->window.is_loaded(key))
      view->assign(view->window.find(key), surface);
  return *view;
}

}  // namespace octosurf::surfaces
