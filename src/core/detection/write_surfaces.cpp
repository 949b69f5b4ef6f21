#include "detection/write_surfaces.hpp"

#include "detection/heirs.hpp"

#include <set>
#include <vector>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;
using surfaces::SurfaceModel;

/// Combines the segmented plane with the evidence of later scans, whose weights are relative to the nearest
/// class's (accumulate_evidence()).
Plane with_evidence(const Patch& patch, const SurfaceModel& surface, const sensing::NoiseModel& noise) {
  const SurfaceModel::Evidence& evidence = surface.evidence();
  if (!(evidence.readings > 0)) return patch.plane;
  const double sigma = noise.sigma(1);
  Patch all = patch;
  all.moments.add(evidence.moments.shifted(patch.origin - surface.reference()), 1 / (sigma * sigma));
  all.fit();
  return all.plane;
}

class Writing {
 public:
  Writing(surfaces::Ledger& ledger, const FoundPlanes& found)
      : ledger_(ledger),
        readings_(found.readings),
        found_(found.planes),
        fitted_once_(found.fitted_once),
        heirs_(readings_, found_),
        before_(heirs_.surfaces()),
        made_(found_.patches.size(), nullptr) {}

  /// Assigns a surface to each label.
  void name_labels() {
    const std::vector<SurfaceId> keepers = heirs_.keepers(made_.size(), ledger_.changes.born),
                                 origins = heirs_.origins(made_.size());
    for (Label label = 1; label < made_.size(); ++label) {
      if (keepers[label] != 0) {
        made_[label] = ledger_.find(keepers[label]);
        kept_.insert(keepers[label]);
        continue;
      }
      const Patch& patch = found_.patches[label];
      made_[label] = &ledger_.create(patch.plane, patch.centroid());
      ledger_.changes.born.insert(made_[label]->id());
      if (origins[label] != 0) made_[label]->parents().push_back(origins[label]);
    }
  }

  /// Before points are reassigned: their evidence moves with them.
  void hand_on_evidence() {
    for (const SurfaceId id : before_) {
      if (!kept_.contains(id) && heirs_.of(id) != clutter && heirs_.keeps_most_readings(id))
        made_[heirs_.of(id)]->take_evidence(*ledger_.find(id));
      if (kept_.contains(id) && !heirs_.keeps_most_readings(id)) ledger_.find(id)->forget_evidence();
    }
  }

  void hand_over_points() {
    for (const Outside& part : found_.outside) {
      SurfaceModel& surface = *ledger_.find(part.surface);
      if (made_[part.label] == &surface) continue;
      for (const surfaces::Inlier& inlier : surface.sorted_inliers())
        if (readings_.is_context(readings_.find(inlier.key)))
          hand_over(ledger_.window.find(inlier.key), made_[part.label]);
    }
    for (Index i = 0; i < readings_.size(); ++i) hand_over(readings_[i].in_window, made_[found_.labels[i]]);
  }

  void remove_unclaimed() {
    for (const SurfaceId id : before_) {
      if (kept_.contains(id)) continue;
      SurfaceModel* heir = made_[heirs_.of(id)];
      if (heir != nullptr) heir->parents().push_back(id);
      ledger_.dissolve(*ledger_.find(id), heir == nullptr ? 0 : heir->id());
    }
  }

  void set_planes(Planes planes) {
    const std::set<SurfaceId> touched = ledger_.changes.touched();
    for (Label label = 1; label < made_.size(); ++label) {
      SurfaceModel& surface = *made_[label];
      if (planes == Planes::touched && !touched.contains(surface.id())) continue;
      const Patch& patch = found_.patches[label];
      surface.set_plane(fitted_once_ ? patch.plane : with_evidence(patch, surface, ledger_.noise));
      surface.rehash_if_tilted();
      ledger_.changes.refitted.insert(surface.id());
    }
  }

  void note_checked() {
    std::vector<bool> whole(made_.size(), true);
    for (const Outside& part : found_.outside) whole[part.label] = false;
    for (Label label = 1; label < made_.size(); ++label)
      if (whole[label]) made_[label]->set_checked();
  }

 private:
  void hand_over(Index in_window, SurfaceModel* to) {
    const SurfaceId from = ledger_.window[in_window].surface;
    if (from == (to == nullptr ? 0 : to->id())) return;
    if (to == nullptr)
      ledger_.requeue(in_window);
    else if (from == 0)
      ledger_.give(in_window, *to);
    else
      ledger_.reassign(in_window, *to);
  }

  surfaces::Ledger& ledger_;
  const Readings& readings_;
  const Segmentation& found_;
  bool fitted_once_;
  Heirs heirs_;
  std::vector<SurfaceId> before_;
  std::set<SurfaceId> kept_;
  std::vector<SurfaceModel*> made_;  // by label; nullptr for clutter
};

}  // namespace

void write_surfaces(surfaces::Ledger& ledger, const FoundPlanes& found, Planes planes) {
  Writing writing(ledger, found);
  writing.name_labels();
  writing.hand_on_evidence();
  writing.hand_over_points();
  writing.remove_unclaimed();
  writing.set_planes(planes);
  writing.note_checked();
}

}  // namespace octosurf::detection
