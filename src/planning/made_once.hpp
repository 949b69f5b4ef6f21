#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>

namespace octosurf::planning {

/// Cache: results by key, computed at the first read, different keys in parallel. For any thread.
template <class Key, class T>
class MadeOnce {
 public:
  template <class Make>
  const T& get(const Key& key, const Make& make) {
    std::shared_ptr<One> one;
    {
      const std::lock_guard lock(mutex_);
      std::shared_ptr<One>& entry = all_[key];
      if (!entry) entry = std::make_shared<One>();
      one = entry;
    }
    std::call_once(one->once, [&] {
      one->made = std::make_unique<const T>(make());
      one->done = true;
    });
    return *one->made;
  }

  /// Shares another cache's results whose keys are kept, and those being computed.
  template <class Keep>
  void share(MadeOnce& other, const Keep& keep) {
    const std::lock_guard lock(other.mutex_);
    for (const auto& [key, one] : other.all_)
      if (keep(key)) all_.emplace(key, one);
  }
  /// Calls `visit(key, result)` for computed results.
  template <class Visit>
  void for_each(const Visit& visit) const {
    std::map<Key, std::shared_ptr<One>> all;
    {
      const std::lock_guard lock(mutex_);
      all = all_;
    }
    for (const auto& [key, one] : all)
      if (one->done) visit(key, *one->made);
  }

 private:
  struct One {
    std::once_flag once;
    std::unique_ptr<const T> made;
    std::atomic<bool> done = false;
  };
  mutable std::mutex mutex_;
  std::map<Key, std::shared_ptr<One>> all_;
};

}  // namespace octosurf::planning
