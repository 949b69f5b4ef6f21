#include "planning/rings.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>
#include <variant>

#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

/// A result for each surface, made when it is first read; others may be made meanwhile.
template <class T>
class MadeOnce {
 public:
  template <class Make>
  const T& get(SurfaceId id, const Make& make) {
    std::shared_ptr<One> one;
    {
      const std::lock_guard lock(mutex_);
      std::shared_ptr<One>& entry = all_[id];
      if (!entry) entry = std::make_shared<One>();
      one = entry;
    }
    std::call_once(one->once, [&] { one->made = make(); });
    return one->made;
  }

 private:
  struct One {
    std::once_flag once;
    T made;
  };
  std::mutex mutex_;
  std::map<SurfaceId, std::shared_ptr<One>> all_;
};

double widest_unseen(const GroundRules& rules) {
  return rules.widest_unseen_m ? *rules.widest_unseen_m : widest_unseen_of(rules.foot);
}

}  // namespace

struct GroundView::Solids : MadeOnce<GroundedSurface> {};
struct GroundView::Outlines : MadeOnce<SurfacePtr> {};

GroundRules GroundRules::of(const Robot& robot, double resolution) {
  GroundRules rules;
  std::visit([&rules](const auto& kind) { rules.foot = kind.foot, rules.limits = kind.contact; }, robot);
  rules.limits.clearance_m = std::visit([](const auto& kind) { return kind.body.to_m; }, robot);
  rules.limits.edge_margin_m = std::max(rules.limits.edge_margin_m, resolution);
  rules.limits.obstacle_margin_m = std::max(rules.limits.obstacle_margin_m, resolution);
  return rules;
}

GroundView::GroundView(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree,
                       const GroundRules& rules)
    : snapshot_(std::move(snapshot)),
      octree_(std::move(octree)),
      rules_(rules),
      solids_(std::make_shared<Solids>()),
      supported_(std::make_shared<Outlines>()) {
  if (octree_.resolution() <= 0)
    throw Error(Error::Kind::usage, "ground", "cannot be known without an octree", "give the map's");
}

GroundView GroundView::by(const GroundRules& rules) const {
  GroundView other(snapshot_, octree_, rules);
  if (rules.as_mapped == rules_.as_mapped && widest_unseen(rules) == widest_unseen(rules_))
    other.solids_ = solids_;
  return other;
}

const GroundedSurface& GroundView::solid(SurfaceId id) const {
  const auto surface =
      std::lower_bound(snapshot_->surfaces.begin(), snapshot_->surfaces.end(), id,
                       [](const SurfacePtr& one, SurfaceId wanted) { return one->id < wanted; });
  if (surface == snapshot_->surfaces.end() || (*surface)->id != id)
    throw Error(Error::Kind::data, "surface " + std::to_string(id), "is not in the map");
  return solids_->get(id, [&] {
    return rules_.as_mapped ? GroundedSurface{*surface, {}}
                            : find_gaps(**surface, octree_, widest_unseen(rules_));
  });
}

SurfacePtr GroundView::supported(SurfaceId id) const {
  return supported_->get(id, [&] {
    const Surface& surface = *solid(id).surface;
    ContactLimits limits = rules_.limits;
    limits.frontier_margin_m = 0;  // needs label_edges(), which needs the map
    if (slope_rad(surface, limits.up) > limits.max_slope_rad)
      limits.clearance_m = limits.obstacle_margin_m = 0;
    limits.max_slope_rad = std::numbers::pi;
    constexpr double point = 1e-6;  // m, a disc's radius
    return planning::with_outline(surface, contact_region(surface, ContactShape::disc(point), {}, limits,
                                                          &octree_, nullptr, snapshot_.get())
                                               .polygons);
  });
}

std::shared_ptr<const Snapshot> GroundView::solid() const {
  auto all = std::make_shared<Snapshot>(*snapshot_);
  for (SurfacePtr& surface : all->surfaces) surface = solid(surface->id).surface;
  return all;
}

std::shared_ptr<const Snapshot> GroundView::supported() const {
  auto all = std::make_shared<Snapshot>(*snapshot_);
  for (SurfacePtr& surface : all->surfaces) surface = supported(surface->id);
  return all;
}

std::map<SurfaceId, std::vector<Gap>> GroundView::gaps() const {
  std::map<SurfaceId, std::vector<Gap>> all;
  for (const SurfacePtr& surface : snapshot_->surfaces)
    if (const std::vector<Gap>& gaps = solid(surface->id).gaps; !gaps.empty()) all[surface->id] = gaps;
  return all;
}

ContactRegion GroundView::region(SurfaceId id, std::optional<double> yaw_rad,
                                 const std::vector<PolygonEdges>* edges) const {
  return contact_region(*solid(id).surface, rules_.foot, yaw_rad, rules_.limits, &octree_, edges,
                        snapshot_.get());
}

Foothold GroundView::foothold(SurfaceId id, const Eigen::Vector3d& at, double yaw_rad,
                              const std::vector<PolygonEdges>* edges) const {
  return octosurf::foothold(*solid(id).surface, rules_.foot, at, yaw_rad, rules_.limits, &octree_, edges,
                            snapshot_.get());
}

}  // namespace octosurf
