#include "detection/detector.hpp"

#include "detection/likelihood_detector.hpp"

#include <algorithm>
#include <atomic>

#include <octosurf/error.hpp>

namespace octosurf::detection {
namespace {

std::atomic<const Detector*>& paper_detector() {
  static std::atomic<const Detector*> detector = nullptr;
  return detector;
}

}  // namespace

const Detector& detector_of(const Parameters& parameters) {
  static const LikelihoodDetector likelihood;
  if (parameters.detection.detector == DetectorKind::likelihood) return likelihood;
  if (const Detector* paper = paper_detector()) return *paper;
  throw Error(
      Error::Kind::usage, "detector", "is paper, which this program does not have",
      "link octosurf::pcl and call enable_paper_detector(), or take the command octosurf, or likelihood");
}

void set_paper_detector(const Detector& detector) { paper_detector() = &detector; }

void assign(surfaces::Ledger& ledger, std::span<const Assignment> assignments) {
  for (const auto& [point, surface] : assignments) ledger.give(point, *ledger.find(surface));
}

std::vector<geometry::VoxelKey> newly_explained(const FoundPlanes& found) {
  std::vector<geometry::VoxelKey> keys;
  for (Readings::Index i = 0; i < found.readings.size(); ++i)
    if (found.readings[i].surface == 0 && found.planes.labels[i] != clutter)
      keys.push_back(found.readings[i].key);
  return keys;
}

std::vector<geometry::VoxelKey> pending_beside(const surfaces::MapView& map,
                                               std::span<const geometry::VoxelKey> keys) {
  std::vector<geometry::VoxelKey> beside;
  for (const geometry::VoxelKey key : keys)
    map.window.for_each_near(key, 1, [&](surfaces::MapView::Index i) {
      if (map.window[i].surface == 0) beside.push_back(map.window[i].key);
    });
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  return beside;
}

}  // namespace octosurf::detection
