#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <type_traits>
#include <vector>

namespace octosurf::geometry {

/// Calls work(0) … work(threads − 1), each in its own thread; work(0), and any for which no thread could be
/// started, run in the caller's. Rethrows the exception of the lowest index once all are done.
template <class Work>
void in_parallel(int threads, const Work& work) {
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(threads));
  const auto guarded = [&](int t) {
    try {
      work(t);
    } catch (...) {
      failures[static_cast<std::size_t>(t)] = std::current_exception();
    }
  };
  std::vector<std::jthread> others;
  int started = 1;
  try {
    others.reserve(static_cast<std::size_t>(threads));
    for (; started < threads; ++started) others.emplace_back(guarded, started);
  } catch (const std::exception&) {  // no more threads: the rest runs in this one
  }
  guarded(0);
  for (int t = started; t < threads; ++t) guarded(t);
  for (std::jthread& other : others) other.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

/// Calls work(i), or work(i, thread), for 0 … n − 1, each in one of the threads; in this order where there is
/// one.
template <class Work>
void share_among(int threads, std::size_t n, const Work& work) {
  std::atomic<std::size_t> next{0};
  in_parallel(std::clamp(static_cast<int>(n), 1, threads), [&](int thread) {
    for (std::size_t i = next++; i < n; i = next++)
      if constexpr (std::is_invocable_v<Work, std::size_t, int>)
        work(i, thread);
      else
        work(i);
  });
}

/// Thread t's range of n items.
struct Share {
  std::size_t begin, end;
  Share(std::size_t n, int t, int threads)
      : begin(n * static_cast<std::size_t>(t) / static_cast<std::size_t>(threads)),
        end(n * static_cast<std::size_t>(t + 1) / static_cast<std::size_t>(threads)) {}
};

}  // namespace octosurf::geometry
