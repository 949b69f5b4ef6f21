#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace octosurf::simulation {

/// SplitMix64 (Steele, Lea and Flood 2014), started from (seed, stream). Streams of one seed are
/// independent, so that e.g. frame 7's noise does not depend on how many frames were drawn before.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream)
      : state_(mix(mix(seed) ^ (stream * 0x9e3779b97f4a7c15u))) {}

  std::uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15u); }

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal, by Box and Muller; the second of each pair is kept for the next call.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    const double angle_rad = 2 * std::numbers::pi * uniform();
    spare_ = radius * std::sin(angle_rad);
    has_spare_ = true;
    return radius * std::cos(angle_rad);
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace octosurf::simulation
