#pragma once

#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

namespace octosurf::test {

/// The seed of the running test's world, the same however often the test asks: what OCTOSURF_TEST_SEED gives,
/// a fresh one where it says "random", otherwise 1, because what is drawn from noise may fail by chance in
/// one of ten thousand worlds and a suite of hundreds of such tests must not be red on somebody's unrelated
/// change.
/// `./dev fuzz` runs every test that asks in fresh worlds. Printed as the command that repeats the world.
/// No random test takes its numbers from elsewhere (check_seeds.cmake); a scene that is fixed on purpose
/// says why on its line, after "fixed:".
std::uint64_t seed();

/// `count` seeds of the running test's world, for a test that looks at several.
inline std::vector<std::uint64_t> seeds(std::size_t count) {
  std::vector<std::uint64_t> all(count);
  std::iota(all.begin(), all.end(), seed());
  return all;
}

/// Random numbers of the running test's world.
inline std::mt19937_64 rng() { return std::mt19937_64(seed()); }

}  // namespace octosurf::test
