#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/linestring.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <cmath>
#include <map>
#include <utility>

#include <octosurf/history.hpp>

namespace octosurf {
namespace {

namespace bg = boost::geometry;

constexpr double step_m = 1e-4;  // of a vertex' coordinates

/// Douglas and Peucker 1973 on the ring, closed for that and opened again; as it is if less than a triangle
/// would be left.
Ring2 coarse(const Ring2& ring, double tolerance) {
  using Point = bg::model::d2::point_xy<double>;
  bg::model::linestring<Point> line, kept;
  for (const Eigen::Vector2d& at : ring) line.emplace_back(at.x(), at.y());
  if (!ring.empty()) line.push_back(line.front());
  bg::simplify(line, kept, tolerance);
  const bool flat = kept.size() < 4;
  const std::size_t count = flat ? ring.size() : kept.size() - 1;
  const auto steps = [](double x) { return std::round(x / step_m) * step_m; };
  Ring2 result;
  result.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    result.emplace_back(steps(flat ? ring[i].x() : kept[i].x()), steps(flat ? ring[i].y() : kept[i].y()));
  return result;
}

PastSurfacePtr past(const Surface& surface) {
  PastSurface past{surface.id,
                   surface.born,
                   surface.revision,
                   surface.color,
                   surface.T_map_surface,
                   surface.area_m2,
                   surface.inliers,
                   {}};
  const double tolerance = surface.resolution / 2;
  for (const Polygon& polygon : surface.polygons) {
    Polygon& simpler = past.polygons.emplace_back();
    simpler.outer = coarse(polygon.outer, tolerance);
    for (const Ring2& hole : polygon.holes) simpler.holes.push_back(coarse(hole, tolerance));
  }
  return std::make_shared<const PastSurface>(std::move(past));
}

std::size_t vertices_of(const PastSurface& surface) {
  std::size_t count = 0;
  for (const Polygon& polygon : surface.polygons) {
    count += polygon.outer.size();
    for (const Ring2& hole : polygon.holes) count += hole.size();
  }
  return count;
}

/// What the moment adds to the history's memory: outlines are shared between moments.
std::size_t entries_of(const MomentChanges& changes, const Moment& moment) {
  std::size_t count = moment.surfaces.size() + moment.cylinders.size();
  for (const PastSurfacePtr& surface : changes.surfaces) count += vertices_of(*surface);
  return count;
}

/// Calls `visit(before, now)` for each id that one of the lists has; a null pointer where it is not.
template <typename Before, typename Now, typename Visit>
void for_each_pair(const std::vector<Before>& before, const std::vector<Now>& now, Visit&& visit) {
  const Before none_before{};
  const Now none_now{};
  auto a = before.begin();
  for (auto b = now.begin(); a != before.end() || b != now.end();) {
    if (b == now.end() || (a != before.end() && (*a)->id < (*b)->id))
      visit(*a++, none_now);
    else if (a == before.end() || (*b)->id < (*a)->id)
      visit(none_before, *b++);
    else
      visit(*a++, *b++);
  }
}

template <typename Pointer, typename Id>
void note_changes(const std::vector<Pointer>& before, const std::vector<Pointer>& now,
                  std::vector<Pointer>& changed, std::vector<Id>& gone) {
  for_each_pair(before, now, [&](const Pointer& a, const Pointer& b) {
    if (!b)
      gone.push_back(a->id);
    else if (!a || a->revision != b->revision)
      changed.push_back(b);
  });
}

/// All that a map has or has had, by id and revision of birth.
class Known {
 public:
  explicit Known(const Snapshot& snapshot) {
    for (const SurfacePtr& surface : snapshot.surfaces) surfaces_[surface->id] = surface->born;
    for (const CylinderPtr& cylinder : snapshot.cylinders) cylinders_[cylinder->id] = cylinder->born;
    snapshot.departures.for_each_since(0, [&](const Departure& gone) {
      (gone.of == Departure::Of::surface ? surfaces_ : cylinders_)[gone.id] = gone.born;
    });
  }
  bool has(const Moment& moment) const {
    return has_all(moment.surfaces, surfaces_) && has_all(moment.cylinders, cylinders_);
  }

 private:
  using Births = std::map<std::uint32_t, std::uint64_t>;
  template <typename Pointer>
  static bool has_all(const std::vector<Pointer>& list, const Births& births) {
    return std::all_of(list.begin(), list.end(), [&](const Pointer& one) {
      const auto found = births.find(one->id);
      return found != births.end() && found->second == one->born;
    });
  }
  Births surfaces_, cylinders_;
};

}  // namespace

MomentChanges changes_of(const Moment* before, const Moment& now) {
  const Moment nothing;
  const Moment& then = before != nullptr ? *before : nothing;
  MomentChanges changes;
  note_changes(then.surfaces, now.surfaces, changes.surfaces, changes.gone);
  note_changes(then.cylinders, now.cylinders, changes.cylinders, changes.cylinders_gone);
  return changes;
}

void History::add(const Snapshot& snapshot, double stamp_s) {
  const Moment nothing;
  const Moment& before = moments_.empty() ? nothing : moments_.back();
  if (!moments_.empty() && snapshot.revision < before.revision + stride_) return;
  Moment now{snapshot.revision, stamp_s, {}, snapshot.cylinders};
  for_each_pair(before.surfaces, snapshot.surfaces, [&](const PastSurfacePtr& a, const SurfacePtr& b) {
    if (b) now.surfaces.push_back(a && a->revision == b->revision ? a : past(*b));
  });
  const MomentChanges changes = changes_of(&before, now);
  if (changes.surfaces.empty() && changes.gone.empty() && changes.cylinders.empty() &&
      changes.cylinders_gone.empty())
    return;
  entries_ += entries_of(changes, now);
  moments_.push_back(std::move(now));
  keep_bounds();
}

void History::thin() {
  std::vector<Moment> kept;
  for (std::size_t i = 0; i < moments_.size(); i += 2) kept.push_back(std::move(moments_[i]));
  moments_ = std::move(kept);
  stride_ *= 2;
  count_entries();
}

void History::keep_bounds() {
  while (moments_.size() > 1 && (moments_.size() > most_moments || entries_ > most_entries)) thin();
}

void History::count_entries() {
  entries_ = 0;
  const Moment* before = nullptr;
  for (const Moment& moment : moments_) {
    entries_ += entries_of(changes_of(before, moment), moment);
    before = &moment;
  }
}

void History::forget_after(std::uint64_t revision) {
  std::erase_if(moments_, [&](const Moment& moment) { return moment.revision > revision; });
  count_entries();
}

bool History::belongs_to(const Snapshot& snapshot) const {
  const Known known(snapshot);
  return std::all_of(moments_.begin(), moments_.end(),
                     [&](const Moment& one) { return one.revision > snapshot.revision || known.has(one); });
}

History History::of(std::vector<Moment> moments, std::uint64_t stride) {
  History history;
  history.moments_ = std::move(moments);
  history.stride_ = stride;
  history.count_entries();
  history.keep_bounds();
  return history;
}

}  // namespace octosurf
