#pragma once

// The detector of W. Pryor's paper, from PCL's own parts. Link octosurf::pcl.

namespace octosurf::detection {
class Detector;
}  // namespace octosurf::detection

namespace octosurf {

/// The paper's detector, for Mapper and explain() of maps whose parameter `detector` is `paper`
/// (Parameters::paper()). Steps (paper, III-B and III-C) and their parts of PCL:
///
/// 1. Add inliers: new points within s of a plane and inside the surface's polygon, largest surface first.
/// 2. Expand: new points within h of a boundary and s of its plane, repeatedly.
/// 3. Detect, among all remaining points: pcl::RadiusOutlierRemoval (2 within r), pcl::MovingLeastSquares of
///    degree 1 (r, r²), pcl::RegionGrowing (r, 30°, curvature 0.05), pcl::RandomSampleConsensus (plane, s,
///    200 trials), pcl::EuclideanClusterExtraction (h); more than n points each time.
///
/// Planes are not refitted, and surfaces never merge. Removal, resuming, explain() and all later stages equal
/// the default detector's, except that outlines use the inliers alone. Equal scans give equal bytes. The
/// program links libpcl_common, search, kdtree, octree, filters, features, sample_consensus and segmentation;
/// no VTK.
///
/// Cost: grows with the pending points, some 20 µs a point and scan. May be called from any thread; any
/// number of maps may share it.
const detection::Detector* paper_detector();

}  // namespace octosurf
