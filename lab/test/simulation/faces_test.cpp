// True faces: hand-built solids whose open areas are known, and a slow twin on every scene.
#include "simulation/faces.hpp"

#include "simulation/terrain.hpp"
#include "support/polygons.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

using terrain::area;
using terrain::signed_area;

std::vector<evaluation::TrueFace> named(const Faces& faces, const std::string& name) {
  std::vector<evaluation::TrueFace> found;
  for (const auto& face : faces.all())
    if (face.name == name || face.name.starts_with(name + "#")) found.push_back(face);
  return found;
}

Scene floor_scene() {
  Scene scene;
  add_box(scene, add_object(scene, "floor"), {0, 0, -0.5}, {4, 3, 0});
  return scene;
}

TEST(Faces, WhatStandsOnTheFloorIsCutOut) {
  Scene scene = floor_scene();
  add_box(scene, add_object(scene, "box"), {1, 1, 0}, {1.5, 1.4, 0.3});
  const Faces faces(scene, {});
  const auto floor = named(faces, "floor/top");
  ASSERT_EQ(floor.size(), 1u);
  EXPECT_NEAR(area(floor[0]), 12 - 0.5 * 0.4, 1e-6);
  ASSERT_EQ(floor[0].polygons[0].holes.size(), 1u);
  EXPECT_TRUE(named(faces, "box/bottom").empty()) << "lies on the floor, is open nowhere";
  EXPECT_NEAR(area(named(faces, "box/top").at(0)), 0.2, 1e-6);
  EXPECT_TRUE(named(faces, "box/top")[0].plane.normal.isApprox(Eigen::Vector3d::UnitZ()));
  EXPECT_NEAR(named(faces, "box/top")[0].plane.offset, 0.3, 1e-12);
}

TEST(Faces, WallWithDoorIsOneFaceWithANotch) {
  Scene scene = floor_scene();
  add_wall(scene, add_object(scene, "wall"), {0, 2.85, 0}, {4, 3, 2.5}, {{1, 1.9, 2.05}});
  const Faces faces(scene, {});
  const auto front = named(faces, "wall/front");
  ASSERT_EQ(front.size(), 1u);
  EXPECT_NEAR(area(front[0]), 4 * 2.5 - 0.9 * 2.05, 1e-6);
  EXPECT_TRUE(front[0].polygons[0].holes.empty());
  EXPECT_EQ(named(faces, "floor/top").size(), 1u) << "goes on through the door";
}

TEST(Faces, SideOfAStairIsOneFaceAndEachStepOneOfItsOwn) {
  Scene scene = floor_scene();
  const auto stair = add_object(scene, "stair");
  for (int k = 0; k < 4; ++k)
    add_box(scene, stair, {0, 1 + 0.29 * k, 0}, {1, 1 + 0.29 * (k + 1), 0.17 * (k + 1)});
  const Faces faces(scene, {});
  const auto side = named(faces, "stair/right");
  ASSERT_EQ(side.size(), 1u);
  EXPECT_NEAR(area(side[0]), 0.29 * 0.17 * (1 + 2 + 3 + 4), 1e-6);
  for (const std::string name : {"stair/top", "stair/front"}) {
    const auto steps = named(faces, name);
    ASSERT_EQ(steps.size(), 4u) << name;
    for (const auto& step : steps)
      EXPECT_NEAR(area(step), name == "stair/top" ? 0.29 : 0.17, 1e-6) << step.name;
  }
}

TEST(Faces, CoplanarFacetsThatDoNotAdjoinAreFacesOfTheirOwn) {
  Scene scene = floor_scene();
  const auto posts = add_object(scene, "posts");
  add_box(scene, posts, {1, 1, 0}, {1.2, 1.2, 1});
  add_box(scene, posts, {2, 1, 0}, {2.2, 1.2, 1});
  const Faces faces(scene, {});
  ASSERT_EQ(named(faces, "posts/front").size(), 2u);
  std::size_t facet = 6;  // the first post's first facet is its front
  const auto left = faces.label(facet, {1.1, 1, 0.5});
  facet += 6;
  const auto right = faces.label(facet, {2.1, 1, 0.5});
  EXPECT_NE(left, right);
  EXPECT_TRUE(faces.all()[left - 1].name.starts_with("posts/front"));
  EXPECT_TRUE(faces.all()[right - 1].name.starts_with("posts/front"));
}

TEST(Faces, CurvedThingsHaveNoFacesButCutHoles) {
  Scene scene = floor_scene();
  add_cylinder(scene, add_object(scene, "pillar"), {2, 1.5, 0}, 0.2, 2);
  const Faces faces(scene, {});
  EXPECT_EQ(faces.all().size(), 6u + 1u) << "the floor slab's and the pillar's top";
  EXPECT_NEAR(area(named(faces, "floor/top").at(0)), 12 - std::numbers::pi * 0.04, 1e-3);
  EXPECT_EQ(faces.label(6, {2.2, 1.5, 1}), 0);
}

TEST(Faces, FollowTheWorldsTurnShiftAndScale) {
  Scene scene = floor_scene();
  add_box(scene, add_object(scene, "box"), {1, 1, 0}, {1.5, 1.4, 0.3});
  Similarity T;
  T.scale = 1.1;
  T.R = (Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
  T.t = {3, -2, 0.5};
  const Faces here(scene, {});
  const Faces there(scene, T);
  ASSERT_EQ(here.all().size(), there.all().size());
  for (std::size_t i = 0; i < here.all().size(); ++i) {
    EXPECT_NEAR(area(there.all()[i]), 1.21 * area(here.all()[i]), 1e-9);
    const auto& p = here.all()[i].polygons[0].outer[0];
    const auto& q = there.all()[i].polygons[0].outer[0];
    const Eigen::Vector3d moved = T * (here.all()[i].T_map_face * Eigen::Vector3d(p.x(), p.y(), 0));
    const Eigen::Vector3d found = there.all()[i].T_map_face * Eigen::Vector3d(q.x(), q.y(), 0);
    EXPECT_LT((moved - found).norm(), 1e-9);
    EXPECT_NEAR(there.all()[i].plane.signed_distance(moved), 0, 1e-9);
  }
}

class EveryScene : public testing::TestWithParam<std::string> {};

TEST_P(EveryScene, PolygonsAreValid) {
  for (const std::uint64_t seed : test::seeds(8)) {
    const Faces faces(make_scene(GetParam(), Random(seed, 1), 12), {});
    ASSERT_FALSE(faces.all().empty());
    std::uint32_t id = 0;
    for (const auto& face : faces.all()) {
      EXPECT_EQ(face.id, ++id);
      ASSERT_EQ(face.polygons.size(), 1u);
      const auto& polygon = face.polygons[0];
      EXPECT_GT(signed_area(polygon.outer), 0) << face.name << " seed " << seed;
      for (const auto& hole : polygon.holes) EXPECT_LT(signed_area(hole), 0) << face.name << " seed " << seed;
      EXPECT_EQ(test::invalid(face.polygons), "") << face.name << " seed " << seed;
    }
  }
}

/// The slow twin: `p` is inside a solid if it is behind all of its facets.
bool inside(const Solid& solid, const Eigen::Vector3d& p) {
  for (const auto& facet : solid.facets) {
    const Eigen::Vector3d n = (facet.ring[1] - facet.ring[0]).cross(facet.ring[2] - facet.ring[0]);
    if (n.dot(p - facet.ring[0]) > 0) return false;
  }
  return true;
}

/// Solid just below the face, none just above it.
bool is_open(const Scene& scene, const std::string& object, int phase, const Eigen::Vector3d& p,
             const Eigen::Vector3d& n) {
  bool below = false;
  for (const auto& solid : scene.solids) {
    const auto& owner = scene.objects[solid.object];
    if (owner.stands[phase] && inside(solid, p + 1e-4 * n)) return false;
    below = below || (owner.name == object && inside(solid, p - 1e-4 * n));
  }
  return below;
}

TEST_P(EveryScene, PolygonsAgreeWithPointwiseTwin) {
  for (const std::uint64_t seed : test::seeds(3)) {
    const Scene scene = make_scene(GetParam(), Random(seed, 1), 8);
    const Faces faces(scene, {});
    Random random(seed, 77);
    std::size_t compared = 0;
    for (const auto& face : faces.all()) {
      Eigen::AlignedBox2d box;
      for (const auto& p : face.polygons[0].outer) box.extend(p);
      const std::string object = face.name.substr(0, face.name.find('/'));
      const Eigen::Vector3d n = face.plane.normal;
      for (int k = 0; k < 20; ++k) {
        const Eigen::Vector2d p(random.uniform(box.min().x(), box.max().x()),
                                random.uniform(box.min().y(), box.max().y()));
        // Near an edge either answer will do.
        bool all = true, any = false;
        for (const Eigen::Vector2d& off : {Eigen::Vector2d(1e-3, 0), Eigen::Vector2d(-1e-3, 0),
                                           Eigen::Vector2d(0, 1e-3), Eigen::Vector2d(0, -1e-3)}) {
          const Eigen::Vector3d q = face.T_map_face * Eigen::Vector3d(p.x() + off.x(), p.y() + off.y(), 0);
          const bool open = is_open(scene, object, face.gone ? 0 : 1, q, n);
          all = all && open;
          any = any || open;
        }
        if (all != any) continue;
        // A plane's other faces hold what this one does not.
        bool held = false;
        for (const auto& other : faces.all())
          if (other.T_map_face.isApprox(face.T_map_face, 0)) held = held || contains(other.polygons[0], p);
        EXPECT_EQ(held, all) << face.name << " seed " << seed << " at " << p.transpose();
        ++compared;
      }
    }
    EXPECT_GT(compared, 200u);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(scene_names()));

TEST(Scenes, UnknownNameIsRefusedWithThoseKnown) {
  try {
    make_scene("moon", Random(1, 1), 20);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), Error::Kind::usage);
    EXPECT_NE(std::string(e.what()).find("office"), std::string::npos);
  }
}

}  // namespace
}  // namespace octosurf::simulation
