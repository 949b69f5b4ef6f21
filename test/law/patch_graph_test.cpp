#include "law/patch_graph.hpp"

#include <gtest/gtest.h>

namespace octosurf::law {
namespace {

/// A level square of exact readings of 2 mm noise about (x, 0, z).
Patch level(double x, double z, double facing = 1) {
  Patch patch;
  patch.plane.normal = {0, 0, facing};
  patch.origin = {x, 0, z};
  for (int i = -5; i <= 5; ++i)
    for (int j = -5; j <= 5; ++j) {
      patch.moments.add({0.02 * i, 0.02 * j, 0}, 1 / (0.002 * 0.002));
      ++patch.readings;
      ++patch.hits;
      patch.log_peaks += 5;  // of 2 mm
    }
  patch.fit();
  return patch;
}

TEST(PatchGraph, JoinsAChainOfOnePlane) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0), level(0.44, 0), level(0.22, 0.3)});
  graph.meet(1, 2, {0.11, 0, 0}, 11);
  graph.meet(2, 3, {0.33, 0, 0}, 0);  // across a gap
  const PatchGraph::Merged merged = std::move(graph).merge();
  ASSERT_EQ(merged.patches.size(), 3U);
  EXPECT_EQ(merged.into[0], clutter);
  EXPECT_EQ(merged.into[1], merged.into[2]);
  EXPECT_EQ(merged.into[1], merged.into[3]);
  EXPECT_NE(merged.into[1], merged.into[4]);
  EXPECT_EQ(merged.patches[merged.into[1]].readings, 3 * 121);
}

TEST(PatchGraph, LeavesStepsAndBacksApart) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0.05), level(0, -0.002, -1)});
  graph.meet(1, 2, {0.11, 0, 0.02}, 11);
  graph.meet(1, 3, {0, 0, 0}, 100);
  EXPECT_EQ(std::move(graph).merge().patches.size(), 4U);
}

TEST(PatchGraph, ALongRimIsNoReasonToJoinAStep) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0.05)});
  graph.meet(1, 2, {0.11, 0, 0.02}, 10000);
  EXPECT_EQ(std::move(graph).merge().patches.size(), 3U);
}

TEST(PatchGraph, WhatDoesNotMeetIsNotJoined) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0)});
  EXPECT_EQ(std::move(graph).merge().patches.size(), 3U);
}

}  // namespace
}  // namespace octosurf::law
