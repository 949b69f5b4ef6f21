#include "export_fixture.hpp"

#include <assimp/Importer.hpp>
#include <assimp/scene.h>
#include <nlohmann/json.hpp>
#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <tiny_gltf.h>

namespace octosurf::test {
namespace {

using enum ExportPart;

constexpr double float_noise = 2e-6;  // coordinates up to 6 m as 32-bit floats

Mesh load_ply(const std::filesystem::path& file) {
  pcl::PolygonMesh from;
  EXPECT_EQ(pcl::io::loadPLYFile(file.string(), from), 0);
  pcl::PointCloud<pcl::PointXYZ> cloud;
  pcl::fromPCLPointCloud2(from.cloud, cloud);
  Mesh mesh;
  for (const pcl::PointXYZ& p : cloud) mesh.vertices.emplace_back(p.x, p.y, p.z);
  for (const pcl::Vertices& face : from.polygons) {
    EXPECT_EQ(face.vertices.size(), 3u);
    const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(face.vertices[i]); };
    mesh.triangles.push_back({corner(0), corner(1), corner(2)});
  }
  return mesh;
}

Eigen::AlignedBox3d bounds_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : surface.boundary) box.extend(v);
  return box;
}

void expect_same(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  EXPECT_LT((a.min() - b.min()).norm() + (a.max() - b.max()).norm(), float_noise);
}

const Eigen::AlignedBox3d room_box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(6, 4, 2.5));

/// Each edge is run through once in both directions, by place: some formats do not share vertices.
void expect_closed(const Mesh& mesh) {
  std::map<std::array<long, 6>, int> directed;
  const auto key = [&](std::uint32_t from, std::uint32_t to) {
    std::array<long, 6> k{};
    for (int axis = 0; axis < 3; ++axis) {
      k[static_cast<std::size_t>(axis)] = std::lround(mesh.vertices[from][axis] * 1e4);
      k[static_cast<std::size_t>(axis) + 3] = std::lround(mesh.vertices[to][axis] * 1e4);
    }
    return k;
  };
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      ++directed[key(t[i], t[(i + 1) % 3])];
      --directed[key(t[(i + 1) % 3], t[i])];
    }
  for (const auto& [edge, balance] : directed) EXPECT_EQ(balance, 0);
}

TEST_F(ExportTest, PlyIsReadByPcl) {
  const Mesh mesh = load_ply(write("flat.ply", {polygons}));
  EXPECT_NEAR(area(mesh), total_area(), 1e-4);
  expect_same(bounds(mesh), room_box);
  pcl::PointCloud<pcl::PointXYZRGB> colored;
  ASSERT_EQ(pcl::io::loadPLYFile(path("flat.ply").string(), colored), 0);
  const Eigen::Array3f color = Eigen::Map<const Eigen::Array3f>(room_.surfaces[0]->color.data());
  EXPECT_LE((Eigen::Array3f(colored[0].r, colored[0].g, colored[0].b) - 255 * color).abs().maxCoeff(), 1);

  const Mesh closed = load_ply(write("closed.ply", {meshes}));
  EXPECT_NEAR(volume(closed), 0.02 * total_area(), 1e-4);
  expect_closed(closed);
  const Eigen::Vector3d thickness = Eigen::Vector3d::Constant(0.02);  // outward: the room is seen from inside
  expect_same(bounds(closed), {room_box.min() - thickness, room_box.max() + thickness});

  EXPECT_NEAR(area(load_ply(write("convex.ply", {convex}))), 1.6, 1e-5);
}

TEST_F(ExportTest, PlyPointsAreReadByPcl) {
  pcl::PointCloud<pcl::PointXYZRGBL> read;
  ASSERT_EQ(pcl::io::loadPLYFile(write("points.ply", {points}).string(), read), 0);
  ASSERT_EQ(read.size(), 2 * room_.surfaces.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Surface& surface = *room_.surfaces[i / 2];
    EXPECT_EQ(read[i].label, surface.id);
    const Eigen::Vector3d& point = extras_.points[surface.id][i % 2];
    EXPECT_LT((read[i].getVector3fMap().cast<double>() - point).norm(), float_noise);
    EXPECT_NEAR(read[i].g, 255 * surface.color[1], 0.51);
  }
}

/// Accessor `index` as rows of `width` numbers, which may be shorter than a Number.
template <class Number, std::size_t width>
std::vector<std::array<Number, width>> rows_of(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(index));
  const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  const unsigned char* data = model.buffers.at(static_cast<std::size_t>(view.buffer)).data.data() +
                              view.byteOffset + accessor.byteOffset;
  const auto stride = static_cast<std::size_t>(accessor.ByteStride(view));
  const auto component = static_cast<std::uint32_t>(accessor.componentType);
  const auto size = static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(component));
  EXPECT_EQ(component == TINYGLTF_COMPONENT_TYPE_FLOAT, std::is_floating_point_v<Number>);
  EXPECT_LE(size, sizeof(Number));
  std::vector<std::array<Number, width>> rows(accessor.count);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t k = 0; k < width; ++k) std::memcpy(&rows[i][k], data + i * stride + k * size, size);
  return rows;
}

Mesh from_gltf(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  Mesh mesh;
  for (const auto& [x, y, z] : rows_of<float, 3>(model, primitive.attributes.at("POSITION")))
    mesh.vertices.emplace_back(x, y, z);
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES) return mesh;
  const auto indices = rows_of<std::uint32_t, 1>(model, primitive.indices);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    mesh.triangles.push_back({indices[i][0], indices[i + 1][0], indices[i + 2][0]});
  return mesh;
}

tinygltf::Model load_glb(const std::filesystem::path& file) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, file.string())) << error;
  EXPECT_EQ(error + warning, "");
  return model;
}

TEST_F(ExportTest, GlbIsReadByTinygltf) {
  for (const ExportPart part : {polygons, meshes}) {
    const bool closed = part == meshes;
    const tinygltf::Model model = load_glb(write(closed ? "closed.glb" : "flat.glb", {part}));
    ASSERT_EQ(model.meshes.size(), room_.surfaces.size());
    std::size_t found = 0;
    for (const tinygltf::Node& node : model.nodes) {
      if (node.mesh < 0) continue;
      const Surface& surface = *room_.surfaces.at(found++);
      EXPECT_EQ(node.name, "surface_" + std::to_string(surface.id));
      EXPECT_TRUE(node.matrix.empty());
      const auto& primitives = model.meshes.at(static_cast<std::size_t>(node.mesh)).primitives;
      ASSERT_EQ(primitives.size(), 1u);
      const Mesh mesh = from_gltf(model, primitives[0]);
      if (closed) {
        EXPECT_NEAR(volume(mesh), 0.02 * surface.area_m2, 1e-5);
        expect_closed(mesh);
      } else {
        EXPECT_NEAR(area(mesh), surface.area_m2, 1e-5);
        expect_same(bounds(mesh), bounds_of(surface));
      }
      const auto& material = model.materials.at(static_cast<std::size_t>(primitives[0].material));
      EXPECT_TRUE(material.doubleSided);
      for (std::size_t c = 0; c < 3; ++c) {  // glTF's factors are linear: back by the sRGB curve
        const double linear = material.pbrMetallicRoughness.baseColorFactor.at(c);
        EXPECT_NEAR(1.055 * std::pow(linear, 1 / 2.4) - 0.055, surface.color[c], 1e-3);
      }
    }
    EXPECT_EQ(found, room_.surfaces.size());
  }
}

TEST_F(ExportTest, GlbStandsUpright) {
  ExportOptions options = extras_;
  options.force = true;
  for (const Eigen::Vector3d& z : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.2, -0.9, -0.4)}) {
    options.up = z;
    export_surfaces(room_, path("room.glb"), options);
    const tinygltf::Model model = load_glb(path("room.glb"));
    ASSERT_EQ(model.scenes.size(), 1u);
    ASSERT_EQ(model.scenes[0].nodes.size(), 1u);
    const tinygltf::Node& root = model.nodes.at(static_cast<std::size_t>(model.scenes[0].nodes[0]));
    EXPECT_EQ(root.children.size(), room_.surfaces.size());
    ASSERT_EQ(root.matrix.size(), 16u);
    const Eigen::Map<const Eigen::Matrix4d> matrix(root.matrix.data());  // column-major, as Eigen
    Eigen::Vector4d up(0, 0, 0, 0);
    up.head<3>() = z.normalized();
    EXPECT_LT((matrix * up - Eigen::Vector4d(0, 1, 0, 0)).norm(), 1e-6);  // glTF's up is y
    EXPECT_NEAR(matrix.determinant(), 1, 1e-6);
  }
  options.up.setZero();
  EXPECT_THROW(export_surfaces(room_, path("room.glb"), options), Error);
}

TEST_F(ExportTest, AnOriginStandsOnceInGlbAndJson) {
  ExportOptions options = extras_;
  options.origin = {448000.25, 5411000, 120};
  for (const char* ending : {".glb", ".json"}) {
    export_surfaces(room_, path(std::string("far") + ending), options);
    export_surfaces(room_, path(std::string("near") + ending), extras_);
  }
  const tinygltf::Model far = load_glb(path("far.glb")), near = load_glb(path("near.glb"));
  const auto extras = [](const tinygltf::Model& model) {
    return model.nodes.at(static_cast<std::size_t>(model.scenes[0].nodes[0])).extras;
  };
  ASSERT_TRUE(extras(far).Has("origin"));
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(extras(far).Get("origin").Get(i).GetNumberAsDouble(), options.origin[i]);
  EXPECT_FALSE(extras(near).Has("origin"));
  EXPECT_EQ(far.meshes.size(), near.meshes.size());
  EXPECT_EQ(far.buffers.at(0).data, near.buffers.at(0).data);
  auto far_json = nlohmann::json::parse(read_file(path("far.json")));
  EXPECT_EQ(far_json.at("origin"), nlohmann::json({448000.25, 5411000.0, 120.0}));
  far_json.erase("origin");
  EXPECT_EQ(far_json, nlohmann::json::parse(read_file(path("near.json"))));
}

TEST_F(ExportTest, GlbPointsAreReadByTinygltf) {
  const tinygltf::Model model = load_glb(write("points.glb", {points}));
  ASSERT_EQ(model.meshes.size(), room_.surfaces.size());
  for (std::size_t i = 0; i < model.meshes.size(); ++i) {
    ASSERT_EQ(model.meshes[i].primitives.size(), 1u);
    EXPECT_EQ(model.meshes[i].primitives[0].mode, TINYGLTF_MODE_POINTS);
    const Mesh mesh = from_gltf(model, model.meshes[i].primitives[0]);
    ASSERT_EQ(mesh.vertices.size(), 2u);
    EXPECT_LT((mesh.vertices[0] - extras_.points[room_.surfaces[i]->id][0]).norm(), float_noise);
  }
}

/// What converts it to other formats (docs/usage.md).
TEST_F(ExportTest, GlbIsReadByAssimp) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(write("room.glb", {polygons}).string(), 0);
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, room_.surfaces.size());
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    const aiMesh& mesh = *scene->mMeshes[i];
    EXPECT_STREQ(mesh.mName.C_Str(), ("surface_" + std::to_string(room_.surfaces[i]->id)).c_str());
    Mesh read;
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      read.vertices.emplace_back(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z);
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const unsigned* corners = mesh.mFaces[f].mIndices;
      read.triangles.push_back({corners[0], corners[1], corners[2]});
    }
    EXPECT_NEAR(area(read), room_.surfaces[i]->area_m2, 1e-4);
    expect_same(bounds(read), bounds_of(*room_.surfaces[i]));
  }
}

}  // namespace
}  // namespace octosurf::test
