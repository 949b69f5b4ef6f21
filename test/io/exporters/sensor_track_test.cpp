#include "io/exporters/page_messages.hpp"

#include <gtest/gtest.h>

namespace octosurf::test {
namespace {

Eigen::Isometry3d at(double x) { return Eigen::Isometry3d(Eigen::Translation3d(x, 0, 0)); }

TEST(SensorTrack, KeepsTheLastPoseAndPlacesThatAreApart) {
  io::SensorTrack track;
  EXPECT_FALSE(track.sensor);
  for (const double x : {1.0, 1.004, 1.009, 1.02}) track.add(SensorKind::lidar, at(x));
  EXPECT_EQ(track.sensor, SensorKind::lidar);
  EXPECT_EQ(track.T_map_sensor.translation().x(), 1.02);
  ASSERT_EQ(track.places.size(), 2u);
  EXPECT_EQ(track.places[0].x(), 1.0);
  EXPECT_EQ(track.places[1].x(), 1.02);
}

TEST(SensorTrack, OfALongWayKeepsFewPlacesAllAlongIt) {
  constexpr int scans = 20000;
  constexpr double step = 0.05;  // m: a kilometre in all
  io::SensorTrack track;
  for (int i = 0; i <= scans; ++i) track.add(SensorKind::depth_camera, at(i * step));
  EXPECT_LE(track.places.size(), io::SensorTrack::most_places);
  EXPECT_EQ(track.places.front().x(), 0);
  EXPECT_LT(scans * step - track.places.back().x(), 2);
  for (std::size_t i = 1; i < track.places.size(); ++i)
    EXPECT_LT(track.places[i].x() - track.places[i - 1].x(), 2) << "no gap, " << i;
}

}  // namespace
}  // namespace octosurf::test
