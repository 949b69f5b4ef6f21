#pragma once

#include "evaluation/truth.hpp"

namespace octosurf::evaluation {

/// When a foot, or an eye of the map's resolution, finds one face in two.
struct OnePlane {
  double angle_rad = 0;  ///< between the normals, at most
  double offset_m = 0;   ///< corners of the smaller face off the plane of the larger one, at most
  double gap_m = 0;      ///< between the outlines, less than this
};

/// How two faces fail to be one plane.
struct Fold {
  double angle_rad = 0;
  double offset_m =
      0;  ///< the farthest corner of the one of which less was seen (the later id), off the other's plane
};
Fold fold_between(const TrueFace& a, const TrueFace& b);

/// The truth with present faces of one plane as one: from the face of which most was seen, all that lie in
/// its plane and that a chain of gaps reaches; then so on from what is left. A joined face has the frame, id
/// and name of the one it began with, `joined` the ids of the others, and the visible cells of all on its own
/// grid. Last, pieces of a face that were seen farther from each other than the gap are faces of the same
/// id. Faces that are joined to none and in one piece keep their bytes. O(faces²) comparisons of boxes.
Truth join_faces(const Truth& truth, const OnePlane& rule);

}  // namespace octosurf::evaluation
