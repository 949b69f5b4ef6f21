// Meshes as scenes: the way over them, what is recorded on it, and a map of it scored against its truth.
#include "accuracy/simulated_map.hpp"
#include "evaluation/evaluate.hpp"
#include "simulation/mesh_walk.hpp"
#include "simulation/recording.hpp"
#include "simulation/terrain.hpp"
#include "simulation/trajectory.hpp"
#include "support/paths.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::simulation {
namespace {

namespace fs = std::filesystem;

using terrain::area;
using terrain::Triangles;

Eigen::Vector3d look(const View& view) { return (view.target - view.eye).normalized(); }

class MeshWalk : public terrain::TerrainTest {};

TEST_F(MeshWalk, OverLevelGroundTheCameraIsCarriedEvenlyAndLooksAheadAndDown) {
  Triangles ground;
  terrain::add_quad(ground, {{{-1, -2, 0.7}, {4, -2, 0.7}, {4, 0, 0.7}, {-1, 0, 0.7}}});
  const auto mesh = mesh_of(ground);
  for (const std::uint64_t seed : octosurf::test::seeds(20)) {
    const auto path = walk_over(mesh, Random(seed, 2));
    std::set<double> heights, lanes;
    std::size_t there = 0;
    for (const auto& view : path) {
      heights.insert(std::round((view.eye.z() - 0.7) * 1e4) / 1e4);
      lanes.insert(std::round(view.eye.y() * 1e3));
      const double down_deg = std::asin(-look(view).z()) * 180 / std::numbers::pi;
      EXPECT_TRUE(down_deg >= 30 && down_deg <= 40) << down_deg;
      EXPECT_NEAR(look(view).y(), 0, 1e-9) << "along the longer side";
      there += look(view).x() > 0;
    }
    ASSERT_EQ(heights.size(), 1u);
    EXPECT_TRUE(*heights.begin() >= 0.5 && *heights.begin() <= 0.6);
    EXPECT_EQ(lanes.size(), 3u) << "2 m wide";
    EXPECT_EQ(there * 2, path.size()) << "there and back";
  }
}

TEST_F(MeshWalk, OverAStairItRisesWithTheStepsAndNeverComesNear) {
  const auto mesh = mesh_of(terrain::stair(6));
  for (const auto& view : walk_over(mesh, Random(octosurf::test::seed(), 2))) {
    const double step = std::floor((view.eye.x() - 1) / 0.29) + 1;
    const bool on_stair = view.eye.x() > 1 && step <= 6 && std::abs(view.eye.y() - 1) < 0.5;
    const double ground = on_stair ? 0.17 * step : 0;
    EXPECT_GE(view.eye.z() - ground, 0.25 - 1e-6);
    EXPECT_LE(view.eye.z() - ground, 0.6 + 6 * 0.17)
        << "at the drop behind the last step it is still that high";
  }
}

TEST_F(MeshWalk, APoleLiftsNobodyAndAMeshWithoutGroundIsRefused) {
  Triangles ground, wall;
  terrain::add_quad(ground, {{{0, 0, 0}, {4, 0, 0}, {4, 1, 0}, {0, 1, 0}}});
  terrain::add_box(ground, {2, 0.4, 0}, {2.05, 0.45, 0.2});
  for (const auto& view : walk_over(mesh_of(ground), Random(1, 2))) EXPECT_LE(view.eye.z(), 0.6);
  terrain::add_quad(wall, {{{0, 0, 0}, {2, 0, 0}, {2, 0, 1}, {0, 0, 1}}});
  EXPECT_THROW(walk_over(mesh_of(wall), Random(1, 2)), Error);
}

class MeshRecording : public terrain::TerrainTest {
 protected:
  SimulationOptions options() const {
    SimulationOptions options;
    options.mesh = write("stair.stl", terrain::stl(terrain::stair(4)));
    return options;
  }
};

TEST_F(MeshRecording, KeepsTheSizeOfTheFileAndStepsAFewCentimetres) {
  const Recording recording(options());
  EXPECT_EQ(recording.mesh()->triangles, 2u + 4 * 12);
  const auto is_tread = [](const evaluation::TrueFace& face) {
    const Ring2& ring = face.polygons[0].outer;
    const double a = (ring[1] - ring[0]).norm(), b = (ring[2] - ring[1]).norm();
    return ring.size() == 4 && std::abs(std::min(a, b) - 0.29) < 1e-5 && std::abs(std::max(a, b) - 1) < 1e-5;
  };
  EXPECT_EQ(std::ranges::count_if(recording.faces(), is_tread), 4);
  for (std::size_t i = 1; i < recording.size(); ++i)
    EXPECT_LT((recording.true_pose(i).translation() - recording.true_pose(i - 1).translation()).norm(), 0.15);
}

TEST_F(MeshRecording, EverythingAWalkerStepsOnIsSeen) {
  SimulationOptions some = options();
  for (const std::string sensor : {"depth", "spinning"}) {
    SCOPED_TRACE(sensor);
    some.sensor = sensor;
    some.frames = sensor == "depth" ? 200 : 40;
    const evaluation::Truth truth = Recording(some).truth();
    for (const auto& face : truth.faces) {
      // At a quarter of the usual scans, 20 cm apart, the last 4 cm of a tread, behind the edge above, may
      // fall between two of them. Between a lidar's beams cells stay empty: it only has to see each face.
      const double least = sensor == "depth" ? 0.25 / 0.29 * area(face) : 0.05;
      EXPECT_TRUE(!face.name.starts_with("terrain/level") || face.visible_area_m2 >= least) << face.name;
      EXPECT_TRUE(!face.name.starts_with("terrain/overhang") || face.visible_area_m2 == 0) << face.name;
    }
  }
}

TEST_F(MeshRecording, AStairIsMappedStepByStep) {
  SimulationOptions some = options();
  some.frames = 120;
  const octosurf::test::SimulatedMap map(some);
  const evaluation::Evaluation scores = evaluation::evaluate(*map.mapper.snapshot(), map.truth);
  // Four treads, four risers, two sides, the drop behind and the ground; each of them many voxels either way.
  EXPECT_EQ(scores.faces, 12u);
  EXPECT_EQ(scores.correct, scores.faces);
  EXPECT_EQ(scores.noise, 0u);
  // A face may be short of a rim of half a voxel: 47 m of rims, 1 cm wide, of 10 m².
  EXPECT_GE(scores.coverage, 1 - 47 * 0.01 / 10);
  // Evaluation forgives a voxel beyond the rim; what hangs over by more, anywhere, is as wide again: 2 m of
  // them.
  EXPECT_LE(scores.unsafe_share, 2 * 0.02 / 10);
}

/// One test for each mesh that planners use, if they are there.
class TerrainData : public testing::TestWithParam<std::string> {};

TEST_P(TerrainData, IsReadWalkedAndSeen) {
  const fs::path file = fs::path(octosurf::test::paths::data()) / "terrain_meshes" / GetParam();
  if (!fs::exists(file)) GTEST_SKIP() << "no ../shared/data/terrain_meshes";
  SimulationOptions options;
  options.mesh = file;
  options.frames = 20;
  const Recording recording(options);
  Recording::Visibility visible = recording.visibility();
  // Every reading lies on a true face: nothing of what a camera sees was taken for hidden.
  std::size_t readings = 0, without_face = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Readings ideal = recording.ideal(i);
    visible.add(i, ideal);
    for (std::size_t k = 0; k < ideal.t.size(); ++k) {
      readings += ideal.t[k] > 0;
      without_face += ideal.t[k] > 0 && ideal.labels[k] == 0;
    }
  }
  EXPECT_GT(readings, 100'000u);
  EXPECT_LE(static_cast<double>(without_face), 1e-3 * static_cast<double>(readings));
  double level = 0;
  for (const auto& face : visible.truth().faces)
    if (face.name.starts_with("terrain/level")) level += face.visible_area_m2;
  EXPECT_GT(level, 1) << "m² to walk on";
}

INSTANTIATE_TEST_SUITE_P(Meshes, TerrainData,
                         testing::Values("bauzil_stairs.stl", "darpa.stl", "ori_plinth.stl",
                                         "plateforme_not_flat.stl", "rubbles_4.stl", "rubbles_stairs_1.stl"),
                         [](const auto& file) { return file.param.substr(0, file.param.find('.')); });

}  // namespace
}  // namespace octosurf::simulation
