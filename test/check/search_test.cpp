// Recordings made wrong in a known way: which cause is named, and that with it they are as they were.
#include "check/search.hpp"

#include "alignment/surfaces_by_hand.hpp"
#include "judgement/walks.hpp"

namespace octosurf::test {
namespace {

using check::Recording;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Recording recording_of(const Scans& scans) {
  Parameters parameters;
  parameters.occupancy.resolution = scans.front().sensor == SensorKind::lidar ? 0.05 : 0.02;
  Recording recording(parameters);
  for (const Scan& scan : scans) recording.add(scan);
  return recording;
}

struct Fault {
  const char* cause;  // a part of its words
  Change make;
};

Change deeper(float (*depth_of)(const Eigen::Vector3f& point)) {
  return each([depth_of](Scan& scan) {
    for (Eigen::Vector3f& point : scan.points) point *= depth_of(point) / point.z();
  });
}

Eigen::Isometry3d axes_of_body() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;  // x forward, y left, z up of a camera
  return T;
}

Fault inverse() {
  return {"poses are inverse", each([](Scan& scan) { scan.T_map_sensor = scan.T_map_sensor.inverse(); })};
}

/// Each is named with the least that undoes it, and poses come out as they were, up to where the map lies.
void expect_named(const Scans& right, std::span<const Fault> faults, double most_m) {
  for (const Fault& fault : faults) {
    Scans wrong = right;
    fault.make(wrong);
    const Recording recording = recording_of(wrong);
    const check::Finding finding = check::search(recording, 2);
    ASSERT_TRUE(finding.meaning) << fault.cause;
    EXPECT_THAT(finding.causes, ElementsAre(HasSubstr(fault.cause)));
    EXPECT_FALSE(finding.as_meant.contradicts());
    const std::size_t shift = right.size() - wrong.size(), first = 10, last = 30;
    const auto motion = [&](std::size_t i) { return *finding.meaning->pose_of(recording, i - shift); };
    const Eigen::Isometry3d found = motion(first).inverse() * motion(last),
                            truth = right[first].T_map_sensor.inverse() * right[last].T_map_sensor;
    EXPECT_NEAR(found.translation().norm(), truth.translation().norm(), most_m) << fault.cause;
  }
}

TEST(Check, NamesWhatACamerasRecordingMeans) {
  auto random = rng();
  const Fault faults[] = {
      inverse(),
      {"poses are of a frame in which the sensor's x, y, z are", mounted(axes_of_body())},
      {"times as long as positions have it", scaled({5, 5, 5})},
      {"focal lengths are 1.100 times those given, its principal point -0.036, -0.027", each([](Scan& scan) {
         for (Eigen::Vector3f& p : scan.points)
           p.head<2>() = 1.1F * p.head<2>() + p.z() * Eigen::Vector2f(0.04F, 0.03F);
       })},
      {"distances from the camera's centre", deeper([](const auto& p) { return p.norm(); })},
      {"inverse depth", deeper([](const auto& p) { return 1.3F / p.z(); })},
      {"those of 3 scans (0.3 s) before", late(3)},
      {"0.700 m, which stands for no return", each([](Scan& scan) {
         for (std::size_t i = 0; i < scan.points.size(); ++i)
           if (i % 4 > 0) scan.points[i] *= 0.7F / scan.points[i].z();
       })},
      {"scans have the readings", [](Scans& scans) {
         for (std::size_t i = 36; i < 44; ++i) scans[i].points = scans[36].points;
       }}};
  expect_named(camera_walk(random), faults, 0.03);
}

TEST(Check, NamesWhatALidarsRecordingMeans) {
  auto random = rng();
  const Fault faults[] = {
      inverse(),
      {"mirrored", scaled({1, -1, 1})},
      {"positions times 0.001", each([](Scan& scan) { scan.T_map_sensor.translation() *= 1000; })},
      {"turned by -5.0", mounted(Eigen::Isometry3d(Eigen::AngleAxisd(5 * degree, Eigen::Vector3d::UnitX())))},
      {"shifted by -0.", mounted(Eigen::Isometry3d(Eigen::Translation3d(0.2, 0, 0)))},
      {"lie in the map's frame already", each([](Scan& scan) {
         for (Eigen::Vector3f& point : scan.points) point = scan.T_map_sensor.cast<float>() * point;
       })}};
  expect_named(lidar_walk(random), faults, 0.03);
}

TEST(Check, TwoCausesTogetherAreNamedBoth) {
  auto random = rng();
  Scans scans = camera_walk(random);
  inverse().make(scans);
  scaled({5, 5, 5})(scans);
  const check::Finding finding = check::search(recording_of(scans), 2);
  EXPECT_THAT(finding.causes, ::testing::UnorderedElementsAre(HasSubstr("poses are inverse"),
                                                              HasSubstr("times as long as positions")));
}

/// A right recording has none, and what no row undoes is not named after one that comes near.
TEST(Check, NamesNothingThatDoesNotMakeScansAgree) {
  auto random = rng();
  const Scans right = camera_walk(random);
  const check::Finding as_it_is = check::search(recording_of(right), 2);
  EXPECT_FALSE(as_it_is.meaning);
  EXPECT_FALSE(as_it_is.as_given.contradicts());
  Scans one_way = right;
  for (Scan& scan : one_way) scan.T_map_sensor.linear() = right[0].T_map_sensor.linear();
  EXPECT_THAT(check::facts_of(recording_of(one_way)), HasSubstr("all poses have one rotation"));
  const Change none_knows[] = {
      [&](Scans& scans) {
        for (Scan& scan : scans) scan.T_map_sensor.translate(0.06 * any_direction(random));
      },
      [](Scans& scans) {
        for (std::size_t i = 0; i < scans.size(); ++i)
          scans[i].T_map_sensor.pretranslate(Eigen::Vector3d(0.004, 0.005, 0.006) * static_cast<double>(i));
      }};
  for (const Change& change : none_knows) {
    Scans wrong = right;
    change(wrong);
    const check::Finding finding = check::search(recording_of(wrong), 2);
    EXPECT_TRUE(finding.as_given.contradicts());
    EXPECT_FALSE(finding.meaning) << ::testing::PrintToString(finding.causes);
  }
}

}  // namespace
}  // namespace octosurf::test
