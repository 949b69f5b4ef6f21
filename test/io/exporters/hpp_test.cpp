// Pieces for hpp-affordance, read by Assimp and judged by affordanceAnalysis()' rules
// (hpp-affordance src/affordance-extraction.cc, include/hpp/affordance/operations.hh).
#include "io/exporters/planner_fixture.hpp"

#include <assimp/Importer.hpp>
#include <assimp/scene.h>
#include <fstream>
#include <iterator>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;

struct Triangle {
  std::array<Eigen::Vector3f, 3> corners;
  Eigen::Vector3f normal() const {
    return (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  }
  double area() const { return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm(); }
};

std::vector<Triangle> read_stl(const fs::path& file) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), 0u);
  EXPECT_NE(scene, nullptr) << importer.GetErrorString();
  std::vector<Triangle> triangles;
  for (unsigned m = 0; scene != nullptr && m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      Triangle triangle;
      for (unsigned c = 0; c < 3; ++c) {
        const aiVector3D& v = mesh.mVertices[mesh.mFaces[f].mIndices[c]];
        triangle.corners[c] = {v.x, v.y, v.z};
      }
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

/// Its neighbours: a vertex in common to a squared distance of 1e-15, and normals to 0.3.
bool are_neighbours(const Triangle& a, const Triangle& b) {
  for (const Eigen::Vector3f& p : a.corners)
    for (const Eigen::Vector3f& q : b.corners)
      if ((p - q).squaredNorm() < 1e-15F) return (a.normal() - b.normal()).squaredNorm() < 0.3F;
  return false;
}

/// Support affordances of one object: areas of the joined triangles whose |z − n|² < 0.3, over 0.05 m².
std::vector<double> support_areas(const std::vector<Triangle>& triangles) {
  std::vector<std::size_t> group(triangles.size());
  for (std::size_t i = 0; i < group.size(); ++i) group[i] = i;
  const auto is_support = [&](std::size_t i) {
    return (Eigen::Vector3f::UnitZ() - triangles[i].normal()).squaredNorm() < 0.3F;
  };
  for (std::size_t sweep = 0; sweep < triangles.size(); ++sweep)
    for (std::size_t i = 0; i < triangles.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        if (is_support(i) && is_support(k) && are_neighbours(triangles[i], triangles[k]))
          group[i] = group[k] = std::min(group[i], group[k]);
  std::map<std::size_t, double> areas;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (is_support(i)) areas[group[i]] += triangles[i].area();
  std::vector<double> large;
  for (const auto& [first, area] : areas)
    if (area > 0.05) large.push_back(area);
  return large;
}

class Hpp : public PlannerFormats {};

TEST_F(Hpp, EveryPieceIsOneSupportAffordanceOfItsArea) {
  std::mt19937_64 random = rng();
  for (int round = 0; round < 30; ++round) {
    std::uniform_real_distribution<double> tilt(0, 25 * std::numbers::pi / 180);
    PlannerSurface surface = random_surface(random, 9, tilt(random));
    const Ring2 ring = random_convex(random, 1);
    surface.pieces = {piece_on(surface, ring)};
    ASSERT_EQ(export_hpp({surface}, path("stl"), true), 1u);
    const std::vector<Triangle> triangles = read_stl(path("stl/surface_9_1.stl"));
    const Eigen::Vector3f normal = surface.T_world_surface.linear().col(2).cast<float>();
    for (const Triangle& triangle : triangles) EXPECT_GT(triangle.normal().dot(normal), 0.9998F);  // 1.1°
    const double area = shapes::ring_area(ring);
    double sum = 0;
    for (const Triangle& triangle : triangles) sum += triangle.area();
    EXPECT_NEAR(sum, area, 1e-3 * area);
    if (area < 0.06) continue;
    const std::vector<double> supports = support_areas(triangles);
    ASSERT_EQ(supports.size(), 1u);
    EXPECT_NEAR(supports[0], area, 1e-3 * area);
  }
}

TEST_F(Hpp, WallsLeanAndAreNoSupport) {
  PlannerSurface wall;
  wall.id = 2;
  wall.T_world_surface.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // normal −y
  wall.pieces = {piece_on(wall, shapes::box(0, 0, 1, 1))};
  export_hpp({wall}, path("stl"));
  const auto triangles = read_stl(path("stl/surface_2_1.stl"));
  EXPECT_TRUE(support_areas(triangles).empty());
  for (const Triangle& triangle : triangles) EXPECT_LT(std::abs(triangle.normal().z()), 0.3F);
}

TEST_F(Hpp, SurfacesThatShareAnEdgeShareNoVertex) {
  // A floor and a ramp of 10° that begins on its edge, both cut right there: less than 31°, so hpp would
  // join.
  PlannerSurface floor, ramp;
  floor.id = 1;
  floor.T_world_surface.translation() = Eigen::Vector3d(20, 30, 1);
  floor.pieces = {piece_on(floor, shapes::box(-1, 0, 1, 1))};
  ramp.id = 2;
  ramp.T_world_surface.linear() = Eigen::AngleAxisd(-0.175, Eigen::Vector3d::UnitY()).toRotationMatrix();
  ramp.T_world_surface.translation() = floor.T_world_surface.translation();
  ramp.pieces = {piece_on(ramp, shapes::box(0, 0, 1, 1)), piece_on(ramp, shapes::box(1, 0, 1, 1))};
  ASSERT_EQ(export_hpp({floor, ramp}, path("stl")), 3u);
  const auto a = read_stl(path("stl/surface_1_1.stl")), b = read_stl(path("stl/surface_2_1.stl")),
             c = read_stl(path("stl/surface_2_2.stl"));
  for (const Triangle& s : a)
    for (const Triangle& t : b) {
      EXPECT_FALSE(are_neighbours(s, t));
      for (const Eigen::Vector3f& p : s.corners)
        for (const Eigen::Vector3f& q : t.corners) EXPECT_GT((p - q).norm(), 0.9e-6F);
    }
  // What was moved stays within the piece, by less than 0.1 mm.
  double sum = 0;
  for (const Triangle& t : b) sum += t.area();
  EXPECT_NEAR(sum, 1, 1e-4);
  EXPECT_LT(sum, 1 + 1e-6);
  // Pieces of one surface do share them, to the bit.
  int shared = 0;
  for (const Triangle& s : b)
    for (const Triangle& t : c)
      for (const Eigen::Vector3f& p : s.corners)
        for (const Eigen::Vector3f& q : t.corners) shared += p == q;
  EXPECT_GT(shared, 1);
}

TEST_F(Hpp, FlatCornersAreLeftOutAndThePieceStaysInside) {
  PlannerSurface surface = random_surface(*std::make_unique<std::mt19937_64>(rng()), 4, 0.3);
  Ring2 ring{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  ring.insert(ring.begin() + 1, {0.5, -1e-7});  // floats at 8 m are 1e-6 apart
  ring.push_back({0, 0.5});
  surface.pieces = {piece_on(surface, ring)};
  export_hpp({surface}, path("stl"));
  EXPECT_EQ(read_stl(path("stl/surface_4_1.stl")).size(), 2u);
}

TEST_F(Hpp, OnlyFoldersOfItsOwnAreReplaced) {
  PlannerSurface table = table_with_hole(5);
  EXPECT_EQ(export_hpp({table}, path("stl")), 4u);
  EXPECT_THROW(export_hpp({table}, path("stl")), Error);
  table.pieces.resize(1);
  EXPECT_EQ(export_hpp({table}, path("stl/"), true), 1u);
  EXPECT_EQ(std::distance(fs::directory_iterator(path("stl")), {}), 1);
  std::ofstream(path("stl/notes.txt")) << "precious";
  EXPECT_THROW(export_hpp({table}, path("stl"), true), Error);
  EXPECT_TRUE(fs::exists(path("stl/notes.txt")));
  EXPECT_THROW(export_hpp({table}, path("missing/stl")), Error);
  table.pieces.clear();
  EXPECT_THROW(export_hpp({table}, path("none")), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);  // nothing half-made is left
}

}  // namespace
}  // namespace octosurf::test
