#include "law/replace_surfaces.hpp"

#include "law/segment.hpp"

#include <algorithm>
#include <map>
#include <vector>

namespace octosurf::law {
namespace {

using Index = surfaces::MapView::Index;

/// Where the points of the surfaces that were there have gone.
class Succession {
 public:
  Succession(const Readings& readings, const occupancy::PointWindow& window,
             const std::vector<Label>& labels) {
    for (Index i = 0; i < readings.size(); ++i) {
      if (window[i].surface == 0) continue;
      Heirs& heirs = of_[window[i].surface];
      ++heirs.points;
      if (labels[i] != clutter) ++heirs.taken[labels[i]];
    }
  }

  struct Heir {
    Label label = clutter;
    bool alone = false;  ///< it has all but the share of outliers that the law reckons with
  };
  Heir heir_of(SurfaceId before) const {
    const Heirs& heirs = of_.at(before);
    const auto most = std::max_element(heirs.taken.begin(), heirs.taken.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == heirs.taken.end()) return {};
    const double left = static_cast<double>(heirs.points - most->second);
    return {most->first, left <= sensing::ReadingModel::outlier_share * static_cast<double>(heirs.points)};
  }

 private:
  struct Heirs {
    std::size_t points = 0;
    std::map<Label, std::size_t> taken;
  };
  std::map<SurfaceId, Heirs> of_;
};

/// The law's plane and what later scans' readings add to it, whose weights are relative to the nearest
/// class's (accumulate_evidence()).
Plane with_evidence(const Patch& patch, const surfaces::SurfaceModel& surface,
                    const sensing::NoiseModel& noise) {
  const surfaces::SurfaceModel::Evidence& evidence = surface.evidence();
  if (!(evidence.readings > 0)) return patch.plane;
  const double sigma = noise.sigma(1);
  Patch all = patch;
  all.moments.add(evidence.moments.shifted(patch.origin - surface.reference()), 1 / (sigma * sigma));
  all.fit();
  return all.plane;
}

std::vector<surfaces::SurfaceModel*> create_surfaces(surfaces::Ledger& ledger, const Segmentation& found) {
  std::vector<surfaces::SurfaceModel*> made(found.patches.size(), nullptr);
  for (Label label = 1; label < made.size(); ++label) {
    const Patch& patch = found.patches[label];
    made[label] = &ledger.create(patch.plane, patch.centroid());
    ledger.changes.born.insert(made[label]->id());
  }
  return made;
}

}  // namespace

void replace_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, double noise_factor2) {
  const Readings readings(octree, ledger.window, ledger.noise, noise_factor2);
  const Parameters& parameters = ledger.parameters;
  const Segmentation found = segment(
      readings, {parameters.max_hole_size(), static_cast<std::size_t>(parameters.min_surface_points()),
                 parameters.surfaces.min_surface_width});
  const Succession succession(readings, ledger.window, found.labels);
  std::vector<SurfaceId> before;
  for (const auto& [id, surface] : ledger.surfaces) before.push_back(id);
  const std::vector<surfaces::SurfaceModel*> made = create_surfaces(ledger, found);
  for (const SurfaceId id : before) {
    const Succession::Heir heir = succession.heir_of(id);
    if (heir.label == clutter) continue;
    surfaces::SurfaceModel& now = *made[heir.label];
    now.parents().push_back(id);
    if (heir.alone) now.take_evidence(*ledger.find(id));
  }
  for (const SurfaceId id : before) {
    const Label heir = succession.heir_of(id).label;
    ledger.dissolve(*ledger.find(id), surfaces::Points::released, heir == clutter ? 0 : made[heir]->id());
  }
  for (Index i = 0; i < readings.size(); ++i)
    if (found.labels[i] != clutter) ledger.give(i, *made[found.labels[i]]);
  for (Label label = 1; label < made.size(); ++label) {
    surfaces::SurfaceModel& surface = *made[label];
    surface.set_plane(with_evidence(found.patches[label], surface, ledger.noise));
    surface.rehash_if_tilted();
    surface.checked_plane = surface.plane();
    surface.unchecked = 0;
  }
  ledger.changes.requeued.clear();
}

}  // namespace octosurf::law
