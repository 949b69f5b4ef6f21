#include "simulation/mesh.hpp"

#include "geometry/symmetric.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cmath>
#include <map>
#include <sstream>
#include <unordered_map>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t max_bytes = 64u << 20;
constexpr std::size_t max_triangles = 200'000;
constexpr double min_extent = 0.1;  // m
constexpr double max_extent = 1000;
constexpr double max_precision = 1e-3;

/// Triangles by their corners, as an importer gives them.
using Corners = std::vector<std::array<Eigen::Vector3d, 3>>;

Error refused(const fs::path& file, const std::string& what, const std::string& hint) {
  return Error(Error::Kind::data, file.string(), what, hint);
}

/// Opens the one file it is made for: a terrain from elsewhere must not make Assimp read /dev/zero as its
/// materials.
class OneFile : public Assimp::DefaultIOSystem {
 public:
  explicit OneFile(std::string file) : file_(std::move(file)) {}
  bool Exists(const char* name) const override { return name == file_ && DefaultIOSystem::Exists(name); }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    return name == file_ ? DefaultIOSystem::Open(name, mode) : nullptr;
  }

 private:
  std::string file_;
};

Eigen::Matrix4d to_eigen(const aiMatrix4x4& m) {
  Eigen::Matrix4d out;
  out << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return out;
}

void add_triangles(const fs::path& file, const aiMesh& mesh, const Eigen::Matrix4d& T, Corners& corners) {
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    std::array<Eigen::Vector3d, 3> triangle;
    for (unsigned k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= mesh.mNumVertices)
        throw refused(file, "a triangle names a vertex that is not there", "export it again");
      const aiVector3D& v = mesh.mVertices[face.mIndices[k]];
      triangle[k] = (T * Eigen::Vector4d(v.x, v.y, v.z, 1)).head<3>();
      if (!triangle[k].allFinite()) throw refused(file, "a vertex is not finite", "export it again");
    }
    if (corners.size() == max_triangles)
      throw refused(file, "has more than " + std::to_string(max_triangles) + " triangles",
                    "simplify it, or cut a part out of it");
    corners.push_back(triangle);
  }
}

/// The triangles of the scene's nodes in their places. A list in the place of a recursion: a file may nest at
/// will.
Corners triangles_of(const fs::path& file, const aiScene& scene) {
  Corners corners;
  std::vector<std::pair<const aiNode*, Eigen::Matrix4d>> open{{scene.mRootNode, Eigen::Matrix4d::Identity()}};
  while (!open.empty()) {
    const auto [node, T_scene_parent] = open.back();
    open.pop_back();
    const Eigen::Matrix4d T = T_scene_parent * to_eigen(node->mTransformation);
    for (unsigned m = 0; m < node->mNumMeshes; ++m)
      add_triangles(file, *scene.mMeshes[node->mMeshes[m]], T, corners);
    for (unsigned c = 0; c < node->mNumChildren; ++c) open.emplace_back(node->mChildren[c], T);
  }
  return corners;
}

/// Turns the named axis of the file to z, by the shortest way.
Eigen::Matrix3d up_to_z(const std::string& up) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  axis[up.back() - 'x'] = up.front() == '-' ? -1 : 1;
  return geometry::rotation_between(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Corners load(const fs::path& file, const MeshOptions& options) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (ending != ".stl" && ending != ".obj" && ending != ".ply" && ending != ".dae")
    throw refused(file, "is no STL, OBJ, PLY or DAE", "convert it into one of them");
  std::error_code code;
  const std::uintmax_t bytes = fs::is_regular_file(file, code) ? fs::file_size(file, code) : 0;
  if (code || !fs::is_regular_file(file, code))
    throw refused(file, "cannot be read", "name a file that is there and may be read");
  if (bytes > max_bytes) throw refused(file, "is larger than 64 MiB", "simplify it, or cut a part out of it");

  Assimp::Importer importer;
  importer.SetIOHandler(new OneFile(file.string()));  // the importer deletes it
  // Assimp turns a DAE's own up axis to y; an axis that the caller names is the file's, untouched.
  const bool says_up = ending == ".dae" && options.up.empty();
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, !says_up);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_ValidateDataStructure);
  if (!scene || !scene->mRootNode) {
    std::string reason = importer.GetErrorString();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw refused(file, "is damaged or holds no mesh (" + reason + ")", "export it again");
  }
  Corners corners = triangles_of(file, *scene);
  const Eigen::Matrix3d turn = options.scale * up_to_z(says_up ? "y" : options.up.empty() ? "z" : options.up);
  for (auto& triangle : corners)
    for (auto& corner : triangle) corner = turn * corner;
  return corners;
}

/// Gives points within `precision` of each other one index, the first's.
class Welder {
 public:
  explicit Welder(double precision) : precision_(precision) {}

  std::uint32_t index(const Eigen::Vector3d& p, std::vector<Eigen::Vector3d>& vertices) {
    const Eigen::Array3d cell = (p / (2 * precision_)).array();
    for (int corner = 0; corner < 8; ++corner) {  // a ball of this radius meets eight cells at most
      const Eigen::Array3d side(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      const auto found = cells_.equal_range(key((cell - 0.5 + side).floor()));
      for (auto it = found.first; it != found.second; ++it)
        if ((vertices[it->second] - p).norm() <= precision_) return it->second;
    }
    const auto index = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(p);
    cells_.emplace(key(cell.floor()), index);
    return index;
  }

 private:
  static std::uint64_t key(const Eigen::Array3d& cell) {
    // Coordinates are at most 2²⁰ precisions away from 0; 21 bits hold each cell.
    const auto part = [](double c) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(c)) & 0x1fffff;
    };
    return part(cell.x()) << 42 | part(cell.y()) << 21 | part(cell.z());
  }

  double precision_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> cells_;
};

double width(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
}

TriangleMesh welded(const Corners& corners, double precision) {
  TriangleMesh mesh;
  mesh.precision = precision;
  Welder welder(precision);
  for (const auto& corner : corners) {
    std::array<std::uint32_t, 3> t{};
    for (int k = 0; k < 3; ++k) t[k] = welder.index(corner[k], mesh.vertices);
    if (width(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) < precision)
      ++mesh.dropped;
    else
      mesh.triangles.push_back(t);
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[std::minmax(t[k], t[(k + 1) % 3])];
  mesh.open_edges =
      std::count_if(edges.begin(), edges.end(), [](const auto& edge) { return edge.second == 1; });
  return mesh;
}

}  // namespace

void MeshOptions::validate() const {
  if (!up.empty() && up != "x" && up != "y" && up != "z" && up != "-x" && up != "-y" && up != "-z")
    throw Error(Error::Kind::usage, "up", "'" + up + "' is no axis", "choose one of x, y, z, -x, -y, -z");
  if (!(scale >= 1e-6 && scale <= 1e6))
    throw Error(Error::Kind::usage, "scale", std::to_string(scale) + " lies outside [1e-6, 1e6]",
                "give metres per unit of the file, e.g. 0.001 for millimetres");
}

TriangleMesh read_mesh(const fs::path& file, const MeshOptions& options) {
  options.validate();
  const Corners corners = load(file, options);
  Eigen::AlignedBox3d box;
  for (const auto& triangle : corners)
    for (const auto& corner : triangle) box.extend(corner);
  if (corners.empty()) throw refused(file, "holds no triangle", "export the terrain as a mesh");
  const double extent = box.sizes().maxCoeff();
  if (!(extent >= min_extent && extent <= max_extent)) {
    std::ostringstream what;
    what << "is " << extent << " m large, a terrain 0.1 m to 1 km";
    throw refused(file, what.str(), "give the metres of its unit with --scale");
  }
  const double largest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  const double precision = largest * 0x1p-20;
  if (precision > max_precision)
    throw refused(file, "lies so far from its origin that its floats hold no millimetres",
                  "move it to the origin");
  TriangleMesh mesh = welded(corners, precision);
  if (mesh.triangles.empty()) throw refused(file, "has no triangle of any width", "export it again");
  return mesh;
}

}  // namespace octosurf::simulation
