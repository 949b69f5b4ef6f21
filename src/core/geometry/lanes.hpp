#pragma once

#include <bit>
#include <cstring>

namespace octosurf::geometry {

/// Four floats in a vector register (GCC's and Clang's vector extension: SSE or NEON, or plain code). Each
/// lane rounds as a single float does, so results do not depend on the machine.
using Lanes = float __attribute__((vector_size(16)));
using LaneMask = int __attribute__((vector_size(16)));  ///< result of comparing Lanes: 0 or −1

inline Lanes load_lanes(const float* four) {
  Lanes lanes;
  std::memcpy(&lanes, four, sizeof lanes);
  return lanes;
}
/// The values where the mask is set, 0 elsewhere.
inline Lanes where(LaneMask mask, Lanes values) {
  return std::bit_cast<Lanes>(mask & std::bit_cast<LaneMask>(values));
}
/// All four are set.
inline bool all(LaneMask mask) {
  // Register halves: reading halves of a vector just stored takes several cycles more.
  using Halves = long long __attribute__((vector_size(16)));
  const auto halves = std::bit_cast<Halves>(mask);
  return (halves[0] & halves[1]) == -1;
}
inline float total(Lanes v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace octosurf::geometry
