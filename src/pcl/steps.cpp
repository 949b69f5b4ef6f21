#include "pcl/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <pcl/console/print.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/region_growing.h>
// Instantiated here, because libpcl_surface, which contains it, depends on VTK.
#include <pcl/surface/impl/mls.hpp>
#include <pcl/surface/mls.h>

namespace octosurf::pcl {
namespace {

using Cloud = ::pcl::PointCloud<::pcl::PointXYZ>;
using KdTree = ::pcl::search::KdTree<::pcl::PointXYZ>;

/// Of neighbours, whose order makes no difference, and takes a third of the time.
KdTree::Ptr unsorted() { return std::make_shared<KdTree>(false); }

Cloud::Ptr pcl_cloud(const Points& points) {
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& point : points) cloud->emplace_back(point.x(), point.y(), point.z());
  return cloud;
}

Indices own(const ::pcl::Indices& indices) { return {indices.begin(), indices.end()}; }

std::vector<Indices> own(const std::vector<::pcl::PointIndices>& groups) {
  std::vector<Indices> result;
  for (const ::pcl::PointIndices& group : groups) result.push_back(own(group.indices));
  return result;
}

/// PCL reports failed fits on stderr, unless disabled globally. With nested use, the last one restores the
/// first one's setting.
class Silence {
 public:
  Silence() {
    const std::scoped_lock lock(mutex_);
    if (silent_++ > 0) return;
    before_ = ::pcl::console::getVerbosityLevel();
    ::pcl::console::setVerbosityLevel(::pcl::console::L_ALWAYS);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
  ~Silence() {
    const std::scoped_lock lock(mutex_);
    if (--silent_ == 0) ::pcl::console::setVerbosityLevel(before_);
  }

 private:
  static inline std::mutex mutex_;
  static inline int silent_ = 0;
  static inline ::pcl::console::VERBOSITY_LEVEL before_ = ::pcl::console::L_INFO;
};

/// Grows over all neighbours within a radius (paper, III-C3), where PCL's takes a number of them.
class GrowingByRadius : public ::pcl::RegionGrowing<::pcl::PointXYZ, ::pcl::Normal> {
 public:
  explicit GrowingByRadius(double radius) : radius_(radius) {
    setNumberOfNeighbours(std::numeric_limits<unsigned>::max());  // of those found
  }

 protected:
  void findPointNeighbours() override {
    point_neighbours_.resize(input_->size());
    std::vector<float> squared_distances;
    for (const ::pcl::index_t i : *indices_)
      search_->radiusSearch((*input_)[i], radius_, point_neighbours_[i], squared_distances);
  }

 private:
  double radius_;  // m
};

}  // namespace

Indices with_neighbors(const Points& points, double radius, int neighbors) {
  if (points.empty()) return {};
  ::pcl::RadiusOutlierRemoval<::pcl::PointXYZ> filter;
  filter.setInputCloud(pcl_cloud(points));
  filter.setRadiusSearch(radius);
  filter.setMinNeighborsInRadius(neighbors);
  ::pcl::Indices kept;
  filter.filter(kept);
  return own(kept);
}

std::vector<PointNormal> mls_normals(const Points& points, double radius) {
  ::pcl::MovingLeastSquares<::pcl::PointXYZ, ::pcl::PointNormal> mls;
  mls.setInputCloud(pcl_cloud(points));
  mls.setSearchMethod(unsorted());
  mls.setSearchRadius(radius);
  mls.setSqrGaussParam(radius * radius);
  mls.setPolynomialOrder(1);
  mls.setComputeNormals(true);
  ::pcl::PointCloud<::pcl::PointNormal> projected;
  mls.process(projected);
  const ::pcl::Indices& origin = mls.getCorrespondingIndices()->indices;

  std::vector<PointNormal> result;
  for (std::size_t j = 0; j < projected.size(); ++j) {
    const auto& estimate = projected[j];
    if (estimate.getNormalVector3fMap().allFinite() && std::isfinite(estimate.curvature))
      result.push_back(
          {static_cast<std::uint32_t>(origin[j]), estimate.getNormalVector3fMap(), estimate.curvature});
  }
  return result;
}

std::vector<Indices> smooth_regions(const Points& points, const std::vector<PointNormal>& normals,
                                    double radius) {
  auto pcl_normals = std::make_shared<::pcl::PointCloud<::pcl::Normal>>();
  pcl_normals->resize(points.size());
  auto known = std::make_shared<::pcl::Indices>();
  for (const auto& [point, normal, curvature] : normals) {
    (*pcl_normals)[point] = {normal.x(), normal.y(), normal.z(), curvature};
    known->push_back(static_cast<::pcl::index_t>(point));
  }
  GrowingByRadius growing(radius);
  growing.setInputCloud(pcl_cloud(points));
  growing.setIndices(known);
  growing.setInputNormals(pcl_normals);
  growing.setSearchMethod(unsorted());
  growing.setSmoothnessThreshold(static_cast<float>(smoothness_angle));
  growing.setCurvatureThreshold(static_cast<float>(max_curvature));
  std::vector<::pcl::PointIndices> regions;
  growing.extract(regions);
  return own(regions);
}

PlaneFit fit_plane(const Points& points, double tolerance) {
  const Silence silence;
  const auto plane = std::make_shared<::pcl::SampleConsensusModelPlane<::pcl::PointXYZ>>(pcl_cloud(points));
  ::pcl::RandomSampleConsensus<::pcl::PointXYZ> ransac(plane, tolerance);
  ransac.setMaxIterations(ransac_iterations);
  if (!ransac.computeModel()) return {};
  ::pcl::Indices inliers;
  ransac.getInliers(inliers);
  Eigen::VectorXf found, model;
  ransac.getModelCoefficients(found);
  plane->optimizeModelCoefficients(inliers, found, model);
  plane->selectWithinDistance(model, tolerance, inliers);
  if (inliers.empty()) return {};

  PlaneFit fit;
  fit.inliers = own(inliers);
  std::sort(fit.inliers.begin(), fit.inliers.end());
  const Eigen::Vector3d normal = model.head<3>().cast<double>();
  fit.plane = {normal.normalized(), -static_cast<double>(model[3]) / normal.norm()};
  return fit;
}

std::vector<Indices> clusters(const Points& points, double gap) {
  ::pcl::EuclideanClusterExtraction<::pcl::PointXYZ> extraction;
  extraction.setInputCloud(pcl_cloud(points));
  extraction.setSearchMethod(unsorted());
  extraction.setClusterTolerance(gap);
  std::vector<::pcl::PointIndices> groups;
  extraction.extract(groups);
  return own(groups);
}

}  // namespace octosurf::pcl
