#include "surfaces/shared_readings.hpp"

#include <gmock/gmock.h>

namespace octosurf::surfaces {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

TEST(SharedReadings, MostIsTheLowerIdOnATieAndReadingsOfNoSurfaceCount) {
  SharedReadings shared;
  shared.add(5, 7, 2);
  shared.add(5, 3, 2);
  shared.add(5, 0, 10);
  shared.add(0, 3, 4);
  shared.add(6, 0);
  const SharedReadings::Shares& five = shared.before().at(5);
  EXPECT_EQ(five.all, 14);
  EXPECT_EQ(five.most(), 3U);
  EXPECT_EQ(five.shared(7), 2);
  EXPECT_EQ(five.shared(8), 0);
  EXPECT_EQ(shared.before().at(6).most(), 0U);
  EXPECT_FALSE(shared.before().contains(0));
  EXPECT_EQ(shared.after(3), 6);
  EXPECT_EQ(shared.after(0), 0);
}

TEST(SharedReadings, AnIdGoesWhereMostOfItsReadingsAreUnlessAnotherHasMoreThere) {
  SharedReadings shared;
  shared.add(1, 11, 6);  // split: 11 continues it, 12 does not
  shared.add(1, 12, 5);
  shared.add(2, 11, 5);  // merges into 11
  shared.add(3, 13, 4);
  shared.add(3, 0, 5);
  shared.add(0, 13, 5);
  shared.add(4, 14, 3);
  shared.add(5, 14, 9);
  EXPECT_THAT(shared.keepers(), ElementsAre(Pair(11, 1), Pair(13, 3), Pair(14, 5)));
  EXPECT_THAT(shared.keepers({5}), ElementsAre(Pair(11, 1), Pair(13, 3), Pair(14, 4))) << "5 is unpublished";
  EXPECT_THAT(shared.origins(), ElementsAre(Pair(11, 1), Pair(12, 1), Pair(14, 5))) << "more than half";
}

TEST(SharedReadings, TiesGoToLowerIds) {
  SharedReadings shared;
  for (const SharedReadings::Id before : {2, 1})
    for (const SharedReadings::Id after : {12, 11}) shared.add(before, after);
  EXPECT_THAT(shared.keepers(), ElementsAre(Pair(11, 1)));
  EXPECT_THAT(shared.origins(), IsEmpty());
  EXPECT_THAT(SharedReadings().keepers(), IsEmpty());
}

}  // namespace
}  // namespace octosurf::surfaces
