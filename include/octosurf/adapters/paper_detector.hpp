#pragma once

// The detector of W. Pryor's paper, from PCL's own parts. Link octosurf::pcl.

namespace octosurf {

/// From here on mappers of this program take maps whose parameter `detector` is `paper`, as those of
/// Parameters::paper(); without, they throw Error(usage). Steps (paper, III-B and III-C), each with the part
/// of PCL it is made of:
///
/// 1. Add inliers: what is new, within s of a plane and inside the surface's polygon, largest surface first.
/// 2. Expand: what is new within h of a boundary and s of its plane, again and again.
/// 3. Detect, among all that is left so far: pcl::RadiusOutlierRemoval (2 within r), pcl::MovingLeastSquares
///    of degree 1 (r, r²), pcl::RegionGrowing (smoothness_angle, max_curvature), pcl::SACSegmentation
///    (RANSAC, s, ransac_iterations), pcl::EuclideanClusterExtraction (h); more than n points each time.
///
/// Planes are not fitted again, and surfaces never merge. What the world takes away, stopping and going on,
/// explain() and everything downstream are as with the default detector, but that an outline is that of the
/// inliers alone. Equal scans give equal bytes. The program links libpcl_common, search, kdtree, octree,
/// filters, features, sample_consensus and segmentation; no VTK.
///
/// Cost: grows with what is pending, some 20 µs a point and scan. From any thread, as often as one likes.
void enable_paper_detector();

}  // namespace octosurf
