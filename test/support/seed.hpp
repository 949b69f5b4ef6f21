#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace octosurf::test {

/// The seed of a random test: what OCTOSURF_TEST_SEED gives, a fresh one where it says "random", otherwise
/// always the same, because what is drawn from noise fails by chance in a few of a thousand worlds and a
/// suite of hundreds of such tests must not be red on somebody's unrelated change. `./dev fuzz` runs them in
/// fresh worlds. Printed, so that a failure can be repeated.
inline std::uint64_t seed() {
  const char* given = std::getenv("OCTOSURF_TEST_SEED");
  const std::string text = given != nullptr ? given : "1";
  const std::uint64_t value = text == "random" ? std::random_device{}() : std::stoull(text);
  std::cout << "OCTOSURF_TEST_SEED=" << value << "\n";
  return value;
}

}  // namespace octosurf::test
