// What the node writes, field by field, as the .msg files define it.
#include "node/messages.hpp"

#include "dds/messages.hpp"

namespace octosurf::test {
namespace {

constexpr std::int64_t stamp_ns = 1'700'000'000'250'000'000;

/// Whether a message is what this says.
void expect(const std::string& type, const std::function<void(io::MessageWriter&)>& message,
            const char* json) {
  EXPECT_EQ(decoded(type, io::cdr_of(message)), Json::parse(json));
}

/// Level, seen from below: to_map(u, v) is (u, -v, 1.25).
SurfacePtr surface() {
  Surface surface;
  surface.id = 7;
  surface.color = {0.1F, 0.2F, 0.3F};
  surface.plane.normal = Eigen::Vector3d(0, 0, -1);
  surface.plane.offset = -1.25;
  surface.T_map_surface.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  surface.T_map_surface.translation().z() = 1.25;
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

TEST(NodeMessages, SurfacesAndCylindersHaveAllTheirFields) {
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
  expect(
      "octosurf_msgs/Surfaces", [&](auto& out) { node::write_surfaces(out, snapshot, "odom", stamp_ns); }, R"(
    {"header": {"frame_id": "odom", "stamp": {"sec": 1700000000, "nanosec": 250000000}}, "revision": 33,
     "resolution": 0.02, "surfaces": [
      {"id": 7, "color": {"r": 0.1, "g": 0.2, "b": 0.3, "a": 1}, "normal": {"x": 0, "y": 0, "z": -1}, "offset": -1.25,
       "pose": {"position": {"x": 0, "y": 0, "z": 1.25}, "orientation": {"x": 1, "y": 0, "z": 0, "w": 0}},
       "polygons": [{
         "outer": {"points": [{"x": 0, "y": 0, "z": 1.25}, {"x": 2, "y": 0, "z": 1.25}, {"x": 0, "y": -3, "z": 1.25}]},
         "holes": [{"points": [{"x": 0.1, "y": -0.1, "z": 1.25}, {"x": 0.1, "y": -0.2, "z": 1.25},
                               {"x": 0.2, "y": -0.1, "z": 1.25}]}]}],
       "area": 2.5, "inliers": 321, "rms": 0.004, "covariance": [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5],
       "born": 11, "revision": 22, "parents": [3, 5]}],
     "cylinders": [
      {"id": 4, "axis_point": {"x": 1, "y": 2, "z": 3}, "axis": {"x": 1, "y": 0, "z": 0}, "radius": 0.05, "length": 1.5,
       "start": {"x": 0, "y": 1, "z": 0}, "span": 2.5, "inliers": 66, "rms": 0.002, "born": 8, "revision": 9}]})");

  const auto write = [&](auto& out) { node::write_markers(out, snapshot, "odom", stamp_ns); };
  const Json markers = decoded("visualization_msgs/MarkerArray", io::cdr_of(write)).at("markers");
  ASSERT_EQ(markers.size(), 2U);
  EXPECT_EQ(markers[0].at("action"), 3);  // delete all
  std::vector<Eigen::Vector3d> at;
  for (const Json& p : markers[1].at("points")) at.emplace_back(p.at("x"), p.at("y"), p.at("z"));
  ASSERT_EQ(at.size() % 3, 0U);
  double area = 0;  // of triangles
  for (std::size_t i = 0; i < at.size(); i += 3)
    area += (at[i + 1] - at[i]).cross(at[i + 2] - at[i]).norm() / 2;
  EXPECT_NEAR(area, 3 - 0.005, 0.01);
}

TEST(NodeMessages, StairsHaveAllTheirFields) {
  const Step step{1, 2, 0.17, 1.2, 0.3, {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 5, 6)}};
  const Step kerb{8, 9, 0.12, 3, -0.4, {Eigen::Vector3d(7, 8, 9), Eigen::Vector3d(10, 11, 12)}};
  Stair stair;
  stair.id = 2;
  stair.kind = StairKind::spiral;
  stair.steps = {step, kerb};
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
  const auto write = [&](auto& out) {
    node::write_stairs(out, {{stair}, {kerb}}, snapshot, "odom", stamp_ns);
  };
  expect("octosurf_msgs/Stairs", write, R"(
    {"header": {"frame_id": "odom", "stamp": {"sec": 1700000000, "nanosec": 250000000}}, "revision": 33, "stairs": [
      {"id": 2, "kind": "spiral", "steps": [
        {"lower": 1, "upper": 2, "riser": 0.17, "width": 1.2, "heading": 0.3,
         "left": {"x": 1, "y": 2, "z": 3}, "right": {"x": 4, "y": 5, "z": 6}},
        {"lower": 8, "upper": 9, "riser": 0.12, "width": 3, "heading": -0.4,
         "left": {"x": 7, "y": 8, "z": 9}, "right": {"x": 10, "y": 11, "z": 12}}],
       "treads": [2, 3], "landing_below": 1, "landing_above": 6, "riser": 0.17, "riser_std": 0.001, "tread": 0.28,
       "tread_std": 0.002, "width": 1.1, "heading": 0.5, "turn": 1.5}],
     "single_steps": [
       {"lower": 8, "upper": 9, "riser": 0.12, "width": 3, "heading": -0.4,
        "left": {"x": 7, "y": 8, "z": 9}, "right": {"x": 10, "y": 11, "z": 12}}]})");
}

TEST(NodeMessages, RegionsAndFootstepsHaveAllTheirFields) {
  planning::FoundRegion found{surface(), {}, std::vector<ConvexPiece>(1)};
  found.pieces[0].vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 10}};
  found.region.surface = 7;
  found.region.revision = 22;
  found.region.area_m2 = 0.5;
  found.region.polygons = {{{{0, 0}, {1, 0}, {0, 1}}, {}}};
  found.region.refused = {ContactRefusal::slope, ContactRefusal::clearance};
  expect(
      "octosurf_msgs/ContactRegion", [&](auto& out) { node::write_region(out, found); }, R"(
    {"surface": 7, "revision": 22, "area": 0.5, "polygons": [
      {"outer": {"points": [{"x": 0, "y": 0, "z": 1.25}, {"x": 1, "y": 0, "z": 1.25}, {"x": 0, "y": -1, "z": 1.25}]},
       "holes": []}],
     "pieces": [{"points": [{"x": 1, "y": 2, "z": 3}, {"x": 4, "y": 5, "z": 6}, {"x": 7, "y": 8, "z": 10}]}],
     "refused": ["slope", "clearance"]})");
  Footstep step;
  step.foot = FootName::right;
  step.surface = 7;
  step.T_map_foot.translation() = Eigen::Vector3d(1, 2, 3);
  step.yaw_rad = 0.7;
  step.margin_m = 0.03;
  expect(
      "octosurf_msgs/Footstep", [&](auto& out) { node::write_footstep(out, step); }, R"(
    {"foot": "right", "surface": 7, "yaw": 0.7, "margin": 0.03,
     "pose": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}})");
}

}  // namespace
}  // namespace octosurf::test
