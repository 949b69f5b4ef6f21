#pragma once

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

/// The paper's steps that are PCL's, one function for each part of PCL, in Eigen's types.
namespace octosurf::pcl {

constexpr double smoothness_angle = 0.5235987755982988;  ///< rad: between normals of a region, 30° (III-C3)
constexpr double max_curvature = 0.05;  ///< surface variation λ₀/Σλ in a region (III-C3)
constexpr int ransac_iterations = 200;  ///< of a plane (III-C4)

using Points = std::vector<Eigen::Vector3f>;
using Indices = std::vector<std::uint32_t>;

/// pcl::RadiusOutlierRemoval: indices of the points that have at least `neighbors` others within
/// `radius`.
Indices with_neighbors(const Points& points, double radius, int neighbors);

struct PointNormal {
  std::uint32_t point = 0;  ///< index of the point it belongs to
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float curvature = 0;
};

/// pcl::MovingLeastSquares of degree 1 and weight r²; only the normals of the projections, of either sign.
/// Points without a plane through their neighbours are skipped.
std::vector<PointNormal> mls_normals(const Points& points, double radius);

/// pcl::RegionGrowing by `smoothness_angle` and `max_curvature` over all neighbours within `radius`, of the
/// points with a normal. Memory: 4 bytes a pair.
std::vector<Indices> smooth_regions(const Points& points, const std::vector<PointNormal>& normals,
                                    double radius);

/// pcl::RandomSampleConsensus of pcl::SampleConsensusModelPlane, `ransac_iterations`, constant seed, and the
/// least-squares plane of its inliers. Normal of either sign.
struct PlaneFit {
  Plane plane;
  Indices inliers;  ///< ascending; empty if no plane was found
};
PlaneFit fit_plane(const Points& points, double tolerance);

/// pcl::EuclideanClusterExtraction, of any size.
std::vector<Indices> clusters(const Points& points, double gap);

}  // namespace octosurf::pcl
