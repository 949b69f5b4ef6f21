#include <octosurf/changes.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/queries.hpp>

/// Where a foot that is lowered at `place` meets the ground; nothing if it would not, or is not clear of
/// things.
std::optional<octosurf::Nearest> step(const octosurf::Mapper& mapper, octosurf::SurfaceIndex& index,
                                      const Eigen::Vector3d& place) {
  const auto latest = mapper.snapshot();  // never waits for the scan that is being inserted
  const auto changes = octosurf::changes_since(*latest, index.snapshot().revision);
  for (const octosurf::SurfaceId id : changes.gone) (void)id;   // what was to stand on it is planned anew
  index = octosurf::SurfaceIndex(latest, &index);               // takes over what has not changed
  const double room = 0.15;                                     // m
  if (latest->octree.nearest_occupied(place, room)) return {};  // after mapper.share_octree()
  return index.below(place);
}
