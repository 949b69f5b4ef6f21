#include "evaluation/hoover.hpp"

#include <gmock/gmock.h>

namespace octosurf::evaluation {
namespace {

using testing::ElementsAre;

HooverRegions all_judged(std::size_t truths, std::size_t founds) {
  return {std::vector<bool>(truths, true), std::vector<bool>(founds, true), std::vector<double>(truths, 0.0)};
}

TEST(Hoover, BothSharesDecideWhatIsCorrect) {
  const std::vector<Overlap> overlaps{{0, 0, 0.8, 0.8}, {1, 1, 0.79, 1.0}, {2, 2, 1.0, 0.79}};
  const HooverResult result = hoover(all_judged(3, 3), overlaps, 0.8);
  EXPECT_THAT(result.truth, ElementsAre(TruthVerdict::correct, TruthVerdict::missed, TruthVerdict::missed));
  EXPECT_THAT(result.found, ElementsAre(FoundVerdict::correct, FoundVerdict::noise, FoundVerdict::noise));
  EXPECT_EQ(result.match[0], 0u);
  EXPECT_FALSE(result.match[1]);
}

TEST(Hoover, OfTwoLayersTheBetterOneIsCorrectAndTheOtherNoise) {
  const std::vector<Overlap> overlaps{{0, 0, 0.9, 0.85}, {0, 1, 0.88, 0.95}};
  const HooverResult result = hoover(all_judged(1, 2), overlaps, 0.8);
  EXPECT_EQ(result.match[0], 1u);
  EXPECT_THAT(result.found, ElementsAre(FoundVerdict::noise, FoundVerdict::correct));
}

TEST(Hoover, PartsThatTogetherCoverMakeOverSegmentation) {
  HooverRegions regions = all_judged(2, 4);
  regions.covered_by_parts = {0.85, 0.75};
  const std::vector<Overlap> overlaps{{0, 0, 0.45, 1}, {0, 1, 0.4, 1}, {1, 2, 0.4, 1}, {1, 3, 0.35, 1}};
  const HooverResult result = hoover(regions, overlaps, 0.8);
  EXPECT_THAT(result.truth, ElementsAre(TruthVerdict::over_segmented, TruthVerdict::missed));
  EXPECT_THAT(result.found,
              ElementsAre(FoundVerdict::part, FoundVerdict::part, FoundVerdict::noise, FoundVerdict::noise));
}

TEST(Hoover, OneSurfaceOverSeveralIsUnderSegmentation) {
  const std::vector<Overlap> overlaps{{0, 0, 0.9, 0.5}, {1, 0, 0.95, 0.5}, {2, 0, 0.5, 0.1}};
  const HooverResult result = hoover(all_judged(3, 1), overlaps, 0.8);
  EXPECT_THAT(result.truth, ElementsAre(TruthVerdict::under_segmented, TruthVerdict::under_segmented,
                                        TruthVerdict::missed));
  EXPECT_THAT(result.found, ElementsAre(FoundVerdict::fused));
}

TEST(Hoover, AKerbThatVanishedInTheFloorIsUnderSegmentedBesideACorrectFloor) {
  const std::vector<Overlap> overlaps{{0, 0, 1, 0.95}, {1, 0, 0.9, 0.05}};
  const HooverResult result = hoover(all_judged(2, 1), overlaps, 0.8);
  EXPECT_THAT(result.truth, ElementsAre(TruthVerdict::correct, TruthVerdict::under_segmented));
  EXPECT_THAT(result.found, ElementsAre(FoundVerdict::correct));
}

TEST(Hoover, WhatIsNotJudgedIsNeitherMissedNorNoise) {
  HooverRegions regions = all_judged(2, 2);
  regions.truth_judged[0] = false;
  regions.found_judged[1] = false;
  const std::vector<Overlap> overlaps{{0, 0, 1, 0.9}};
  const HooverResult result = hoover(regions, overlaps, 0.8);
  EXPECT_THAT(result.truth, ElementsAre(TruthVerdict::not_judged, TruthVerdict::missed));
  EXPECT_THAT(result.found, ElementsAre(FoundVerdict::not_judged, FoundVerdict::not_judged));
  EXPECT_FALSE(result.match[0]);
}

}  // namespace
}  // namespace octosurf::evaluation
