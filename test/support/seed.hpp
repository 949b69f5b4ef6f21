#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace octosurf::test {

/// The seed that OCTOSURF_TEST_SEED gives, else `otherwise`; printed so that a failure can be repeated.
inline std::uint64_t seed_or(std::uint64_t otherwise) {
  const char* given = std::getenv("OCTOSURF_TEST_SEED");
  const std::uint64_t seed = given != nullptr ? std::stoull(given) : otherwise;
  std::cout << "OCTOSURF_TEST_SEED=" << seed << "\n";
  return seed;
}

/// A fresh seed each time.
inline std::uint64_t fresh_seed() { return seed_or(std::random_device{}()); }

}  // namespace octosurf::test
