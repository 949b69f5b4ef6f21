#pragma once

#include "evaluation/truth.hpp"
#include "simulation/mesh_faces.hpp"
#include "simulation/scene.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace octosurf::simulation {

/// Scene frame to map frame: x ↦ scale · R · x + t.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return scale * (R * p) + t; }
};

/// The true faces of a scene in the map frame, and which of them a facet's points belong to.
///
/// 1. Adjoining coplanar facets of one object are one face; what does not adjoin is faces of its own.
/// 2. What another solid touches or fills (a table's foot on the floor) is cut out.
/// 3. Faces of objects that do not stand at the end are listed with gone = true, as they stood before.
class Faces {
 public:
  /// Cost: every planar group of facets is cut with every solid that reaches its plane.
  Faces(const Scene& scene, const Similarity& T_map_scene);
  /// Those of a mesh; facets are its triangles, each with two sides.
  Faces(const MeshFaces& mesh, const Similarity& T_map_scene);

  /// Ids 1 … size; `visible` is left empty.
  const std::vector<evaluation::TrueFace>& all() const { return faces_; }

  /// Id of the face that holds `point` (map frame, on the facet), 0 for curved facets. Facets are
  /// counted through the scene's solids in order. `direction` is that of the ray that ended there: it tells
  /// the sides of a mesh's triangle apart, solids have one. O(vertices) for facets that share a group
  /// with several faces, else O(1).
  std::uint16_t label(std::size_t facet, const Eigen::Vector3d& point,
                      const Eigen::Vector3d& direction = Eigen::Vector3d::Zero()) const;

 private:
  struct Group {
    std::size_t first = 0;  ///< index into faces_
    std::size_t count = 0;
  };
  /// Adds the faces of one plane as a group; names that were there are numbered.
  void add_group(const OpenPlane& plane, bool gone, const Similarity& T_map_scene);
  void check_count(const std::string& hint) const;

  std::vector<evaluation::TrueFace> faces_;
  std::vector<Eigen::AlignedBox2d> bounds_;  ///< of faces_
  std::vector<Group> groups_;
  std::vector<std::size_t> group_of_facet_;  ///< npos for curved facets; of a mesh's, the front side's
  std::vector<std::size_t> group_of_back_;   ///< of a mesh's facets, else empty
  std::vector<Eigen::Vector3d> normals_;     ///< likewise, map frame
  std::map<std::string, int> names_;
};

/// True if `p` lies inside the polygon: inside the outer ring and in no hole. O(vertices).
bool contains(const Polygon& polygon, const Eigen::Vector2d& p);

}  // namespace octosurf::simulation
