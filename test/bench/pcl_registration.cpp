#include "bench/pcl_registration.hpp"

#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/registration/icp.h>

namespace octosurf::bench {

NormalCloud::Ptr thinned(const PointCloud::Ptr& cloud, double d) {
  PointCloud::Ptr thin(new PointCloud);
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(static_cast<float>(d), static_cast<float>(d), static_cast<float>(d));
  grid.filter(*thin);
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> normals;
  normals.setInputCloud(thin);
  normals.setRadiusSearch(2.5 * d);
  pcl::PointCloud<pcl::Normal> found;
  normals.compute(found);
  NormalCloud::Ptr result(new NormalCloud);
  for (std::size_t i = 0; i < thin->size(); ++i) {
    pcl::PointNormal p;
    p.getVector3fMap() = (*thin)[i].getVector3fMap();
    p.getNormalVector3fMap() = found[i].getNormalVector3fMap();
    if (p.getNormalVector3fMap().allFinite()) result->push_back(p);
  }
  return result;
}

PointCloud::Ptr cloud_of(const Scan& scan, const Eigen::Isometry3d& T, double max_range) {
  PointCloud::Ptr cloud(new PointCloud);
  for (const Eigen::Vector3f& p : scan.points) {
    if (!p.allFinite() || p.norm() > max_range) continue;
    const Eigen::Vector3f at = (T * p.cast<double>()).cast<float>();
    cloud->push_back({at.x(), at.y(), at.z()});
  }
  return cloud;
}

Eigen::Isometry3d register_points(const NormalCloud::ConstPtr& source, const NormalCloud::ConstPtr& target,
                                  double reach) {
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(source);
  icp.setInputTarget(target);
  icp.setMaxCorrespondenceDistance(reach);
  icp.setMaximumIterations(30);
  icp.setTransformationEpsilon(1e-10);
  NormalCloud moved;
  icp.align(moved);
  return Eigen::Isometry3d(icp.getFinalTransformation().cast<double>());
}

}  // namespace octosurf::bench
