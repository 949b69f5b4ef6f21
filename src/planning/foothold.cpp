#include "planning/contact_cells.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf {
namespace planning {
namespace {

/// A placed contact, by what it touches.
class Stand {
 public:
  Stand(std::span<const ContactCells* const> cells, const Sole& sole, const Eigen::Vector2d& middle)
      : cells_(cells), sole_(sole), middle_(middle) {}

  bool touches(BitRaster ContactCells::*marks, double margin) const {
    const Ring2 room = this->room(margin);
    return std::ranges::any_of(cells_, [&](const auto* one) { return (one->*marks).touched_by(room); });
  }
  /// Share of its cells that lie on the surface, and how deep the deepest other one lies in it.
  std::array<double, 2> support() const {
    const Ring2 room = this->room(0);
    std::size_t all = 0, off = 0;
    double deepest = cells_.empty() ? depth_in(room, middle_) : 0;
    for (const ContactCells* one : cells_)
      one->outside.for_each_touched(room, [&](const Eigen::Vector2d& cell, bool marked) {
        ++all;
        off += marked;
        if (marked) deepest = std::max(deepest, depth_in(room, cell) + one->outside.edge() / 2);
      });
    return {all == 0 ? 0 : 1 - static_cast<double>(off) / static_cast<double>(all), deepest};
  }
  /// m, to the nearest edge, to a millimetre.
  double margin() const {
    double kept = 0, met = Foothold::farthest_margin_m;
    if (!touches(&ContactCells::outside, met)) return met;
    while (met - kept > 1e-3) {
      const double middle = (kept + met) / 2;
      (touches(&ContactCells::outside, middle) ? met : kept) = middle;
    }
    return kept;
  }

 private:
  /// What it needs with a margin, surface's frame.
  Ring2 room(double margin) const {
    Ring2 ring = sole_.with_margin(margin);
    for (Eigen::Vector2d& p : ring) p = middle_ + sole_.to_surface(p);
    return ring;
  }

  std::span<const ContactCells* const> cells_;
  const Sole& sole_;
  Eigen::Vector2d middle_;
};

/// The first limit that is not met.
std::optional<ContactRefusal> refusal_of(const Surface& surface, const Stand& stand, bool supported,
                                         const ContactLimits& limits) {
  const std::vector<ContactRefusal> of_surface = refusals_of(surface, limits);
  if (!of_surface.empty()) return of_surface.front();
  if (!supported) return ContactRefusal::support;
  if (stand.touches(&ContactCells::outside, limits.edge_margin_m)) return ContactRefusal::margin;
  // With a margin first: obstacles over the contact itself are within it, too.
  const double margin = limits.obstacle_margin_m;
  if (limits.clearance_m > 0 && stand.touches(&ContactCells::obstacles, margin))
    return margin > 0 ? ContactRefusal::obstacle : ContactRefusal::clearance;
  if (limits.unknown_to_m > 0 && stand.touches(&ContactCells::unknown, 0)) return ContactRefusal::unknown;
  return {};
}

}  // namespace

Foothold foothold_on(std::span<const ContactCells* const> cells, const Surface& surface,
                     const ContactShape& shape, const Eigen::Vector3d& at, double yaw_rad,
                     const ContactLimits& limits) {
  const Sole sole = sole_of(shape, surface, yaw_rad, limits.up);
  const Eigen::Vector2d reference = (surface.T_map_surface.inverse() * at).head<2>();
  const Stand stand(cells, sole, reference + sole.to_surface(sole.middle));
  const bool supported = !cells.empty() && !stand.touches(&ContactCells::outside, 0);
  Foothold result;
  result.surface = surface.id;
  result.T_map_contact = surface.T_map_surface * Eigen::Translation3d(reference.x(), reference.y(), 0);
  const Eigen::Vector2d heading = heading_on(surface, yaw_rad, limits.up);
  result.T_map_contact.rotate(
      Eigen::AngleAxisd(std::atan2(heading.y(), heading.x()), Eigen::Vector3d::UnitZ()));
  if (supported) {
    result.supported = 1;
    result.margin_m = stand.margin();
  } else {
    const auto [share, deepest] = stand.support();
    result.supported = share;
    result.margin_m = -deepest;
  }
  result.refused = refusal_of(surface, stand, supported, limits);
  result.accepted = !result.refused;
  return result;
}

}  // namespace planning

Foothold foothold(const Surface& surface, const ContactShape& shape, const Eigen::Vector3d& at,
                  double yaw_rad, const ContactLimits& limits, const OccupancyView* octree,
                  const Snapshot* others) {
  planning::require_sensible(shape, yaw_rad, limits, octree);
  if (!at.allFinite()) throw Error(Error::Kind::usage, "foothold", "the point is not finite");
  const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * at).head<2>();
  const auto within = [&](double margin) { return planning::box_about(uv, 1.01 * (shape.reach() + margin)); };
  const Eigen::AlignedBox2d box = within(std::max(Foothold::farthest_margin_m, limits.edge_margin_m));
  if (!box.intersects(planning::box_of(surface)))
    return planning::foothold_on({}, surface, shape, at, yaw_rad, limits);
  const planning::ContactCells cells(surface, box, within(limits.obstacle_margin_m),
                                     planning::BitRaster::edge_for(surface), limits, octree, others);
  return planning::foothold_on(std::array{&cells}, surface, shape, at, yaw_rad, limits);
}

}  // namespace octosurf
