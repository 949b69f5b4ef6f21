// Terrains from files: every format gives the same mesh; what is no terrain is refused with the file's name.
#include "simulation/mesh.hpp"

#include "accuracy/simulated_map.hpp"
#include "evaluation/evaluate.hpp"
#include "simulation/terrain.hpp"
#include "support/paths.hpp"

#include <chrono>
#include <sys/stat.h>

namespace octosurf::simulation {
namespace {

using terrain::Triangles;

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(v);
  return box;
}

double volume(const TriangleMesh& mesh) {
  double six = 0;
  for (const auto& t : mesh.triangles)
    six += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  return six / 6;
}

class MeshFile : public terrain::TerrainTest {
 protected:
  MeshFile() { terrain::add_box(box_, {1, 2, 3}, {1.5, 2.7, 4.1}); }

  void expect_refused(const std::filesystem::path& file, const std::string& why = "") {
    const Error e = refusal(Error::Kind::data, [&] { read_mesh(file); });
    EXPECT_EQ(e.where(), file.string());
    EXPECT_THAT(e.what(), testing::HasSubstr(why));
    EXPECT_NE(e.hint(), "");
  }

  Triangles box_;
};

TEST_F(MeshFile, EveryFormatGivesTheSameBox) {
  for (const std::filesystem::path& file :
       {write("a.stl", terrain::stl(box_)), write("b.STL", terrain::binary_stl(box_)),
        write("c.obj", terrain::obj(box_)), write("d.ply", terrain::ply(box_)),
        write("e.dae", terrain::dae(box_, "Z_UP", 1))}) {
    SCOPED_TRACE(file);
    const TriangleMesh mesh = read_mesh(file);
    EXPECT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_EQ(mesh.dropped, 0u);
    EXPECT_EQ(mesh.open_edges, 0u);
    EXPECT_TRUE(box_of(mesh).min().isApprox(Eigen::Vector3d(1, 2, 3), 1e-6));
    EXPECT_TRUE(box_of(mesh).max().isApprox(Eigen::Vector3d(1.5, 2.7, 4.1), 1e-6));
    EXPECT_NEAR(volume(mesh), 0.5 * 0.7 * 1.1, 1e-5) << "its triangles are wound as in the file";
  }
  const auto quad = write("quad.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_EQ(read_mesh(quad).triangles.size(), 2u) << "polygons of more corners are triangles";
}

TEST_F(MeshFile, TheNamedAxisIsUp) {
  const auto file = write("box.stl", terrain::stl(box_));
  const Eigen::Vector3d min(1, 2, 3), max(1.5, 2.7, 4.1);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool down : {false, true}) {
      const std::string up = (down ? "-" : "") + std::string(1, static_cast<char>('x' + axis));
      SCOPED_TRACE(up);
      const TriangleMesh mesh = read_mesh(file, {up, 1});
      EXPECT_NEAR(box_of(mesh).min().z(), down ? -max[axis] : min[axis], 1e-6);
      EXPECT_NEAR(box_of(mesh).max().z(), down ? -min[axis] : max[axis], 1e-6);
      EXPECT_NEAR(volume(mesh), 0.5 * 0.7 * 1.1, 1e-5) << "turned, not mirrored";
    }
}

TEST_F(MeshFile, DaeSaysItsAxisAndUnitUnlessTold) {
  const auto y_up = write("y.dae", terrain::dae(box_, "Y_UP", 1));
  EXPECT_NEAR(box_of(read_mesh(y_up)).max().z(), 2.7, 1e-6);
  EXPECT_NEAR(box_of(read_mesh(y_up, {"z", 1})).max().z(), 4.1, 1e-6);
  EXPECT_NEAR(box_of(read_mesh(y_up, {"-x", 1})).max().z(), -1, 1e-6);
  const auto centimetres = write("cm.dae", terrain::dae(box_, "Z_UP", 0.5));
  EXPECT_NEAR(box_of(read_mesh(centimetres)).max().z(), 4.1 * 0.5, 1e-6);
}

TEST_F(MeshFile, ScaleGivesMetres) {
  Triangles millimetres;
  terrain::add_box(millimetres, {0, 0, 0}, {2000, 1000, 500});
  const auto file = write("mm.stl", terrain::stl(millimetres));
  expect_refused(file, "--scale");
  EXPECT_TRUE(box_of(read_mesh(file, {"", 0.001})).max().isApprox(Eigen::Vector3d(2, 1, 0.5), 1e-6));
}

TEST_F(MeshFile, TrianglesOfNoWidthAreDroppedAndCounted) {
  Triangles triangles = box_;
  const Eigen::Vector3d a(1, 2, 3), b(1.5, 2, 3);
  for (const Eigen::Vector3d& between : {a, Eigen::Vector3d(1.2, 2, 3), Eigen::Vector3d(1.2, 2 + 1e-7, 3)})
    triangles.push_back({a, between, b});
  const TriangleMesh mesh = mesh_of(triangles);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.dropped, 3u);
}

TEST_F(MeshFile, VerticesAFloatApartAreOneAndOpenEdgesAreCounted) {
  Triangles triangles = box_;
  for (auto& v : triangles[0]) v += Eigen::Vector3d(2e-7, -2e-7, 2e-7);
  const TriangleMesh mesh = mesh_of(triangles);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.open_edges, 0u);
  triangles.pop_back();
  EXPECT_EQ(mesh_of(triangles).open_edges, 3u);
}

TEST_F(MeshFile, ForeignAndDamagedFilesAreRefused) {
  expect_refused(dir_ / "missing.stl", "cannot be read");
  expect_refused(dir_, "is no STL");
  std::filesystem::create_directory(dir_ / "folder.stl");
  expect_refused(dir_ / "folder.stl", "cannot be read");
  expect_refused(write("terrain.step", terrain::stl(box_)), "is no STL, OBJ, PLY or DAE");
  for (const std::string ending : {"stl", "obj", "ply", "dae"}) {
    expect_refused(write("empty." + ending, ""));
    expect_refused(write("text." + ending, "It was a dark and stormy night.\n"));
    expect_refused(write("zeros." + ending, std::string(1000, '\0')));
  }
  expect_refused(write("short.stl", terrain::binary_stl(box_).substr(0, 300)));
  expect_refused(write("points.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n0 0 0\n"));
  expect_refused(write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 30\n"));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Triangles triangles = box_;
    triangles[5][1].y() = bad;
    expect_refused(write("bad.stl", terrain::binary_stl(triangles)));
  }
}

TEST_F(MeshFile, SizesOfNoTerrainAreRefused) {
  for (const double size : {0.01, 5000.0}) {
    Triangles triangles;
    terrain::add_box(triangles, {0, 0, 0}, {size, size, size});
    expect_refused(write("size.stl", terrain::stl(triangles)), "--scale");
  }
  Triangles far;
  terrain::add_box(far, {4e5, 5e6, 100}, {4e5 + 8, 5e6 + 8, 108});
  expect_refused(write("far.stl", terrain::stl(far)), "origin");
}

TEST_F(MeshFile, BombsCostNothing) {
  if (octosurf::test::sanitized)
    GTEST_SKIP() << "the sanitizer ends the program where an allocation is refused";
  std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
      "property float y\nproperty float z\nelement face 4000000000\n"
      "property list uint uint vertex_indices\nend_header\n";
  expect_refused(write("bomb.ply", header));
  std::string count = terrain::binary_stl(box_);
  count.replace(80, 4, "\xff\xff\xff\x7f");
  expect_refused(write("bomb.stl", count));
  Triangles many(200'001, box_[0]);
  expect_refused(write("many.stl", terrain::binary_stl(many)), "200000 triangles");
  std::filesystem::resize_file(write("huge.stl", terrain::stl(box_)), 65u << 20);
  expect_refused(dir_ / "huge.stl", "64 MiB");
}

TEST_F(MeshFile, NothingElseIsOpened) {
  // Whoever opens the pipe waits for a writer that never comes.
  const auto pipe = dir_ / "pipe.mtl";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(read_mesh(write("box.obj", "mtllib pipe.mtl\n" + terrain::obj(box_))).triangles.size(), 12u);
}

// Meshes as scenes: the way over them, what is recorded on it, and a map of it scored against its truth.

namespace fs = std::filesystem;

using terrain::area;

class MeshRecording : public terrain::TerrainTest {
 protected:
  SimulationOptions options() const {
    SimulationOptions options;
    options.mesh = write("stair.stl", terrain::stl(terrain::stair(4)));
    return options;
  }
};

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
