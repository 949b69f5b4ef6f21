#include "cylinders/cylinders.hpp"
#include "mapper/map_change.hpp"
#include "mapper/stopwatch.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace octosurf::mapper {
namespace {

using detection::Assignment;
using detection::Detector;
using detection::Due;
using detection::Proposal;
using surfaces::Ledger;

/// Algorithms 1 and 2 of the paper for a ledger's unprocessed points, step by step.
class SurfaceUpdate {
 public:
  SurfaceUpdate(Ledger& ledger, const Detector& detector, int threads, ScanReport& report)
      : ledger_(ledger), detector_(detector), threads_(threads), report_(report), time_(report) {}

  /// Where outlines decide about inliers.
  void update_outlines() {
    if (!detector_.traits.outlines_decide) return;
    for (const SurfaceId id : ledger_.changes.touched())
      if (surfaces::SurfaceModel& surface = *ledger_.find(id); surface.polygons_stale())
        surface.derive(ledger_.parameters.max_hole_size());
  }

  /// Algorithm 1, first loop: inliers of known surfaces.
  void add_inliers() {
    const std::vector<Assignment> inliers = detector_.add_inliers(ledger_, fresh_);
    ledger_.apply(inliers);
    report_.added += inliers.size();
  }

  /// Algorithm 1, second loop: known surfaces grow over their boundaries.
  void expand() { expand_from(fresh_); }

  /// Algorithm 2: the rest accumulates until enough of it is new in some place; new surfaces expand, too.
  void detect(std::optional<std::uint64_t> turn) {
    const std::vector<PointId> left = ledger_.pending(fresh_);
    Due due = time_(Stage::detect, [&] { return detector_.due(ledger_, ledger_.queue(), left, turn); });
    ledger_.queue() = std::move(due.left);
    report_.waiting = due.waiting;
    segmented_ = std::move(due.points);
    if (!segmented_.empty())
      found_ =
          time_(Stage::detect, [&] { return detector_.segment(ledger_, {.points = segmented_}, threads_); });
    std::vector<PointId> explained;
    if (found_) {
      explained = time_(Stage::detect, [&] { return apply(*found_); });
      if (detector_.traits.refits) time_(Stage::expand, [&] { expand_from(explained); });
    }
    for (const PointId i : explained) report_.detected += is_in_old(i);
    for (const PointId i : gained_) report_.expanded += is_in_old(i);
    gained_.insert(gained_.end(), explained.begin(), explained.end());
  }

  /// What is left of taking back: surfaces whose evidence has changed are segmented again: those whose size
  /// has, new ones, which leftovers alone have decided, and those that gained points which another surface
  /// explains, too, as one plane with theirs. Refits the planes of those that have grown since their last
  /// fit, and of those that lost points or were seen better, with an unchanged neighbourhood.
  void revise() {
    std::vector<SurfaceId> changed;
    for (const SurfaceId id : ledger_.changes.touched())
      if (ledger_.changes.born.contains(id) || ledger_.find(id)->size_has_changed()) changed.push_back(id);
    const std::optional<Proposal> found =
        detector_.segment(ledger_, {.surfaces = changed, .gained = gained_}, threads_);
    for (const SurfaceId id : changed)
      if (ledger_.find(id)->size_has_changed()) ledger_.find(id)->set_checked();
    if (found) {
      expand_from(apply(*found));
      curved_ = found->curved;
    }
    if (detector_.traits.refits) refit();
  }

  /// Points that lost their surface, or that no plane took, wait for more.
  void accumulate() {
    if (found_) enqueue(found_->unprocessed);
    enqueue(ledger_.take_unprocessed());
  }

  /// Existing cylinders take new points and those just segmented; new ones begin in rejected patches.
  void update_cylinders() {
    std::vector<PointId> all = fresh_;
    all.insert(all.end(), segmented_.begin(), segmented_.end());
    ledger_.window.put_in_order(all);
    if (found_) curved_.insert(curved_.end(), found_->curved.begin(), found_->curved.end());
    cylinders::update_cylinders(ledger_, ledger_.pending(all), std::move(curved_));
  }

 private:
  /// The points that have a surface now, and had none.
  std::vector<PointId> apply(const Proposal& found) {
    std::vector<PointId> explained;
    for (const auto& [point, label] : found.points)
      if (label != 0 && ledger_.window[point].surface == 0) explained.push_back(point);
    ledger_.apply(found, detector_.traits.refits);
    return explained;
  }

  void expand_from(std::span<const PointId> points) {
    const std::vector<Assignment> more = detector_.expand(ledger_, points, threads_);
    ledger_.apply(more);
    for (const Assignment& assignment : more) gained_.push_back(assignment.point);
  }

  void refit() {
    std::set<SurfaceId> grown;
    for (const PointId i : gained_) grown.insert(ledger_.window[i].surface);
    for (const SurfaceId id : ledger_.changes.touched())
      if (!ledger_.changes.refitted.contains(id) || grown.contains(id)) ledger_.fit(*ledger_.find(id));
  }

  void enqueue(std::span<const PointId> points) {
    std::vector<geometry::VoxelKey>& queue = ledger_.queue().fresh;
    for (const PointId i : ledger_.pending(points)) queue.push_back(ledger_.window[i].key);
    std::sort(queue.begin(), queue.end());
    queue.erase(std::unique(queue.begin(), queue.end()), queue.end());
  }

  /// Of a surface that the change has not created.
  bool is_in_old(PointId i) const {
    const SurfaceId id = ledger_.window[i].surface;
    return id != 0 && id < first_new_;
  }

  Ledger& ledger_;
  const Detector& detector_;
  int threads_;
  ScanReport& report_;
  Stopwatch time_;
  SurfaceId first_new_ = ledger_.surfaces.next_id();
  std::vector<PointId> fresh_ = ledger_.take_unprocessed(), segmented_;
  std::vector<PointId> gained_;  // by surfaces
  std::optional<Proposal> found_;
  cylinders::Patches curved_;
};

}  // namespace

void update_surfaces(Ledger& ledger, const Detector& detector, Effort effort, int threads,
                     ScanReport& report) {
  Stopwatch time(report);
  SurfaceUpdate update(ledger, detector, threads, report);
  time(Stage::derive, [&] { update.update_outlines(); });
  time(Stage::add_inliers, [&] { update.add_inliers(); });
  time(Stage::expand, [&] { update.expand(); });
  update.detect(effort == Effort::all ? std::nullopt : std::optional(ledger.revision()));
  time(Stage::revise, [&] { update.revise(); });
  update.accumulate();
  time(Stage::cylinders, [&] { update.update_cylinders(); });
}

}  // namespace octosurf::mapper
