#pragma once

#include "check/meaning.hpp"
#include "judgement/common_error.hpp"
#include "judgement/view.hpp"

#include <cstddef>
#include <vector>

#include <octosurf/judgement.hpp>

namespace octosurf::check {

/// Views spread over a recording, with readings of one meaning; compared in pairs by that meaning's poses.
class Views {
 public:
  Views(const Recording& recording, const Meaning& readings, std::size_t count);

  const Meaning& readings() const { return readings_; }
  /// How much normals in the map spread to a second direction, 0 to 1/2: on one plane most motions agree.
  double second_direction(const Meaning& meaning) const;
  /// `voxels`: of the map's, the voxel by which places agree: larger ones forgive poses that are somewhat
  /// off.
  Score score(const Meaning& meaning, double voxels, std::vector<judgement::Offset>* offsets = nullptr) const;

 private:
  const Recording* recording_;
  Meaning readings_;
  std::vector<judgement::View> views_;
};

/// What the judge says of a recording by a meaning.
Judgement judge(const Recording& recording, const Meaning& meaning);

}  // namespace octosurf::check
