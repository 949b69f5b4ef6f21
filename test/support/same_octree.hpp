#pragma once

#include <cstddef>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace octosurf::test {

/// Same nodes with the same values: inner ones too.
template <class Tree>
void expect_same(const Tree& ours, const Tree& theirs) {
  ASSERT_EQ(ours.getResolution(), theirs.getResolution());
  ASSERT_EQ(ours.size(), theirs.size());
  auto a = ours.begin_tree();
  auto b = theirs.begin_tree();
  std::size_t nodes = 0;
  for (; a != ours.end_tree() && b != theirs.end_tree(); ++a, ++b, ++nodes) {
    ASSERT_EQ(a.getKey(), b.getKey());
    ASSERT_EQ(a.getDepth(), b.getDepth());
    ASSERT_EQ(a->getLogOdds(), b->getLogOdds());
    ASSERT_EQ(a.isLeaf(), b.isLeaf());
  }
  EXPECT_TRUE(a == ours.end_tree());
  EXPECT_TRUE(b == theirs.end_tree());
  EXPECT_EQ(nodes, ours.size());
  EXPECT_EQ(ours.calcNumNodes(), ours.size());
}

}  // namespace octosurf::test
