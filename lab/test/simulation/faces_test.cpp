// True faces: hand-built solids whose open areas are known, and a slow twin on every scene.
#include "simulation/faces.hpp"

#include "simulation/terrain.hpp"
#include "support/polygons.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <numbers>

namespace octosurf::simulation {
namespace {

using terrain::area;

/// The faces of that name, numbered or not, which are to have these areas.
std::vector<evaluation::TrueFace> expect_faces(const Faces& faces, const std::string& name,
                                               const std::vector<double>& areas) {
  std::vector<evaluation::TrueFace> found;
  for (const auto& face : faces.all())
    if (face.name == name || face.name.starts_with(name + "#")) found.push_back(face);
  EXPECT_EQ(found.size(), areas.size()) << name;
  for (std::size_t i = 0; i < std::min(found.size(), areas.size()); ++i)
    EXPECT_NEAR(area(found[i]), areas[i], 1e-6) << found[i].name;
  return found;
}

Scene floor_scene() {
  Scene scene;
  add_box(scene, add_object(scene, "floor"), {0, 0, -0.5}, {4, 3, 0});
  return scene;
}

TEST(Faces, SideOfAStairIsOneFaceAndEachStepOneOfItsOwn) {
  Scene scene = floor_scene();
  const auto stair = add_object(scene, "stair");
  for (int k = 0; k < 4; ++k)
    add_box(scene, stair, {0, 1 + 0.29 * k, 0}, {1, 1 + 0.29 * (k + 1), 0.17 * (k + 1)});
  const Faces faces(scene, {});
  expect_faces(faces, "stair/right", {0.29 * 0.17 * (1 + 2 + 3 + 4)});
  expect_faces(faces, "stair/top", {0.29, 0.29, 0.29, 0.29});
  expect_faces(faces, "stair/front", {0.17, 0.17, 0.17, 0.17});
}

TEST(Faces, CoplanarFacetsThatDoNotAdjoinAreFacesOfTheirOwn) {
  Scene scene = floor_scene();
  const auto posts = add_object(scene, "posts");
  add_box(scene, posts, {1, 1, 0}, {1.2, 1.2, 1});
  add_box(scene, posts, {2, 1, 0}, {2.2, 1.2, 1});
  const Faces faces(scene, {});
  expect_faces(faces, "posts/front", {0.2, 0.2});
  std::size_t facet = 0;
  for (const double x : {1.1, 2.1}) {
    const Eigen::Vector3d p(x, 1, 0.5);
    const auto& face = faces.all().at(faces.label(facet += 6, p) - 1);  // a solid's first facet is its front
    EXPECT_TRUE(face.name.starts_with("posts/front"));
    EXPECT_TRUE(contains(face.polygons[0], (face.T_map_face.inverse() * p).head<2>()));
  }
}

TEST(Faces, CurvedThingsHaveNoFacesButCutHoles) {
  Scene scene = floor_scene();
  add_cylinder(scene, add_object(scene, "pillar"), {2, 1.5, 0}, 0.2, 2);
  const Faces faces(scene, {});
  EXPECT_EQ(faces.all().size(), 6u + 1u) << "the floor slab's and the pillar's top";
  const auto floor = std::ranges::find(faces.all(), "floor/top", &evaluation::TrueFace::name);
  ASSERT_NE(floor, faces.all().end());
  EXPECT_NEAR(area(*floor), 12 - std::numbers::pi * 0.04, 1e-3);
  EXPECT_EQ(faces.label(6, {2.2, 1.5, 1}), 0);
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

TEST_P(EveryScene, PolygonsAgreeWithPointwiseTwinInATurnedShiftedAndScaledWorld) {
  Similarity T;
  T.scale = 1.1;
  T.R = (Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
  T.t = {3, -2, 0.5};
  for (const std::uint64_t seed : test::seeds(3)) {
    const Scene scene = make_scene(GetParam(), Random(seed, 1), 8);
    const Faces faces(scene, T);
    Random random(seed, 77);
    std::size_t compared = 0;
    for (const auto& face : faces.all()) {
      Eigen::AlignedBox2d box;
      for (const auto& p : face.polygons[0].outer) box.extend(p);
      const std::string object = face.name.substr(0, face.name.find('/'));
      const Eigen::Vector3d n = T.R.transpose() * face.plane.normal;
      for (int k = 0; k < 20; ++k) {
        const Eigen::Vector2d p(random.uniform(box.min().x(), box.max().x()),
                                random.uniform(box.min().y(), box.max().y()));
        // Near an edge either answer will do.
        int open = 0;
        for (const Eigen::Vector2d& off : {Eigen::Vector2d(1e-3, 0), Eigen::Vector2d(-1e-3, 0),
                                           Eigen::Vector2d(0, 1e-3), Eigen::Vector2d(0, -1e-3)}) {
          const Eigen::Vector3d q = face.T_map_face * Eigen::Vector3d(p.x() + off.x(), p.y() + off.y(), 0);
          ASSERT_NEAR(face.plane.signed_distance(q), 0, 1e-9);
          open += is_open(scene, object, face.gone ? 0 : 1, T.R.transpose() * (q - T.t) / T.scale, n);
        }
        if (open != 0 && open != 4) continue;
        // A plane's other faces hold what this one does not.
        const bool held = std::ranges::any_of(faces.all(), [&](const auto& other) {
          return other.T_map_face.isApprox(face.T_map_face, 0) && contains(other.polygons[0], p);
        });
        EXPECT_EQ(held, open == 4) << face.name << " seed " << seed << " at " << p.transpose();
        ++compared;
      }
    }
    EXPECT_GT(compared, 200u);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(scene_names()));

}  // namespace
}  // namespace octosurf::simulation
