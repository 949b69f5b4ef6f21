#include "detection/detector.hpp"

#include "detection/likelihood_detector.hpp"

#include <octosurf/error.hpp>

namespace octosurf::detection {

const Detector& detector_of(const Parameters& parameters, const Detector* paper) {
  static const LikelihoodDetector likelihood;
  if (parameters.detection.detector == DetectorKind::likelihood) return likelihood;
  if (paper != nullptr) return *paper;
  throw Error(Error::Kind::usage, "detector", "is paper, which this program does not have",
              "link octosurf::pcl and give the mapper paper_detector(), or take the command octosurf, or "
              "likelihood");
}

}  // namespace octosurf::detection
