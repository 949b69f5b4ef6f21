#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/queries.hpp>

// Answers as one line of JSON, as printed by `octosurf query --json` and returned by `octosurf serve`. Map
// frame, m and degrees.

namespace octosurf {

std::string surfaces_json(const std::vector<SurfaceId>& ids);
std::string hit_json(const std::optional<RayHit>& hit);
std::string voxel_json(const OccupancyView::Voxel& voxel);
std::string nearest_json(const Nearest& found, const Surface& surface, const Eigen::Vector3d& up);
/// `ground`: shares of the foot's area over each Ground.
std::string foothold_json(const Foothold& found, const std::array<double, ground_names.size()>& ground);
std::string region_json(const Surface& surface, const ContactRegion& region,
                        const std::vector<ConvexPiece>& pieces);

const char* state_name(OccupancyView::State state);

}  // namespace octosurf
