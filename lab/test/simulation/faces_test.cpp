// True faces: hand-built solids whose open areas are known, and a slow twin on every scene.
#include "simulation/faces.hpp"

#include "simulation/mesh_faces.hpp"
#include "simulation/random.hpp"
#include "simulation/terrain.hpp"
#include "surfaces/blobs.hpp"

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

// True faces of meshes: hand-made terrains whose faces are known, and a slow twin on heaps of boxes.

using octosurf::test::random_pose;
using terrain::Triangles;

Triangles moved(Triangles triangles, const Eigen::Isometry3d& T) {
  for (auto& triangle : triangles)
    for (auto& v : triangle) v = T * v;
  return triangles;
}

class MeshFacesTest : public terrain::TerrainTest {
 protected:
  std::vector<evaluation::TrueFace> faces_of(const Triangles& triangles) const {
    return Faces(find_mesh_faces(mesh_of(triangles)), {}).all();
  }

  /// The faces whose normals are `normal` and that lie `offset` along it have these areas; descending.
  static void expect_areas(const std::vector<evaluation::TrueFace>& faces, const Eigen::Vector3d& normal,
                           double offset, const std::vector<double>& areas) {
    std::vector<double> found;
    for (const auto& face : faces)
      if (face.plane.normal.dot(normal) > 1 - 1e-8 && std::abs(face.plane.offset - offset) < 1e-5)
        found.push_back(area(face));
    std::sort(found.rbegin(), found.rend());
    EXPECT_THAT(found, testing::Pointwise(testing::DoubleNear(1e-4), areas))
        << normal.transpose() << " at " << offset;
  }
};

const Eigen::Vector3d X = Eigen::Vector3d::UnitX(), Y = Eigen::Vector3d::UnitY(),
                      Z = Eigen::Vector3d::UnitZ();

TEST_F(MeshFacesTest, StairHasItsTreadsRisersAndSidesHoweverItsTrianglesAreWound) {
  Triangles stair = terrain::stair(4);
  for (const bool turned : {false, true}) {
    Random random(octosurf::test::seed(), 2);
    for (auto& t : stair)
      if (turned && random.uniform() < 0.5) std::swap(t[0], t[1]);
    const auto faces = faces_of(stair);
    for (int k = 0; k < 4; ++k) {
      expect_areas(faces, Z, 0.17 * (k + 1), {0.29});
      expect_areas(faces, -X, -1 - 0.29 * k, {0.17});
    }
    const double side = 0.29 * 0.17 * (1 + 2 + 3 + 4);
    expect_areas(faces, -Y, -0.5, {side});  // four boxes' sides are one face
    expect_areas(faces, Y, 1.5, {side});
    expect_areas(faces, X, 1 + 4 * 0.29, {4 * 0.17});
    expect_areas(faces, Z, 0, {8 - 4 * 0.29});  // the ground, without what the stair stands on
    expect_areas(faces, -Z, 0, {8.0});          // the sheet's other side, free of steps
    EXPECT_EQ(faces.size(), 4u + 4 + 2 + 1 + 2) << "nothing between the steps and nothing under them";
  }
}

TEST_F(MeshFacesTest, WhatTouchesAtATIsOneFace) {
  // The corners of the second and third box lie on the first one's edge, a float's rounding off it.
  Triangles triangles;
  terrain::add_box(triangles, {0, 0, 0}, {1, 3, 0.3});
  terrain::add_box(triangles, {1, 0.2, 0}, {2, 1.3, 0.3});
  terrain::add_box(triangles, {1, 1.3, 0}, {1.7, 2.6, 0.3});
  std::mt19937_64 random = octosurf::test::rng();
  const Eigen::Isometry3d T = random_pose(random, 1);
  const auto faces = faces_of(moved(triangles, T));
  const Eigen::Vector3d up = T.linear() * Z;
  expect_areas(faces, up, 0.3 + up.dot(T.translation()), {3 + 1.1 + 0.7 * 1.3});
  expect_areas(faces, -up, -up.dot(T.translation()), {3 + 1.1 + 0.7 * 1.3});
}

TEST_F(MeshFacesTest, PiecesThatDoNotTouchOrAreAStepApartAreFacesOfTheirOwn) {
  const auto level_areas = [this](double gap, double step) {
    Triangles triangles;
    terrain::add_box(triangles, {0, 0, 0}, {1, 1, 0.3});
    terrain::add_box(triangles, {1 + gap, 0, 0}, {2, 1, 0.3 + step});
    std::vector<double> found;
    for (const auto& face : faces_of(triangles))
      if (face.plane.normal.z() > 0.99) found.push_back(area(face));
    return found;
  };
  EXPECT_THAT(level_areas(0.005, 0), testing::Pointwise(testing::DoubleNear(1e-4), {1.0, 0.995}));
  EXPECT_EQ(level_areas(0, 0.003).size(), 2u);
  EXPECT_EQ(level_areas(0, 0.0002).size(), 1u);
}

TEST_F(MeshFacesTest, ABoxWithoutBottomHidesItsInsideOneWithoutASideShowsIt) {
  Triangles ground;
  terrain::add_quad(ground, {{{-1, -1, 0}, {2, -1, 0}, {2, 2, 0}, {-1, 2, 0}}});
  Triangles box;
  terrain::add_box(box, {0, 0, 0}, {1, 1, 0.5});
  const auto without = [&](std::size_t quad) {
    Triangles triangles = ground;
    for (std::size_t i = 0; i < box.size(); ++i)
      if (i / 2 != quad) triangles.push_back(box[i]);
    return faces_of(triangles);
  };
  const auto no_bottom = without(0);
  EXPECT_EQ(no_bottom.size(), 5u + 2);
  expect_areas(no_bottom, Z, 0, {8});
  const auto no_side = without(3);       // +x
  expect_areas(no_side, Z, 0, {9});      // the ground goes on into the box
  expect_areas(no_side, -Z, -0.5, {1});  // its ceiling
  expect_areas(no_side, X, 0, {0.5});    // its back, from inside
}

TEST_F(MeshFacesTest, ARaysSideTellsWhichFaceItHit) {
  Triangles sheet;
  terrain::add_quad(sheet, {{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}});
  const Faces faces(find_mesh_faces(mesh_of(sheet)), {});
  ASSERT_EQ(faces.all().size(), 2u);
  for (const double z : {-1.0, 1.0}) {
    const auto label = faces.label(0, {0.6, 0.4, 1}, {0.1, 0.2, z});
    ASSERT_GE(label, 1);
    EXPECT_EQ(faces.all()[label - 1].plane.normal.z() < 0, z > 0) << "seen from where the ray came";
  }
}

/// A box and the way to tell what is inside of it: the slow twin.
struct Block {
  Eigen::Isometry3d T;
  Eigen::Vector3d half;
  bool holds(const Eigen::Vector3d& p, double margin) const {
    return ((T.inverse() * p).cwiseAbs() - half).maxCoeff() < margin;
  }
};

TEST_F(MeshFacesTest, HeapsOfBoxesAgreeWithThePointwiseTwin) {
  const auto seed = octosurf::test::seed();
  for (std::uint64_t heap = 0; heap < 3; ++heap) {
    Random random(seed, 100 + heap);
    std::mt19937_64 poses(seed + heap);
    std::vector<Block> blocks;
    Triangles triangles;
    for (int i = 0; i < 12; ++i) {
      Eigen::Isometry3d T = random_pose(poses, 1);
      if (i < 4) T.linear() = Eigen::AngleAxisd(random.uniform(0, 3), Z).toRotationMatrix();
      const Eigen::Vector3d half(random.uniform(0.1, 0.6), random.uniform(0.1, 0.6),
                                 random.uniform(0.05, 0.4));
      blocks.push_back({T, half});
      terrain::add_box(triangles, -half, half, T);
    }
    const auto faces = faces_of(triangles);
    std::size_t compared = 0, open = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b)
      for (int k = 0; k < 120; ++k) {
        const int axis = k % 3;
        const double sign = k % 2 == 0 ? 1 : -1;
        Eigen::Vector3d p = blocks[b].half.cwiseProduct(Eigen::Vector3d(
            random.uniform(-0.98, 0.98), random.uniform(-0.98, 0.98), random.uniform(-0.98, 0.98)));
        p[axis] = sign * blocks[b].half[axis];
        const Eigen::Vector3d q = blocks[b].T * p;
        const Eigen::Vector3d n = blocks[b].T.linear() * (sign * Eigen::Vector3d::Unit(axis));
        // Where another box's surface is within 2 mm either answer will do.
        bool hidden = false, near = false;
        for (std::size_t other = 0; other < blocks.size(); ++other) {
          if (other == b) continue;
          hidden = hidden || blocks[other].holds(q, 0);
          near = near || blocks[other].holds(q, 2e-3) != blocks[other].holds(q, -2e-3);
        }
        if (near) continue;
        bool held = false;
        for (const auto& face : faces) {
          const Eigen::Vector3d local = face.T_map_face.inverse() * q;
          held = held || (face.plane.normal.dot(n) > 1 - 1e-6 && std::abs(local.z()) < 1e-4 &&
                          contains(face.polygons[0], local.head<2>()));
        }
        // A hollow between boxes that light cannot leave is no place a sensor sees: it may be left out.
        EXPECT_FALSE(held && hidden) << "seed " << seed << " heap " << heap << " box " << b;
        open += !hidden;
        compared += held == !hidden;
      }
    EXPECT_GT(open, 200u);
    EXPECT_GE(static_cast<double>(compared), 0.99 * 12 * 120 * 0.9) << "seed " << seed << " heap " << heap;
  }
}

}  // namespace
}  // namespace octosurf::simulation
