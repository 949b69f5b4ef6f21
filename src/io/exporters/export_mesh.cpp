#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"
#include "io/readers/bounded_file.hpp"

#include <assimp/Exporter.hpp>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/scene.h>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf::io {
namespace {

// Assimp's format names, and their properties.
struct MeshFormat {
  const char* id;
  bool y_up;              // the format's viewers expect it: the root node turns the map
  bool linear_materials;  // material colours are linear, not sRGB
};

MeshFormat format_of(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  const char letter = static_cast<char>(ending.at(1) | 0x20);
  if (letter == 'g') return {"glb2", true, true};
  if (letter == 'o') return {"obj", false, false};
  return {"stlb", false, false};
}

float linear_of_srgb(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

aiVector3D to_assimp(const Eigen::Vector3d& v) {
  return {static_cast<ai_real>(v.x()), static_cast<ai_real>(v.y()), static_cast<ai_real>(v.z())};
}

// Assimp's scene owns its data, allocated by new and new[].
aiMesh* to_mesh(const Mesh& shape, const std::string& name, unsigned material) {
  auto mesh = std::make_unique<aiMesh>();
  mesh->mName = name;
  mesh->mMaterialIndex = material;
  mesh->mNumVertices = static_cast<unsigned>(shape.vertices.size());
  mesh->mVertices = new aiVector3D[mesh->mNumVertices];
  for (unsigned i = 0; i < mesh->mNumVertices; ++i) mesh->mVertices[i] = to_assimp(shape.vertices[i]);
  const bool cloud = shape.triangles.empty();
  mesh->mPrimitiveTypes = cloud ? aiPrimitiveType_POINT : aiPrimitiveType_TRIANGLE;
  mesh->mNumFaces = cloud ? mesh->mNumVertices : static_cast<unsigned>(shape.triangles.size());
  mesh->mFaces = new aiFace[mesh->mNumFaces];
  for (unsigned i = 0; i < mesh->mNumFaces; ++i) {
    aiFace& face = mesh->mFaces[i];
    face.mNumIndices = cloud ? 1 : 3;
    face.mIndices = new unsigned[face.mNumIndices];
    for (unsigned k = 0; k < face.mNumIndices; ++k) face.mIndices[k] = cloud ? i : shape.triangles[i][k];
  }
  return mesh.release();
}

aiMaterial* to_material(const std::array<float, 3>& color, const MeshFormat& format,
                        const std::string& name) {
  auto material = std::make_unique<aiMaterial>();
  std::array<float, 3> c = color;
  if (format.linear_materials) {
    for (float& channel : c) channel = linear_of_srgb(channel);
  }
  const aiString text(name);
  const aiColor4D rgba(c[0], c[1], c[2], 1);
  const int two_sided = 1;
  const ai_real metallic = 0, roughness = 1;
  material->AddProperty(&text, AI_MATKEY_NAME);
  material->AddProperty(&rgba, 1, AI_MATKEY_BASE_COLOR);
  material->AddProperty(&rgba, 1, AI_MATKEY_COLOR_DIFFUSE);
  material->AddProperty(&two_sided, 1, AI_MATKEY_TWOSIDED);
  material->AddProperty(&metallic, 1, AI_MATKEY_METALLIC_FACTOR);
  material->AddProperty(&roughness, 1, AI_MATKEY_ROUGHNESS_FACTOR);
  return material.release();
}

/// Rotates the map's `up` to y, for a root node.
aiMatrix4x4 up_to_y(const Eigen::Vector3d& up) {
  Eigen::Matrix3d z_to_y;
  z_to_y << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::Matrix3f R = (z_to_y * upright(up).toRotationMatrix()).cast<float>();
  return {R(0, 0), R(0, 1), R(0, 2), 0, R(1, 0), R(1, 1), R(1, 2), 0,
          R(2, 0), R(2, 1), R(2, 2), 0, 0,       0,       0,       1};
}

std::unique_ptr<aiScene> to_scene(const std::vector<NamedMesh>& meshes, const MeshFormat& format,
                                  const Eigen::Vector3d& up) {
  const auto count = static_cast<unsigned>(meshes.size());
  auto scene = std::make_unique<aiScene>();
  scene->mRootNode = new aiNode("map");
  if (format.y_up) scene->mRootNode->mTransformation = up_to_y(up);
  scene->mMeshes = new aiMesh* [count] {};
  scene->mMaterials = new aiMaterial* [count] {};
  scene->mNumMeshes = scene->mNumMaterials = count;
  std::vector<aiNode*> nodes;
  for (unsigned i = 0; i < count; ++i) {
    const std::string& name = meshes[i].name;
    scene->mMeshes[i] = to_mesh(meshes[i].mesh, name, i);
    scene->mMaterials[i] = to_material(meshes[i].color, format, name);
    auto node = std::make_unique<aiNode>(name);
    node->mNumMeshes = 1;
    node->mMeshes = new unsigned[1]{i};
    nodes.push_back(node.release());
  }
  scene->mRootNode->addChildren(count, nodes.data());
  return scene;
}

std::string_view bytes_in(const aiExportDataBlob& blob) {
  return {static_cast<const char*>(blob.data), blob.size};
}

void write_bytes(std::string_view bytes, NewFile& output) {
  output.write(
      [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

/// The .glb with the origin in its root node's extras, which Assimp does not write: a head of 12 bytes, the
/// length and type of the JSON, the JSON, the rest.
std::string with_origin(std::string_view glb, const Eigen::Vector3d& origin) {
  constexpr std::size_t length_at = 12, begin = 20, alignment = 4;
  const std::size_t length = number_at<std::uint32_t>(glb.data() + length_at, !little_endian_host);
  auto json = nlohmann::ordered_json::parse(glb.substr(begin, length));
  json["nodes"][json["scenes"][0]["nodes"][0].get<std::size_t>()]["extras"]["origin"] = {
      origin.x(), origin.y(), origin.z()};
  std::string text = json.dump();
  text.append((alignment - text.size() % alignment) % alignment, ' ');
  const std::string_view rest = glb.substr(begin + length);
  std::string result(glb.substr(0, begin));
  const auto put = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) result[at + i] = static_cast<char>(value >> (8 * i) & 0xff);
  };
  put(8, begin + text.size() + rest.size());
  put(length_at, text.size());
  return result.append(text).append(rest);
}

}  // namespace

void write_mesh_file(const ExportJob& job, const std::filesystem::path& file) {
  const MeshFormat format = format_of(file);
  NewFile output(file, job.options.force);
  std::vector<NamedMesh> meshes;
  for (Shape& shape : make_shapes(job, job.options.parts.front()))
    meshes.push_back({"surface_" + std::to_string(shape.id), shape.color, std::move(shape.mesh)});
  if (meshes.empty()) throw nothing_to_write(file);
  if (format.y_up) meshes.insert(meshes.end(), job.extras.meshes.begin(), job.extras.meshes.end());
  Assimp::ExportProperties properties;
  properties.SetPropertyString(AI_CONFIG_EXPORT_BLOB_NAME, file.stem().string());
  Assimp::Exporter exporter;
  const aiExportDataBlob* blob =
      exporter.ExportToBlob(to_scene(meshes, format, job.options.up).get(), format.id, 0u, &properties);
  if (blob == nullptr) throw Error(Error::Kind::output, file.string(), exporter.GetErrorString());
  const Eigen::Vector3d& origin = job.options.origin;
  if (format.y_up && !origin.isZero(0))
    write_bytes(with_origin(bytes_in(*blob), origin), output);
  else
    write_bytes(bytes_in(*blob), output);
  if (blob->next != nullptr) {  // .obj's materials
    NewFile materials(std::filesystem::path(file).replace_extension(".mtl"), job.options.force);
    write_bytes(bytes_in(*blob->next), materials);
    materials.commit();
  }
  output.commit();
}

}  // namespace octosurf::io
