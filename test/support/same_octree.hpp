#pragma once

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace octosurf::test {

/// Same nodes with the same values: inner ones too.
inline void expect_same(const octomap::OcTree& ours, const octomap::OcTree& theirs) {
  ASSERT_EQ(ours.getResolution(), theirs.getResolution());
  ASSERT_EQ(ours.size(), theirs.size());
  auto a = ours.begin_tree();
  auto b = theirs.begin_tree();
  for (; a != ours.end_tree() && b != theirs.end_tree(); ++a, ++b) {
    ASSERT_EQ(a.getKey(), b.getKey());
    ASSERT_EQ(a.getDepth(), b.getDepth());
    ASSERT_EQ(a->getLogOdds(), b->getLogOdds());
    ASSERT_EQ(a.isLeaf(), b.isLeaf());
  }
  EXPECT_TRUE(a == ours.end_tree());
  EXPECT_TRUE(b == theirs.end_tree());
  EXPECT_EQ(ours.calcNumNodes(), ours.size());
}

}  // namespace octosurf::test
