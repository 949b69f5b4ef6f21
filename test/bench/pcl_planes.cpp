// PCL's region growing in Eigen's types; PCL's headers stay here.

#include "bench/bench.hpp"

#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>

namespace octosurf::bench {

CgalPlanes pcl_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings) {
  constexpr int neighbours = 24, grown_over = 12;  // as for CGAL's
  constexpr float curvature = 0.05F;               // the paper's
  CgalPlanes result;
  result.ms = time_ms([&] {
    const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (const Eigen::Vector3f& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
    const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
    const auto normals = std::make_shared<pcl::PointCloud<pcl::Normal>>();
    pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
    estimation.setInputCloud(cloud);
    estimation.setSearchMethod(tree);
    estimation.setKSearch(neighbours);
    estimation.compute(*normals);
    pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> growing;
    growing.setInputCloud(cloud);
    growing.setInputNormals(normals);
    growing.setSearchMethod(tree);
    growing.setNumberOfNeighbours(grown_over);
    growing.setMinClusterSize(static_cast<int>(settings.min_points));
    growing.setSmoothnessThreshold(static_cast<float>(settings.angle_rad));
    growing.setCurvatureThreshold(curvature);
    std::vector<pcl::PointIndices> clusters;
    growing.extract(clusters);
    for (const pcl::PointIndices& cluster : clusters)
      result.regions.emplace_back(cluster.indices.begin(), cluster.indices.end());
  });
  return result;
}

}  // namespace octosurf::bench
