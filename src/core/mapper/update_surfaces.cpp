#include "mapper/update_surfaces.hpp"

#include "cylinders/cylinders.hpp"
#include "mapper/stopwatch.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace octosurf::mapper {
namespace {

using detection::Assignment;
using detection::Detection;
using detection::Detector;
using detection::Proposal;
using surfaces::Ledger;

/// Where outlines decide about inliers.
void update_outlines(Ledger& ledger, const Detector& detector) {
  if (!detector.as_in_paper()) return;
  for (const SurfaceId id : ledger.changes.touched())
    if (surfaces::SurfaceModel& surface = *ledger.find(id); surface.polygons_stale())
      surface.derive(ledger.parameters.max_hole_size());
}

std::vector<PointId> newly_explained(const Ledger& ledger, const Proposal& proposal) {
  std::vector<PointId> points;
  for (const auto& [point, label] : proposal.points)
    if (label != 0 && ledger.window[point].surface == 0) points.push_back(point);
  return points;
}

std::vector<PointId> pending_beside(const Ledger& ledger, std::span<const PointId> points) {
  std::vector<PointId> beside;
  for (const PointId point : points)
    ledger.window.for_each_near(ledger.window[point].key, 1, [&](PointId i) {
      if (ledger.window[i].surface == 0) beside.push_back(i);
    });
  ledger.window.put_in_order(beside);
  return beside;
}

/// New or changed planes expand into pending points beside `points`, which they took.
void expand_beside(Ledger& ledger, const Detector& detector, std::span<const PointId> points,
                   std::vector<Assignment>& gained) {
  const std::vector<Assignment> more = detector.expand(ledger, pending_beside(ledger, points));
  ledger.apply(more);
  gained.insert(gained.end(), more.begin(), more.end());
}

/// Segments surfaces again whose size has changed. Refits the planes of those that have grown since their
/// last fit, and of those that lost points or were seen better, with an unchanged neighbourhood.
/// `looked_at`: number of `gained` assignments that existed at detection.
/// Returns points of surfaces that are curved.
cylinders::Patches revise(Ledger& ledger, const Detector& detector, std::vector<Assignment>& gained,
                          std::size_t looked_at) {
  cylinders::Patches curved;
  std::set<SurfaceId> changed = ledger.changes.touched();
  std::erase_if(changed, [&](SurfaceId id) { return !ledger.find(id)->size_has_changed(); });
  const std::optional<Proposal> found = detector.revise(ledger, changed);
  for (const SurfaceId id : changed) ledger.find(id)->set_checked();
  if (found) {
    const std::vector<PointId> explained = newly_explained(ledger, *found);
    ledger.apply(*found);
    expand_beside(ledger, detector, explained, gained);
    curved = found->curved;
  }
  // Where expanded surfaces have since touched others that may be the same plane.
  std::vector<Assignment> since;
  for (const Assignment& assignment : std::span(gained).subspan(looked_at))
    if (const SurfaceId now = ledger.window[assignment.point].surface; now != 0)
      since.push_back({assignment.point, now});
  if (const auto met = detector.detect(ledger, {}, {}, {}, since).found) ledger.apply(*met);
  if (detector.as_in_paper()) return curved;
  std::set<SurfaceId> grown, unfitted = ledger.changes.touched();
  for (const Assignment& assignment : gained) grown.insert(assignment.surface);
  std::erase_if(unfitted,
                [&](SurfaceId id) { return ledger.changes.refitted.contains(id) && !grown.contains(id); });
  for (const SurfaceId id : unfitted) ledger.fit(*ledger.find(id));
  return curved;
}

/// Puts pending points into the queue. Their blocks wait once enough points are there.
void accumulate(Ledger& ledger, std::span<const PointId> points) {
  std::vector<geometry::VoxelKey>& queue = ledger.queue().fresh;
  for (const PointId i : ledger.pending(points)) queue.push_back(ledger.window[i].key);
  std::sort(queue.begin(), queue.end());
  queue.erase(std::unique(queue.begin(), queue.end()), queue.end());
}

/// Existing cylinders take new points and those just segmented; new cylinders begin in patches rejected as
/// curved, and in segmented points that no plane explains.
void update_cylinders(Ledger& ledger, std::span<const PointId> fresh, std::span<const PointId> segmented,
                      cylinders::Patches curved) {
  std::vector<PointId> all(fresh.begin(), fresh.end());
  all.insert(all.end(), segmented.begin(), segmented.end());
  ledger.window.put_in_order(all);
  cylinders::update_cylinders(ledger, ledger.pending(all), std::move(curved));
}

void start_anew(Ledger& ledger, const Detector& detector, ScanReport& report) {
  Stopwatch time(report);
  const Proposal found = time(Stage::detect, [&] {
    Proposal planes = detector.detect_anew(ledger);
    ledger.apply(planes, Ledger::Planes::all);
    ledger.queue() = {};
    accumulate(ledger, planes.unprocessed);
    ledger.changes.unprocessed.clear();
    return planes;
  });
  time(Stage::cylinders, [&] { cylinders::update_cylinders(ledger, {}, found.curved); });
}

}  // namespace

void update_surfaces(Ledger& ledger, const Detector& detector, Effort effort, ScanReport& report) {
  if (effort == Effort::anew) return start_anew(ledger, detector, report);
  Stopwatch time(report);
  const SurfaceId first_new = ledger.surfaces.next_id();
  time(Stage::derive, [&] { update_outlines(ledger, detector); });

  // Algorithm 1, first loop: inliers of known surfaces.
  const std::vector<PointId> fresh = ledger.take_unprocessed();
  time(Stage::add_inliers, [&] {
    const std::vector<Assignment> inliers = detector.add_inliers(ledger, fresh);
    ledger.apply(inliers);
    report.added += inliers.size();
  });
  // Algorithm 1, second loop: known surfaces grow over their boundaries.
  std::vector<Assignment> gained = time(Stage::expand, [&] {
    std::vector<Assignment> expanded = detector.expand(ledger, ledger.pending(fresh));
    ledger.apply(expanded);
    return expanded;
  });
  const std::size_t looked_at = gained.size();
  // Algorithm 2: the rest accumulates until enough of it is new in some place; new surfaces expand, too.
  Detection detection = time(Stage::detect, [&] {
    const auto turn = effort == Effort::all ? std::nullopt : std::optional(ledger.revision());
    return detector.detect(ledger, ledger.queue(), ledger.pending(fresh), turn, gained);
  });
  ledger.queue() = std::move(detection.left);
  report.waiting = detection.waiting;
  if (const std::optional<Proposal>& found = detection.found) {
    const std::vector<PointId> explained = newly_explained(ledger, *found);
    time(Stage::detect, [&] { ledger.apply(*found); });
    if (found->refine) time(Stage::expand, [&] { expand_beside(ledger, detector, explained, gained); });
    for (const PointId i : explained) report.detected += ledger.window[i].surface < first_new;
  }
  for (const Assignment& assignment : gained)
    if (const SurfaceId now = ledger.window[assignment.point].surface; now != 0)
      report.expanded += now < first_new;

  auto curved = time(Stage::revise, [&] { return revise(ledger, detector, gained, looked_at); });
  if (const std::optional<Proposal>& found = detection.found) {
    accumulate(ledger, found->unprocessed);
    curved.insert(curved.end(), found->curved.begin(), found->curved.end());
  }
  accumulate(ledger, ledger.take_unprocessed());
  time(Stage::cylinders, [&] { update_cylinders(ledger, fresh, detection.segmented, std::move(curved)); });
}

}  // namespace octosurf::mapper
