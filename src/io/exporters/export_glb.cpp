#include "io/exporters/export_formats.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include <octosurf/up.hpp>

namespace octosurf::io {
namespace {

// By hand: Assimp writes no place for the origin, and every reader of maps would link it.

using Json = nlohmann::ordered_json;

/// As glTF 2.0 numbers them.
enum class Component : int { unsigned_int = 5125, float_32 = 5126 };
enum class Target : int { vertices = 34962, indices = 34963 };

float linear_of_srgb(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

/// Little-endian on every machine.
void put(std::string& bytes, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(number >> shift & 0xff));
}

/// Rotates the map's `up` to y: 16 numbers, column by column.
Json up_to_y(const Eigen::Vector3d& up) {
  Eigen::Matrix3d z_to_y;
  z_to_y << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
  turn.topLeftCorner<3, 3>() = z_to_y * upright(up).toRotationMatrix();
  return std::vector<double>(turn.data(), turn.data() + turn.size());
}

/// A scene of meshes under one root node.
class Scene {
 public:
  Scene(const Eigen::Vector3d& up, const Eigen::Vector3d& origin) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "octosurf"}};
    json_["scene"] = 0;
    json_["scenes"][0]["nodes"][0] = 0;
    Json& root = json_["nodes"][0];
    root = {{"name", "map"}, {"matrix", up_to_y(up)}};
    if (!origin.isZero(0)) root["extras"]["origin"] = origin;
  }

  /// Without triangles: points.
  void add(const std::string& name, const std::array<float, 3>& color, const Mesh& mesh) {
    const std::size_t index = json_["meshes"].size();
    Json primitive{{"attributes", {{"POSITION", add_vertices(mesh.vertices)}}}, {"material", index}};
    if (mesh.triangles.empty())
      primitive["mode"] = 0;  // points
    else
      primitive["indices"] = add_triangles(mesh.triangles);
    json_["meshes"][index]["name"] = name;
    json_["meshes"][index]["primitives"][0] = std::move(primitive);
    json_["nodes"][0]["children"].push_back(json_["nodes"].size());
    json_["nodes"].push_back({{"name", name}, {"mesh", index}});
    json_["materials"][index]["doubleSided"] = true;
    Json& shading = json_["materials"][index]["pbrMetallicRoughness"];
    shading = {{"metallicFactor", 0}, {"roughnessFactor", 1}};
    for (const float channel : color) shading["baseColorFactor"].push_back(linear_of_srgb(channel));
    shading["baseColorFactor"].push_back(1);
  }

  void write(std::ostream& out) {
    json_["buffers"][0]["byteLength"] = bytes_.size();
    std::string text = json_.dump();
    while (text.size() % 4 != 0) text += ' ';
    const auto size_of = [](const std::string& part) {
      std::string size;
      put(size, static_cast<std::uint32_t>(part.size()));
      return size;
    };
    const std::string chunks = size_of(text) + "JSON" + text + size_of(bytes_) + std::string("BIN\0", 4);
    std::string head = "glTF";
    put(head, 2);
    put(head, static_cast<std::uint32_t>(head.size() + 4 + chunks.size() + bytes_.size()));
    out << head << chunks << bytes_;
  }

 private:
  std::size_t add_vertices(const std::vector<Eigen::Vector3d>& vertices) {
    const std::size_t begin = bytes_.size();
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3d& vertex : vertices) {
      const Eigen::Vector3f rounded = vertex.cast<float>();
      box.extend(rounded);
      for (const float coordinate : rounded) put(bytes_, std::bit_cast<std::uint32_t>(coordinate));
    }
    return add_accessor(begin, Target::vertices,
                        {{"componentType", Component::float_32},
                         {"count", vertices.size()},
                         {"type", "VEC3"},
                         {"min", box.min()},
                         {"max", box.max()}});
  }

  std::size_t add_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
    const std::size_t begin = bytes_.size();
    for (const auto& corners : triangles)
      for (const std::uint32_t corner : corners) put(bytes_, corner);
    return add_accessor(
        begin, Target::indices,
        {{"componentType", Component::unsigned_int}, {"count", 3 * triangles.size()}, {"type", "SCALAR"}});
  }

  /// Of the bytes from `begin` on.
  std::size_t add_accessor(std::size_t begin, Target target, Json accessor) {
    accessor["bufferView"] = json_["bufferViews"].size();
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes_.size() - begin}, {"target", target}});
    json_["accessors"].push_back(std::move(accessor));
    return json_["accessors"].size() - 1;
  }

  Json json_;
  std::string bytes_;
};

}  // namespace

void write_glb(const std::vector<Shape>& shapes, const ExportJob& job, std::ostream& out) {
  Scene scene(job.options.up, job.options.origin);
  for (const Shape& shape : shapes) scene.add("surface_" + std::to_string(shape.id), shape.color, shape.mesh);
  for (const NamedMesh& mesh : job.options.meshes) scene.add(mesh.name, mesh.color, mesh.mesh);
  scene.write(out);
}

}  // namespace octosurf::io
