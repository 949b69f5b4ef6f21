#pragma once

#include <cstddef>
#include <string_view>

#include <octosurf/explain.hpp>

namespace octosurf::surfaces {

/// Why points stay pending or a surface is dissolved, with the numbers behind it.
struct Refusal {
  Reason reason = Reason::waiting;
  double measured = 0, limit = 0;  ///< the reason's figure and its bound; both 0: there is no number
  SurfaceId surface = 0;           ///< the one that stands in the way, if one does
  CylinderId cylinder = 0;         ///< likewise
  std::string_view what{};         ///< of Reason::too_few_points: one of `few`
};

/// What fewer than n points do; {measured} and {limit} as in ReasonText.
namespace few {
inline constexpr std::string_view in_region =
    "only {measured} points hang together smoothly here, and a surface needs {limit}";
inline constexpr std::string_view on_plane =
    "only {measured} points of the patch here lie on one plane, and a surface needs {limit}";
inline constexpr std::string_view in_cluster =
    "only {measured} points on the plane here lie less than h apart, and a surface needs {limit}";
inline constexpr std::string_view left_over =
    "only {measured} points are left here beside the planes found, and a surface needs {limit}";
inline constexpr std::string_view off_a_line = "the points here lie in a line";
}  // namespace few

inline Refusal fewer_than_n(std::string_view what, std::size_t points, std::size_t n) {
  return {.reason = Reason::too_few_points,
          .measured = static_cast<double>(points),
          .limit = static_cast<double>(n),
          .what = what};
}

}  // namespace octosurf::surfaces
