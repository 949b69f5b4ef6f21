#include "evaluation/hoover.hpp"

#include <gtest/gtest.h>

namespace octosurf::evaluation {
namespace {

using True = TruthVerdict;
using Found = FoundVerdict;

/// The verdicts at T = 80 %; `regions` are all judged unless told. A correct face's match is correct, too.
void expect_verdicts(const std::vector<Overlap>& overlaps, const std::vector<True>& truth,
                     const std::vector<Found>& found, HooverRegions regions = {}) {
  regions.truth_judged.resize(truth.size(), true);
  regions.found_judged.resize(found.size(), true);
  regions.covered_by_parts.resize(truth.size());
  const HooverResult result = hoover(regions, overlaps, 0.8);
  EXPECT_EQ(result.truth, truth);
  EXPECT_EQ(result.found, found);
  for (std::size_t t = 0; t < truth.size(); ++t) {
    ASSERT_EQ(result.match[t].has_value(), truth[t] == True::correct) << t;
    EXPECT_TRUE(!result.match[t] || found[*result.match[t]] == Found::correct) << t;
  }
}

TEST(Hoover, BothSharesDecideWhatIsCorrect) {
  expect_verdicts({{0, 0, 0.8, 0.8}, {1, 1, 0.79, 1.0}, {2, 2, 1.0, 0.79}},
                  {True::correct, True::missed, True::missed}, {Found::correct, Found::noise, Found::noise});
}

TEST(Hoover, OfTwoLayersTheBetterOneIsCorrectAndTheOtherNoise) {
  expect_verdicts({{0, 0, 0.9, 0.85}, {0, 1, 0.88, 0.95}}, {True::correct}, {Found::noise, Found::correct});
}

TEST(Hoover, PartsThatTogetherCoverMakeOverSegmentation) {
  expect_verdicts({{0, 0, 0.45, 1}, {0, 1, 0.4, 1}, {1, 2, 0.4, 1}, {1, 3, 0.35, 1}},
                  {True::over_segmented, True::missed},
                  {Found::part, Found::part, Found::noise, Found::noise}, {{}, {}, {0.85, 0.75}});
}

TEST(Hoover, OneSurfaceOverSeveralIsUnderSegmentation) {
  expect_verdicts({{0, 0, 0.9, 0.5}, {1, 0, 0.95, 0.5}, {2, 0, 0.5, 0.1}},
                  {True::under_segmented, True::under_segmented, True::missed}, {Found::fused});
}

TEST(Hoover, AKerbThatVanishedInTheFloorIsUnderSegmentedBesideACorrectFloor) {
  expect_verdicts({{0, 0, 1, 0.95}, {1, 0, 0.9, 0.05}}, {True::correct, True::under_segmented},
                  {Found::correct});
}

TEST(Hoover, WhatIsNotJudgedIsNeitherMissedNorNoise) {
  expect_verdicts({{0, 0, 1, 0.9}}, {True::not_judged, True::missed}, {Found::not_judged, Found::not_judged},
                  {{false, true}, {true, false}, {}});
}

}  // namespace
}  // namespace octosurf::evaluation
