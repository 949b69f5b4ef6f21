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
  constexpr std::size_t most = 100'000;  // some 10 MB; a busy robot's week
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
  std::size_t old = 0;  // chunks
  for (; log.size_ > most && log.size_ - log.chunks_[old]->size() >= most; ++old) {
    log.size_ -= log.chunks_[old]->size();
    log.left_out_ += log.chunks_[old]->size();
    log.complete_since_ = log.chunks_[old]->back().revision;
  }
  log.chunks_.erase(log.chunks_.begin(), log.chunks_.begin() + static_cast<std::ptrdiff_t>(old));
  return log;
}

}  // namespace octosurf
