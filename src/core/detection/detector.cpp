#include "detection/detector.hpp"

#include "detection/likelihood_detector.hpp"

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

}  // namespace octosurf::detection
