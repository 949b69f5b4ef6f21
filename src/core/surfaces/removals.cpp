#include <algorithm>

#include <octosurf/removals.hpp>

namespace octosurf {

void RemovalLog::for_each_since(std::uint64_t revision,
                                const std::function<void(const Removal&)>& visit) const {
  const auto first = std::partition_point(
      chunks_.begin(), chunks_.end(),
      [&](const std::shared_ptr<const Chunk>& chunk) { return chunk->back().revision <= revision; });
  for (auto chunk = first; chunk != chunks_.end(); ++chunk)
    for (const Removal& removal : **chunk)
      if (removal.revision > revision) visit(removal);
}

RemovalLog RemovalLog::with(const std::vector<Removal>& more) const {
  constexpr std::size_t chunk_size = 256;
  RemovalLog log = *this;
  std::shared_ptr<Chunk> last;
  for (const Removal& removal : more) {
    if (!last && !log.chunks_.empty() && log.chunks_.back()->size() < chunk_size) {
      last = std::make_shared<Chunk>(*log.chunks_.back());
      log.chunks_.back() = last;
    } else if (!last || last->size() >= chunk_size) {
      last = std::make_shared<Chunk>();
      log.chunks_.push_back(last);
    }
    last->push_back(removal);
  }
  log.size_ += more.size();
  return log;
}

}  // namespace octosurf
