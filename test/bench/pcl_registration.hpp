#pragma once

#include <Eigen/Geometry>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <octosurf/scan.hpp>

/// PCL's point-to-plane registration: what ours is measured beside and by.
namespace octosurf::bench {

using PointCloud = pcl::PointCloud<pcl::PointXYZ>;
using NormalCloud = pcl::PointCloud<pcl::PointNormal>;

/// Readings up to max_range, moved by T.
PointCloud::Ptr cloud_of(const Scan& scan, const Eigen::Isometry3d& T, double max_range);

/// One point a voxel of d, its normal by the neighbours within 2.5 d: what our own map keeps, too.
NormalCloud::Ptr thinned(const PointCloud::Ptr& cloud, double d);

/// The motion that lays `source` on `target`, from none; points farther apart than `reach` m do not count.
Eigen::Isometry3d register_points(const NormalCloud::ConstPtr& source, const NormalCloud::ConstPtr& target,
                                  double reach);

}  // namespace octosurf::bench
