#include "serve/live_feed.hpp"

#include <utility>

#include <octosurf/changes.hpp>
#include <octosurf/page.hpp>

namespace octosurf {
namespace {

// Clients are some scans apart, if any: with as many kept, mostly each message is made once.
constexpr std::size_t most_kept = 8;

PageMap page_map(const AskedMap& map) { return {map.name, map.snapshot, map.octree}; }

}  // namespace

LiveFeed::LiveFeed(std::string run, Revision revision, Source map, Track track)
    : run_(std::move(run)), revision_(std::move(revision)), map_(std::move(map)), track_(std::move(track)) {}

LiveFeed::Changes LiveFeed::changes(std::optional<std::uint64_t> since, const std::string& run) {
  const std::lock_guard lock(making_changes_);
  const AskedMap map = map_();
  Changes result;
  result.revision = map.snapshot->revision;
  result.whole = !since || run != run_ || *since > result.revision;
  result.since = result.whole ? 0 : *since;
  for (const Changes& made : made_)
    if (made.since == result.since && made.revision == result.revision && made.whole == result.whole)
      return made;
  PageMap page = page_map(map);
  if (!result.whole) page.changes = changes_since(*map.snapshot, result.since);
  result.message =
      std::make_shared<const std::string>(io::page_changes_message(page, map.up, run_, track_()));
  made_.push_front(result);
  if (made_.size() > most_kept) made_.pop_back();
  return result;
}

LiveFeed::Message LiveFeed::voxels(bool slices) {
  const std::lock_guard lock(making_voxels_);
  const AskedMap map = map_();
  if (!voxels_.message || voxels_.revision != map.snapshot->revision || (slices && !voxels_.slices)) {
    const auto most_bytes = static_cast<std::size_t>(PageOptions{}.max_mb * 1e6);
    voxels_ = {map.snapshot->revision, slices,
               std::make_shared<const std::string>(
                   io::page_voxels_message(page_map(map), map.up, slices, most_bytes))};
  }
  return voxels_.message;
}

}  // namespace octosurf
