#include "sensing/reading_model.hpp"
#include "surfaces/ledger.hpp"
#include "surfaces/shared_readings.hpp"

#include <map>
#include <set>
#include <vector>

namespace octosurf::surfaces {
namespace {

using Label = Proposal::Label;

SharedReadings shared_readings(const Proposal& proposal, const occupancy::PointWindow& window) {
  SharedReadings shared;
  for (const auto& [point, label] : proposal.points) shared.add(window[point].surface, label);
  for (const auto& [surface, label, readings] : proposal.rest) shared.add(surface, label, readings);
  return shared;
}

}  // namespace

class Ledger::Writer {
 public:
  Writer(Ledger& ledger, const Proposal& proposal)
      : ledger_(ledger),
        proposal_(proposal),
        shared_(shared_readings(proposal, ledger.window)),
        surfaces_(proposal.planes.size(), nullptr) {}

  /// Finds or creates the surface of each plane.
  void name_planes() {
    std::map<SurfaceId, SurfaceId> keepers = shared_.keepers(ledger_.changes.born),
                                   origins = shared_.origins();
    for (Label label = 1; label < surfaces_.size(); ++label) {
      const SurfaceId keeper = keepers[label];
      surfaces_[label] = keeper != 0 ? ledger_.find(keeper) : create(label, origins[label]);
      kept_.insert(surfaces_[label]->id());
    }
  }

  /// Before points are reassigned: evidence moves with all but the model's share of outliers.
  void hand_on_evidence() {
    for (const auto& [id, shares] : shared_.before()) {
      const auto successor = static_cast<Label>(shares.most());
      const bool most = successor != 0 && shares.all - shares.shared(successor) <=
                                              sensing::ReadingModel::outlier_share * shares.all;
      if (kept_.contains(id) && !most) ledger_.find(id)->forget_evidence();
      if (!kept_.contains(id) && most) surfaces_[successor]->take_evidence(*ledger_.find(id));
    }
  }

  void hand_over_points() {
    occupancy::PointSet labelled;
    for (const auto& [point, label] : proposal_.points) labelled.insert(point);
    for (const auto& [id, label, readings] : proposal_.rest) {
      SurfaceModel& surface = *ledger_.find(id);
      if (surfaces_[label] == &surface) continue;
      for (const Inlier& inlier : surface.sorted_inliers()) {
        const PointId point = ledger_.window.find(inlier.key);
        if (!labelled.contains(point)) hand_over(point, surfaces_[label]);
      }
    }
    for (const auto& [point, label] : proposal_.points) hand_over(point, surfaces_[label]);
  }

  void remove_unclaimed() {
    for (const auto& [id, shares] : shared_.before()) {
      if (kept_.contains(id)) continue;
      SurfaceModel* successor = surfaces_[shares.most()];
      if (successor != nullptr) successor->add_parent(id);
      ledger_.dissolve(*ledger_.find(id), successor == nullptr ? 0 : successor->id());
    }
  }

  void set_planes(bool refit) {
    const std::set<SurfaceId> touched = ledger_.changes.touched();
    for (Label label = 1; label < surfaces_.size(); ++label) {
      SurfaceModel& surface = *surfaces_[label];
      if (!touched.contains(surface.id())) continue;
      surface.set_plane(proposal_.planes[label].plane);
      if (refit)
        ledger_.fit(surface);
      else
        ledger_.changes.refitted.insert(surface.id());
    }
  }

  void note_checked() {
    std::vector<bool> whole(surfaces_.size(), true);
    for (const Proposal::Rest& rest : proposal_.rest) whole[rest.label] = false;
    for (Label label = 1; label < surfaces_.size(); ++label)
      if (whole[label]) surfaces_[label]->set_checked();
  }

 private:
  SurfaceModel* create(Label label, SurfaceId origin) {
    const Proposal::FoundPlane& found = proposal_.planes[label];
    SurfaceModel& surface = ledger_.create(found.plane, found.centroid);
    ledger_.changes.born.insert(surface.id());
    if (origin != 0) surface.add_parent(origin);
    return &surface;
  }

  void hand_over(PointId point, SurfaceModel* to) {
    const SurfaceId from = ledger_.window[point].surface;
    if (from == (to == nullptr ? 0 : to->id())) return;
    if (to == nullptr)
      ledger_.requeue(point);
    else if (from == 0)
      ledger_.give(point, *to);
    else
      ledger_.reassign(point, *to);
  }

  Ledger& ledger_;
  const Proposal& proposal_;
  SharedReadings shared_;
  std::set<SurfaceId> kept_;
  std::vector<SurfaceModel*> surfaces_;  // by label; null for no plane
};

void Ledger::apply(const Proposal& proposal, bool refit) {
  Writer writer(*this, proposal);
  writer.name_planes();
  writer.hand_on_evidence();
  writer.hand_over_points();
  writer.remove_unclaimed();
  writer.set_planes(refit);
  writer.note_checked();
}

void Ledger::fit(SurfaceModel& surface) {
  surface.set_plane(surface.estimate(noise));
  surface.rehash_if_tilted();
  changes.refitted.insert(surface.id());
}

void Ledger::apply(std::span<const Assignment> assignments) {
  for (const auto& [point, surface] : assignments) give(point, *find(surface));
}

}  // namespace octosurf::surfaces
