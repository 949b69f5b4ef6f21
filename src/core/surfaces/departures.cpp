#include <algorithm>

#include <octosurf/departures.hpp>

namespace octosurf {

void DepartureLog::for_each_since(std::uint64_t revision,
                                  const std::function<void(const Departure&)>& visit) const {
  const auto first = std::partition_point(
      chunks_.begin(), chunks_.end(),
      [&](const std::shared_ptr<const Chunk>& chunk) { return chunk->back().revision <= revision; });
  for (auto chunk = first; chunk != chunks_.end(); ++chunk)
    for (const Departure& departure : **chunk)
      if (departure.revision > revision) visit(departure);
}

DepartureLog DepartureLog::with(const std::vector<Departure>& more) const {
  constexpr std::size_t chunk_size = 256;
  DepartureLog log = *this;
  std::shared_ptr<Chunk> last;
  for (const Departure& departure : more) {
    if (!last && !log.chunks_.empty() && log.chunks_.back()->size() < chunk_size) {
      last = std::make_shared<Chunk>(*log.chunks_.back());
      log.chunks_.back() = last;
    } else if (!last || last->size() >= chunk_size) {
      last = std::make_shared<Chunk>();
      log.chunks_.push_back(last);
    }
    last->push_back(departure);
  }
  log.size_ += more.size();
  return log;
}

}  // namespace octosurf
