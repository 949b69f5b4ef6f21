#pragma once

#include "simulation/scene.hpp"

#include <Eigen/Geometry>
#include <vector>

namespace octosurf::simulation {

/// Coplanar facets of one object, in the scene's frame.
struct PlanarGroup {
  std::size_t object = 0;
  std::string name;                                                ///< of the first facet
  Eigen::Isometry3d T_scene_face = Eigen::Isometry3d::Identity();  ///< z = outward normal
  std::vector<const Facet*> facets;
};

/// At `origin`, z along the unit `normal`, u horizontal where that is possible.
Eigen::Isometry3d face_frame(const Eigen::Vector3d& normal, const Eigen::Vector3d& origin);

/// Union of the group's facets less what the solids of `covers` touch or fill, in the group's (u, v):
/// outer rings counter-clockwise, holes clockwise. Boolean operations by Boost.Geometry.
std::vector<Polygon> open_area(const PlanarGroup& group, const std::vector<const Solid*>& covers);

}  // namespace octosurf::simulation
