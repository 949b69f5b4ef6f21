#include "expansion/expansion.hpp"

#include "geometry/breadth_first.hpp"
#include "surfaces/criteria/joining.hpp"
#include "surfaces/criteria/obstructed.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace octosurf::expansion {
namespace {

constexpr int adjacent_voxels = 2;  // flood: a neighbour, or one voxel left out
constexpr double takeover = 0.5;    // a point is reassigned if it fits here twice as well
constexpr int contacts_to_merge = 6;

}  // namespace

Expansion::Expansion(surfaces::Ledger& ledger)
    : ledger_(ledger),
      h_cells_(std::max(
          1, static_cast<int>(ledger.parameters.max_hole_size() / ledger.parameters.occupancy.resolution))),
      robust_(ledger.parameters.aligned()),
      cos_smooth_(static_cast<float>(std::cos(ledger.parameters.detection.smoothness_angle))) {}

std::optional<double> Expansion::misfit(Index i, const surfaces::SurfaceModel& surface) {
  const occupancy::VoxelPoint& p = ledger_.window[i];
  const double tolerance = ledger_.noise.tolerance(p, surface.plane());
  const double ratio = std::fabs(surface.distance(p.position)) / tolerance;
  if (ratio > 1) return {};
  const Eigen::Vector3f n = surface.plane().normal.cast<float>();
  if (n.dot(p.view) < -0.1F)
    return {};  // seen from behind: 6° beyond a right angle, as the stored view is exact to 4°
  const surfaces::LocalPlane& local = ledger_.normals.at(i);
  const bool sure = local.known && local.flat;
  if (sure ? local.normal.dot(n) < cos_smooth_ : ratio > 0.5) return {};
  return ratio;
}

bool Expansion::reaches(Index i, const surfaces::SurfaceModel& surface, int cells) {
  const occupancy::VoxelPoint& p = ledger_.window[i];
  const geometry::PlaneCell cell = surface.cell_of(p.position);
  const std::optional<geometry::PlaneCell> nearest = surface.nearest(cell, cells);
  if (!nearest) return false;
  if (!robust_ || (std::abs(nearest->u - cell.u) <= 1 && std::abs(nearest->v - cell.v) <= 1)) return true;
  return !surfaces::obstructed(ledger_, surface.plane(), p.position.cast<double>(),
                               surface.centre_of(*nearest), ledger_.noise.tolerance(p, surface.plane()));
}

surfaces::SurfaceModel* Expansion::best_surface(Index i, Reach reach) {
  const occupancy::VoxelPoint& p = ledger_.window[i];
  surfaces::SurfaceModel* best = nullptr;
  double best_ratio = 2;
  bool best_touches = false;  // a surface that the point touches is preferred to one across a gap
  for (const SurfaceId id :
       ledger_.surfaces.near(p.key, reach == Reach::within_h ? h_cells_ : adjacent_voxels)) {
    surfaces::SurfaceModel& surface = *ledger_.find(id);
    const std::optional<double> ratio = misfit(i, surface);
    if (!ratio) continue;
    const geometry::PlaneCell cell = surface.cell_of(p.position);
    const bool touches = !robust_ || surface.near(cell, 1);
    if (best != nullptr &&
        std::tuple(touches, -*ratio, surface.size()) <= std::tuple(best_touches, -best_ratio, best->size()))
      continue;
    const bool reached = reach == Reach::inside     ? surface.covers(cell)
                         : reach == Reach::within_h ? reaches(i, surface, h_cells_)
                                                    : reaches(i, surface, adjacent_voxels);
    if (!reached) continue;
    best = &surface;
    best_ratio = *ratio;
    best_touches = touches;
  }
  return best;
}

std::vector<Expansion::Index> Expansion::add_inliers(std::span<const Index> points) {
  std::vector<Index> left;
  for (const Index i : points) {
    if (ledger_.window[i].surface != 0) continue;
    if (surfaces::SurfaceModel* surface = best_surface(i, Reach::inside))
      ledger_.give(i, *surface);
    else
      left.push_back(i);
  }
  return left;
}

void Expansion::expand(std::span<const Index> points) {
  for (const Index i : points) {
    if (ledger_.window[i].surface != 0) continue;
    if (surfaces::SurfaceModel* surface = best_surface(i, Reach::within_h)) {
      ledger_.give(i, *surface);
      frontier_.push_back(i);
    }
  }
  flood();
  merge_contacts();
}

void Expansion::grow(std::span<const SurfaceId> surfaces) {
  for (const SurfaceId id : surfaces)
    if (const surfaces::SurfaceModel* surface = ledger_.find(id))
      for (const surfaces::Inlier& inlier : surface->sorted_inliers())
        frontier_.push_back(ledger_.window.find(inlier.key));
  flood();
  merge_contacts();
}

void Expansion::adopt(std::span<const SurfaceId> surfaces) {
  adopted_.insert(surfaces.begin(), surfaces.end());
  grow(surfaces);
}

void Expansion::rejoin() {
  for (const SurfaceId id : ledger_.changes.touched()) {
    const surfaces::SurfaceModel& surface = *ledger_.find(id);
    if (surface.recently_checked()) continue;
    std::vector<geometry::VoxelKey> rim;
    surface.for_each_inlier([&](const surfaces::Inlier& inlier) {
      if (!surface.surrounded(surface.cell_of(inlier.position))) rim.push_back(inlier.key);
    });
    std::sort(rim.begin(), rim.end());
    for (const geometry::VoxelKey key : rim) note_contacts(ledger_.window.find(key));
  }
  merge_contacts();
}

void Expansion::flood() {
  geometry::breadth_first(frontier_, [&](Index from) {
    surfaces::SurfaceModel* surface = ledger_.find(ledger_.window[from].surface);
    if (surface == nullptr) return;
    ledger_.window.for_each_near(ledger_.window[from].key, adjacent_voxels, [&](Index i) {
      if (ledger_.window.columns().surface[i] != surface->id()) visit_neighbour(i, *surface);
    });
  });
  for (const Index i : frontier_) note_contacts(i);
  frontier_.clear();
}

/// Surfaces that this new inlier brought within h of its own, on one plane.
void Expansion::note_contacts(Index i) {
  const occupancy::VoxelPoint& p = ledger_.window[i];
  const surfaces::SurfaceModel* own = ledger_.find(p.surface);
  if (own == nullptr || own->surrounded(own->cell_of(p.position))) return;
  for (const SurfaceId id : ledger_.surfaces.near(p.key, h_cells_)) {
    if (id == p.surface) continue;
    const surfaces::SurfaceModel& other = *ledger_.find(id);
    if (other.plane().normal.dot(own->plane().normal) < cos_smooth_ ||
        std::fabs(other.distance(p.position)) > ledger_.noise.tolerance(p, other.plane()) ||
        !other.near(other.cell_of(p.position), h_cells_))
      continue;
    Contact& contact = contacts_[std::minmax(p.surface, id)];
    if (!reaches(i, other, h_cells_)) {
      ++contact.obstructed;
      continue;
    }
    ++contact.points;
    contact.touching += other.near(other.cell_of(p.position), 1);
    contact.place += p.position.cast<double>();
  }
}

void Expansion::visit_neighbour(Index i, surfaces::SurfaceModel& surface) {
  const SurfaceId owner = ledger_.window[i].surface;
  const std::optional<double> ratio = misfit(i, surface);
  if (!ratio) return;
  if (owner == 0) {
    surfaces::SurfaceModel* best = best_surface(i, Reach::adjacent);
    if (best == nullptr) return;
    ledger_.give(i, *best);
    frontier_.push_back(i);
    return;
  }
  surfaces::SurfaceModel& other = *ledger_.find(owner);
  const double other_ratio = std::fabs(other.distance(ledger_.window[i].position)) /
                             ledger_.noise.tolerance(ledger_.window[i], other.plane());
  if (*ratio < takeover * other_ratio && other_ratio > 0.2) {
    ledger_.reassign(i, surface);
    frontier_.push_back(i);
  }
}

void Expansion::merge_contacts() {
  for (const auto& [pair, contact] : contacts_) {
    surfaces::SurfaceModel* a = ledger_.find(pair.first);
    surfaces::SurfaceModel* b = ledger_.find(pair.second);
    if (contact.points < std::max(contacts_to_merge, contact.obstructed) || a == nullptr || b == nullptr)
      continue;
    const double width = std::sqrt(static_cast<double>(std::min(a->size(), b->size())));
    const bool one = surfaces::coplanar(*a, *b, contact.place / contact.points, ledger_.noise) ||
                     (contact.touching > 2 * width && surfaces::joint_plane_fits(*a, *b, ledger_.noise));
    if (!one) continue;
    // The larger keeps its id, the older one on a tie; but what another map had found joins what was here.
    const bool a_came = adopted_.contains(a->id()), b_came = adopted_.contains(b->id());
    const bool a_keeps = a_came == b_came ? a->size() >= b->size() : b_came;
    a_keeps ? ledger_.merge(*a, *b) : ledger_.merge(*b, *a);
  }
  contacts_.clear();
}

}  // namespace octosurf::expansion
