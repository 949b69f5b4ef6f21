#include "backlog.hpp"

#include <algorithm>
#include <numeric>

namespace octosurf {
namespace {

double mean(const boost::circular_buffer<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

bool falls_behind(const Waiting& waiting, std::size_t together) {
  return together > 1 && waiting.waited_s * waiting.cost_s >
                             static_cast<double>(together) * waiting.interval_s * waiting.interval_s;
}

Backlog::Backlog(std::size_t together)
    : together_(together), costs_s_(std::max<std::size_t>(1, together)), intervals_s_(costs_s_.capacity()) {}

void Backlog::take(double stamp_s) {
  if (last_stamp_s_) intervals_s_.push_back(std::max(0.0, stamp_s - *last_stamp_s_));
  last_stamp_s_ = stamp_s;
  ++taken_;
}

void Backlog::next(double stamp_s, double waited_s) {
  take(stamp_s);
  if (waited_s <= 0)
    behind_ = false;
  else
    behind_ = behind_ || falls_behind({waited_s, mean(costs_s_), mean(intervals_s_)}, together_);
}

void Backlog::joined(double stamp_s) { take(stamp_s); }

void Backlog::mapped(double took_s) {
  for (std::size_t i = 0; i < taken_; ++i) costs_s_.push_back(took_s / static_cast<double>(taken_));
  taken_ = 0;
}

}  // namespace octosurf
