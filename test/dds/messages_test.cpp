// What the node writes of octosurf_msgs, field by field as another vendor's types, made of the .msg files,
// read it.
#include "node/messages.hpp"

#include "dds/robot.hpp"

namespace octosurf::test {
namespace {

using namespace octosurf_msgs::msg::dds_;

/// Read, and written again to the same bytes: nothing is left over, nothing missing.
template <class Support>
typename Support::type read_whole(const std::function<void(io::MessageWriter&)>& message) {
  const std::string bytes = io::cdr_of(message);
  const auto read = deserialised<Support>(bytes);
  EXPECT_TRUE(serialised<Support>(read) == bytes);
  return read;
}

template <class Message>
Eigen::Vector3d xyz(const Message& message) {
  return {message.x(), message.y(), message.z()};
}

SurfacePtr surface() {
  Surface surface;
  surface.id = 7;
  surface.color = {0.1F, 0.2F, 0.3F};
  surface.plane.normal = Eigen::Vector3d(0, 0.6, 0.8);
  surface.plane.offset = 1.25;
  surface.T_map_surface.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), surface.plane.normal).toRotationMatrix();
  surface.T_map_surface.translation() = 1.25 * surface.plane.normal;
  surface.polygons = {{{{0, 0}, {2, 0}, {0, 3}}, {{{0.1, 0.1}, {0.1, 0.2}, {0.2, 0.1}}}}};
  surface.area_m2 = 2.5;
  surface.inliers = 321;
  surface.rms_m = 0.004;
  for (int i = 0; i < 9; ++i) surface.covariance(i / 3, i % 3) = i + 0.5;
  surface.born = 11;
  surface.revision = 22;
  surface.parents = {3, 5};
  return std::make_shared<const Surface>(surface);
}

TEST(DdsMessages, SurfacesAndCylindersHaveAllTheirFields) {
  Cylinder pole;
  pole.id = 4;
  pole.axis_point = {1, 2, 3};
  pole.axis = Eigen::Vector3d::UnitX();
  pole.radius_m = 0.05;
  pole.length_m = 1.5;
  pole.start = Eigen::Vector3d::UnitY();
  pole.span_rad = 2.5;
  pole.inliers = 66;
  pole.rms_m = 0.002;
  pole.born = 8;
  pole.revision = 9;
  Snapshot snapshot;
  snapshot.revision = 33;
  snapshot.resolution = 0.02;
  snapshot.surfaces = {surface()};
  snapshot.cylinders = {std::make_shared<const Cylinder>(pole)};
  const Surfaces_ read = read_whole<Surfaces_PubSubType>([&](io::MessageWriter& out) {
    node::write_surfaces(out, snapshot, "odom", 1'700'000'000'250'000'000);
  });
  EXPECT_EQ(read.header().frame_id(), "odom");
  EXPECT_EQ(read.header().stamp().sec(), 1'700'000'000);
  EXPECT_EQ(read.header().stamp().nanosec(), 250'000'000U);
  EXPECT_EQ(read.revision(), 33U);
  EXPECT_EQ(read.resolution(), 0.02);

  ASSERT_EQ(read.surfaces().size(), 1U);
  const Surface& of = *snapshot.surfaces[0];
  const Surface_& one = read.surfaces()[0];
  EXPECT_EQ(one.id(), 7U);
  EXPECT_EQ(one.color().g(), 0.2F);
  EXPECT_EQ(xyz(one.normal()), of.plane.normal);
  EXPECT_EQ(one.offset(), 1.25);
  EXPECT_EQ(xyz(one.pose().position()), of.T_map_surface.translation());
  ASSERT_EQ(one.polygons().size(), 1U);
  ASSERT_EQ(one.polygons()[0].holes().size(), 1U);
  EXPECT_EQ(xyz(one.polygons()[0].outer().points()[2]), of.to_map({0, 3}));
  EXPECT_EQ(xyz(one.polygons()[0].holes()[0].points()[1]), of.to_map({0.1, 0.2}));
  EXPECT_EQ(one.area(), 2.5);
  EXPECT_EQ(one.inliers(), 321U);
  EXPECT_EQ(one.rms(), 0.004);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(one.covariance()[i], static_cast<double>(i) + 0.5);
  EXPECT_EQ(one.born(), 11U);
  EXPECT_EQ(one.revision(), 22U);
  EXPECT_EQ(one.parents(), (std::vector<std::uint32_t>{3, 5}));

  ASSERT_EQ(read.cylinders().size(), 1U);
  const Cylinder_& cylinder = read.cylinders()[0];
  EXPECT_EQ(cylinder.id(), 4U);
  EXPECT_EQ(xyz(cylinder.axis_point()), pole.axis_point);
  EXPECT_EQ(xyz(cylinder.axis()), pole.axis);
  EXPECT_EQ(cylinder.radius(), 0.05);
  EXPECT_EQ(cylinder.length(), 1.5);
  EXPECT_EQ(xyz(cylinder.start()), pole.start);
  EXPECT_EQ(cylinder.span(), 2.5);
  EXPECT_EQ(cylinder.inliers(), 66U);
  EXPECT_EQ(cylinder.rms(), 0.002);
  EXPECT_EQ(cylinder.born(), 8U);
  EXPECT_EQ(cylinder.revision(), 9U);
}

TEST(DdsMessages, StairsHaveAllTheirFields) {
  const Step step{1, 2, 0.17, 1.2, 0.3, {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 5, 6)}};
  const Step kerb{8, 9, 0.12, 3, -0.4, {Eigen::Vector3d(7, 8, 9), Eigen::Vector3d(10, 11, 12)}};
  Stair stair;
  stair.id = 2;
  stair.kind = StairKind::spiral;
  stair.steps = {step, step};
  stair.treads = {2, 3};
  stair.landing_below = 1;
  stair.landing_above = 6;
  stair.riser = {0.17, 0.001};
  stair.tread = {0.28, 0.002};
  stair.width_m = 1.1;
  stair.heading_rad = 0.5;
  stair.turn_rad = 1.5;
  Snapshot snapshot;
  snapshot.revision = 33;
  const Stairs_ read = read_whole<Stairs_PubSubType>([&](io::MessageWriter& out) {
    node::write_stairs(out, {{stair}, {kerb}}, snapshot, "odom", 1'700'000'000'250'000'000);
  });
  EXPECT_EQ(read.header().frame_id(), "odom");
  EXPECT_EQ(read.header().stamp().nanosec(), 250'000'000U);
  EXPECT_EQ(read.revision(), 33U);
  ASSERT_EQ(read.stairs().size(), 1U);
  const Stair_& one = read.stairs()[0];
  EXPECT_EQ(one.id(), 2U);
  EXPECT_EQ(one.kind(), "spiral");
  ASSERT_EQ(one.steps().size(), 2U);
  EXPECT_EQ(one.treads(), (std::vector<std::uint32_t>{2, 3}));
  EXPECT_EQ(one.landing_below(), 1U);
  EXPECT_EQ(one.landing_above(), 6U);
  EXPECT_EQ(one.riser(), 0.17);
  EXPECT_EQ(one.riser_std(), 0.001);
  EXPECT_EQ(one.tread(), 0.28);
  EXPECT_EQ(one.tread_std(), 0.002);
  EXPECT_EQ(one.width(), 1.1);
  EXPECT_EQ(one.heading(), 0.5);
  EXPECT_EQ(one.turn(), 1.5);
  ASSERT_EQ(read.single_steps().size(), 1U);
  const Step_& single = read.single_steps()[0];
  EXPECT_EQ(single.lower(), 8U);
  EXPECT_EQ(single.upper(), 9U);
  EXPECT_EQ(single.riser(), 0.12);
  EXPECT_EQ(single.width(), 3);
  EXPECT_EQ(single.heading(), -0.4);
  EXPECT_EQ(xyz(single.left()), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(xyz(single.right()), Eigen::Vector3d(10, 11, 12));
}

TEST(DdsMessages, RegionsAndFootstepsHaveAllTheirFields) {
  const SurfacePtr on = surface();
  planning::FoundRegion found{on, {}, std::vector<ConvexPiece>(1)};
  found.pieces[0].vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 10}};
  found.region.surface = 7;
  found.region.revision = 22;
  found.region.area_m2 = 0.5;
  found.region.polygons = {{{{0, 0}, {1, 0}, {0, 1}}, {}}};
  found.region.refused = {ContactRefusal::slope, ContactRefusal::clearance};
  const ContactRegion_ region =
      read_whole<ContactRegion_PubSubType>([&](io::MessageWriter& out) { node::write_region(out, found); });
  EXPECT_EQ(region.surface(), 7U);
  EXPECT_EQ(region.revision(), 22U);
  EXPECT_EQ(region.area(), 0.5);
  ASSERT_EQ(region.polygons().size(), 1U);
  EXPECT_EQ(xyz(region.polygons()[0].outer().points()[1]), on->to_map({1, 0}));
  ASSERT_EQ(region.pieces().size(), 1U);
  EXPECT_EQ(xyz(region.pieces()[0].points()[2]), Eigen::Vector3d(7, 8, 10));
  EXPECT_EQ(region.refused(), (std::vector<std::string>{"slope", "clearance"}));

  Footstep step;
  step.foot = FootName::right;
  step.surface = 7;
  step.T_map_foot.translation() = Eigen::Vector3d(1, 2, 3);
  step.yaw_rad = 0.7;
  step.margin_m = 0.03;
  const Footstep_ read =
      read_whole<Footstep_PubSubType>([&](io::MessageWriter& out) { node::write_footstep(out, step); });
  EXPECT_EQ(read.foot(), "right");
  EXPECT_EQ(read.surface(), 7U);
  EXPECT_EQ(xyz(read.pose().position()), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read.pose().orientation().w(), 1);
  EXPECT_EQ(read.yaw(), 0.7);
  EXPECT_EQ(read.margin(), 0.03);
}

}  // namespace
}  // namespace octosurf::test
