#include "detection/detector.hpp"

#include "support/testing.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using ::testing::HasSubstr;

// This program does not link octosurf::pcl.
TEST(Detector, ThePapersIsRefusedWhereItIsNotLinkedAndTheMapStays) {
  Map map(Parameters::paper());
  try {
    const Mapper mapper(std::move(map));
    FAIL() << "it maps";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::usage);
    EXPECT_THAT(error.what(), HasSubstr("octosurf::pcl"));
  }
  EXPECT_EQ(map.size().scans, 0U);
  EXPECT_EQ(map.parameters().detection.detector, DetectorKind::paper);
}

}  // namespace
}  // namespace octosurf
