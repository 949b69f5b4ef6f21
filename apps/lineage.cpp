#include "lineage.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace octosurf {

bool goes_on_from(const Snapshot& after, const Snapshot& before) {
  if (before.revision > after.revision) return false;
  std::vector<SurfaceId> left;
  after.removals.for_each_since(before.revision, [&](const Removal& removal) {
    if (removal.of == Removal::Of::surface && removal.born <= before.revision) left.push_back(removal.id);
  });
  std::sort(left.begin(), left.end());
  std::size_t there = 0;
  for (const SurfacePtr& surface : before.surfaces) {
    const Surface* now = after.find(surface->id);
    if (now == nullptr && !std::binary_search(left.begin(), left.end(), surface->id)) return false;
    if (now != nullptr && now->born != surface->born) return false;
    there += now != nullptr;
  }
  const auto as_old = std::count_if(after.surfaces.begin(), after.surfaces.end(),
                                    [&](const SurfacePtr& s) { return s->born <= before.revision; });
  return static_cast<std::size_t>(as_old) == there;
}

}  // namespace octosurf
