#include "scan_feed.hpp"

#include <algorithm>
#include <new>
#include <system_error>

#include <octosurf/error.hpp>

namespace octosurf {

ScanFeed::ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range)
    : source_(std::move(source)), range_(range) {
  const std::size_t left = source_->size() - std::min(range_.skip, source_->size());
  size_ = std::min(range_.first, (left + range_.every - 1) / range_.every);
  read_ahead();
}

ScanFeed::~ScanFeed() {
  if (ahead_.valid()) ahead_.wait();
}

void ScanFeed::read_ahead() {
  if (asked_ == range_.first) return;
  const std::size_t left_out = asked_++ == 0 ? range_.skip : range_.every - 1;
  const auto work = [this, left_out] { return read(left_out); };
  try {
    ahead_ = std::async(std::launch::async, work);
  } catch (const std::system_error&) {  // no thread to be had: read when asked for
    ahead_ = std::async(std::launch::deferred, work);
  }
}

std::optional<Scan> ScanFeed::read(std::size_t left_out) try {
  for (; left_out > 0; --left_out)
    if (!source_->next()) return {};
  return source_->next();
} catch (const std::bad_alloc&) {
  throw Error(Error::Kind::data, "scan " + std::to_string(asked_), "does not fit into memory");
}

std::optional<Scan> ScanFeed::next() {
  if (!ahead_.valid()) return {};
  std::optional<Scan> scan = ahead_.get();
  if (scan) read_ahead();
  return scan;
}

std::vector<std::string> ScanFeed::skipped() {
  if (ahead_.valid()) ahead_.wait();
  return source_->skipped();
}

}  // namespace octosurf
