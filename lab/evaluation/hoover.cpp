#include "evaluation/hoover.hpp"

#include <algorithm>
#include <array>
#include <tuple>

namespace octosurf::evaluation {
namespace {

void match_correct(const HooverRegions& regions, const std::vector<Overlap>& overlaps, double threshold,
                   HooverResult& result) {
  std::vector<Overlap> pairs;
  for (const Overlap& pair : overlaps) {
    if (regions.truth_judged[pair.truth] && pair.truth_share >= threshold && pair.found_share >= threshold) {
      pairs.push_back(pair);
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Overlap& a, const Overlap& b) {
    return std::tuple(-std::min(a.truth_share, a.found_share), a.truth, a.found) <
           std::tuple(-std::min(b.truth_share, b.found_share), b.truth, b.found);
  });
  for (const Overlap& pair : pairs) {
    if (result.match[pair.truth] || result.found[pair.found] == FoundVerdict::correct) continue;
    result.match[pair.truth] = pair.found;
    result.truth[pair.truth] = TruthVerdict::correct;
    result.found[pair.found] = FoundVerdict::correct;
  }
}

void find_over_segmented(const HooverRegions& regions, const std::vector<Overlap>& overlaps, double threshold,
                         HooverResult& result) {
  std::vector<int> parts(regions.truth_judged.size(), 0);
  for (const Overlap& pair : overlaps) parts[pair.truth] += pair.found_share >= threshold;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (result.truth[i] == TruthVerdict::missed && parts[i] >= 2 &&
        regions.covered_by_parts[i] >= threshold) {
      result.truth[i] = TruthVerdict::over_segmented;
    }
  }
  for (const Overlap& pair : overlaps) {
    if (pair.found_share >= threshold && result.truth[pair.truth] == TruthVerdict::over_segmented &&
        result.found[pair.found] != FoundVerdict::correct) {
      result.found[pair.found] = FoundVerdict::part;
    }
  }
}

void find_under_segmented(const HooverRegions& regions, const std::vector<Overlap>& overlaps,
                          double threshold, HooverResult& result) {
  const auto covers = [&](const Overlap& pair) {
    return regions.truth_judged[pair.truth] && pair.truth_share >= threshold;
  };
  std::vector<int> covered(result.found.size(), 0);
  for (const Overlap& pair : overlaps) covered[pair.found] += covers(pair);
  for (const Overlap& pair : overlaps) {
    if (covered[pair.found] < 2 || !covers(pair)) continue;
    if (result.truth[pair.truth] == TruthVerdict::missed)
      result.truth[pair.truth] = TruthVerdict::under_segmented;
    if (result.found[pair.found] == FoundVerdict::noise &&
        result.truth[pair.truth] == TruthVerdict::under_segmented) {
      result.found[pair.found] = FoundVerdict::fused;
    }
  }
}

}  // namespace

std::string_view name_of(TruthVerdict verdict) {
  constexpr std::array names{"correct", "over-segmented", "under-segmented", "missed", "not judged"};
  return names.at(static_cast<std::size_t>(verdict));
}

std::string_view name_of(FoundVerdict verdict) {
  constexpr std::array names{"correct", "part", "fused", "noise", "not judged"};
  return names.at(static_cast<std::size_t>(verdict));
}

HooverResult hoover(const HooverRegions& regions, const std::vector<Overlap>& overlaps, double threshold) {
  HooverResult result;
  result.truth.assign(regions.truth_judged.size(), TruthVerdict::missed);
  result.match.resize(regions.truth_judged.size());
  result.found.assign(regions.found_judged.size(), FoundVerdict::noise);
  for (std::size_t i = 0; i < result.truth.size(); ++i) {
    if (!regions.truth_judged[i]) result.truth[i] = TruthVerdict::not_judged;
  }
  match_correct(regions, overlaps, threshold, result);
  find_over_segmented(regions, overlaps, threshold, result);
  find_under_segmented(regions, overlaps, threshold, result);
  const auto excuse = [&result](std::size_t found) {
    if (result.found[found] == FoundVerdict::noise) result.found[found] = FoundVerdict::not_judged;
  };
  for (std::size_t i = 0; i < result.found.size(); ++i) {
    if (!regions.found_judged[i]) excuse(i);
  }
  for (const Overlap& pair : overlaps) {
    if (!regions.truth_judged[pair.truth] && pair.found_share >= threshold) excuse(pair.found);
  }
  return result;
}

}  // namespace octosurf::evaluation
