#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace octosurf::test {

/// A fresh seed, printed so that a failure can be repeated: OCTOSURF_TEST_SEED=… sets it.
inline std::uint64_t fresh_seed() {
  const char* given = std::getenv("OCTOSURF_TEST_SEED");
  const std::uint64_t seed = given != nullptr ? std::stoull(given) : std::random_device{}();
  std::cout << "OCTOSURF_TEST_SEED=" << seed << "\n";
  return seed;
}

}  // namespace octosurf::test
