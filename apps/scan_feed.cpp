#include "scan_feed.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

ScanFeed::ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range,
                   std::function<bool(const Scan&)> accept)
    : source_(std::move(source)), range_(range), accept_(std::move(accept)) {
  const std::size_t left = source_->size() - std::min(range_.skip, source_->size());
  range_.first = std::min(range_.first, (left + range_.every - 1) / range_.every);
}

std::optional<Scan> ScanFeed::read() try {
  while (asked_ < range_.first) {
    if (!source_->skip(asked_++ == 0 ? range_.skip : range_.every - 1)) return {};
    std::optional<Scan> scan = source_->next();
    if (scan) scan->T_map_sensor = range_.T_map_poses * scan->T_map_sensor;
    if (!scan || !accept_ || accept_(*scan)) return scan;
    ++refused_;
  }
  return {};
} catch (const std::bad_alloc&) {
  throw Error(Error::Kind::data, "scan " + std::to_string(asked_), "does not fit into memory");
}

std::optional<Scan> ScanFeed::next() {
  if (failure_) std::rethrow_exception(failure_);
  return peeked_ ? std::exchange(peeked_, {}) : read();
}

const Scan* ScanFeed::peek() {
  try {
    if (!peeked_ && !failure_) peeked_ = read();
  } catch (...) {
    failure_ = std::current_exception();
  }
  return peeked_ ? &*peeked_ : nullptr;
}

}  // namespace octosurf
