#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace octosurf::judgement {

/// Of a sequence whose length nobody knows, members evenly spread over it, at most `most` and at least half
/// as many: when full, every second one goes, and from then on half as many are taken.
template <class T>
class Spread {
 public:
  explicit Spread(std::size_t most) : most_(most) {}
  /// Whether the next member is wanted; true for the first.
  bool wants() {
    const bool wanted = seen_++ % stride_ == 0;
    if (!wanted || kept_.size() < most_) return wanted;
    for (std::size_t i = 1; 2 * i < most_; ++i) kept_[i] = std::move(kept_[2 * i]);
    kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>((most_ + 1) / 2), kept_.end());
    stride_ *= 2;
    return (seen_ - 1) % stride_ == 0;
  }
  void take(T member) { kept_.push_back(std::move(member)); }
  const std::vector<T>& kept() const { return kept_; }
  std::vector<T>& kept() { return kept_; }

 private:
  std::vector<T> kept_;
  std::size_t most_, seen_ = 0, stride_ = 1;
};

}  // namespace octosurf::judgement
