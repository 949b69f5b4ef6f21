#include <array>
#include <cstdio>

#include <octosurf/judgement.hpp>

namespace octosurf {
namespace {

/// Shares and least counts from 188 right and 283 wrong recordings: no right one has more than 0.08 of its
/// pairs contradicting, and from 0.05 to 0.2 as many wrong ones are found to within a tenth. A thing that was
/// moved may make up one pair. One scan in 25 of a right recording was outvoted, and only one. Small errors
/// of calibration, which right recordings have, explain up to 0.22, and what moves places by less than a
/// fifth of a voxel does not blur a map.
constexpr double pairs_share = 0.1, outvoted_share = 0.05, explained_share = 0.25, moved_voxels = 0.2;
/// A robot that is elsewhere for once sees nothing in common, too, but not a dozen times.
constexpr std::size_t fewest = 2, enough_alone = 12;

bool is_share(std::size_t part, std::size_t all, double share) {
  return part >= fewest && static_cast<double>(part) > share * static_cast<double>(all);
}

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 1000> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace

bool Judgement::many_pairs() const {
  return is_share(contradicting, pairs, pairs_share) || is_share(axis_contradicting, axis_pairs, pairs_share);
}
bool Judgement::many_outvoted() const { return is_share(outvoted.size(), judged, outvoted_share); }
bool Judgement::has_common_error() const {
  return common_error > explained_share && common_error_m > moved_voxels * resolution_m;
}
bool Judgement::too_far_apart() const {
  return alone >= enough_alone && 2 * alone > views && step_m > range_m;
}
bool Judgement::contradicts() const {
  return many_pairs() || many_outvoted() || has_common_error() || too_far_apart() || !oddities.empty();
}

std::string Judgement::describe() const {
  if (!contradicts()) return {};
  std::string text = "scans contradict each other: ";
  if (too_far_apart())
    return text + print(
                      "%zu of %zu views see nothing in common with others, and scans lie %.3g m apart, "
                      "farther than the %.3g m that they see",
                      alone, views, step_m, range_m);
  text += print("%zu of %zu pairs of views do", contradicting, pairs);
  if (worst_places > 0)
    text += print(", most %s and %s, in %zu of %zu places", worst[0].c_str(), worst[1].c_str(), worst_apart,
                  worst_places);
  if (axis_contradicting > 0)
    text += print("; %zu of the %zu that see surfaces facing (%.1f, %.1f, %.1f) are shifted along it",
                  axis_contradicting, axis_pairs, axis.x(), axis.y(), axis.z());
  if (many_outvoted())
    text += print("; %zu of %zu scans contradict most others, first %s", outvoted.size(), judged,
                  outvoted.front().c_str());
  if (has_common_error())
    text += print("; one error of all scans explains %.0f %% of what they are off, %.1f cm",
                  100 * common_error, 100 * common_error_m);
  for (const std::string& oddity : oddities) text += "; " + oddity;
  return text;
}

}  // namespace octosurf
