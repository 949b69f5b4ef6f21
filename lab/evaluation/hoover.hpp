#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace octosurf::evaluation {

/// 0 of nothing.
inline double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// What became of a true region, after Hoover et al., An experimental comparison of range image
/// segmentation algorithms, PAMI 1996.
enum class TruthVerdict { correct, over_segmented, under_segmented, missed, not_judged };
std::string_view name_of(TruthVerdict verdict);

/// What became of a detected region.
enum class FoundVerdict {
  correct,    ///< is its true region
  part,       ///< one of several that together make up an over-segmented true region
  fused,      ///< covers several true regions
  noise,      ///< none of these
  not_judged  ///< too small, or on a true region that is not judged itself
};
std::string_view name_of(FoundVerdict verdict);

/// One true and one detected region that meet.
struct Overlap {
  std::size_t truth = 0, found = 0;  ///< indices
  double truth_share = 0;            ///< of the true region, covered by the detected one
  double found_share = 0;            ///< of the detected region, lying on the true one
};

struct HooverRegions {
  std::vector<bool> truth_judged;  ///< per true region
  std::vector<bool> found_judged;  ///< per detected region: large enough to be called noise
  /// Per true region: share of it covered by all detected regions that each lie on it with a share
  /// of `threshold` or more.
  std::vector<double> covered_by_parts;
};

struct HooverResult {
  std::vector<TruthVerdict> truth;                ///< per true region
  std::vector<FoundVerdict> found;                ///< per detected region
  std::vector<std::optional<std::size_t>> match;  ///< per true region: index of the correct one
};

/// The T % rule, with T = `threshold` in (0.5, 1]:
/// - correct: truth_share ≥ T and found_share ≥ T. One to one: of several (layers on top of one
///   another) the pair with the largest smaller share wins, ties by index.
/// - over-segmented: not correct; at least two detected regions lie on it with found_share ≥ T, and
///   together they cover ≥ T of it.
/// - under-segmented: neither; a detected region covers ≥ T of it and ≥ T of at least one more.
///   (Unlike Hoover's, the rule does not ask that the detected region ends with these: a kerb that
///   vanished in the floor is under-segmented although the floor is correct.)
/// - missed: all else.
/// A detected region is noise if it is judged and took part in none of these, nor lies with ≥ T on
/// a true region that is not judged. Cost O(n log n) in overlaps.
HooverResult hoover(const HooverRegions& regions, const std::vector<Overlap>& overlaps, double threshold);

}  // namespace octosurf::evaluation
