#include "check/search.hpp"

#include "check/rows.hpp"
#include "geometry/parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace octosurf::check {
namespace {

using judgement::CommonParameters;

/// Alternatives are compared in rounds by more and more views, at 0.1 ms a pair; so many go on from each.
struct Round {
  std::size_t views, best;
};
constexpr std::array rounds{Round{6, 12}, Round{12, 2}};
constexpr std::size_t many_views = 20;  // by which the best are fitted
/// Voxels of the map: alternatives may be off by other causes, too, and a number by half a step.
constexpr double forgiving = 6;
/// Of all rows that many are combined with a second one.
constexpr std::size_t best_of_all = 6;
/// What has another cause may come to agree in part. The right one leaves at most a tenth of the
/// contradictions, or no more than right recordings have.
constexpr double most_left_of_contradictions = 0.1, left_of_right = 0.035;
/// Numbers fitted where hardly a pair contradicts: drift looks like a little of each, and is explained by a
/// third.
constexpr double sure_common_error = 0.5;

/// Share of places apart that scans of a right recording have or not.
constexpr double as_good = 0.1;

struct Candidate {
  Meaning meaning;
  std::vector<std::size_t> rows;  // what it was changed by
  Score score;
  double evidence = 0;
};

bool fits(const Candidate& candidate) {
  return std::ranges::any_of(candidate.rows, [](std::size_t row) { return !rows()[row].fitted.isZero(); });
}

bool changes_scale(const Candidate& candidate) {
  return std::ranges::find(candidate.rows, row_of_scales) != candidate.rows.end();
}

double share_of_pairs(const Judgement& judgement) {
  return static_cast<double>(judgement.contradicting) /
         static_cast<double>(std::max<std::size_t>(1, judgement.pairs));
}

bool hardly_contradict(const Judgement& judgement) {
  return sees_enough(judgement) && !judgement.many_pairs();
}

/// Whether a meaning is the cause, and not one that makes some of what another did agree. Of pairs that agree
/// already only a number that explains most of what they are off may be.
bool is_explained(const Judgement& as_given, const Judgement& as_meant, bool is_fitted) {
  if (is_fitted && hardly_contradict(as_given) && as_given.common_error < sure_common_error) return false;
  return share_of_pairs(as_meant) <=
         std::max(most_left_of_contradictions * share_of_pairs(as_given), left_of_right);
}

class Search {
 public:
  Search(const Recording& recording, int threads) : recording_(recording), threads_(threads) {}

  Finding run() {
    Finding finding;
    finding.as_given = judge(recording_, {});
    if (!finding.as_given.contradicts() && sees_enough(finding.as_given)) return finding;
    std::vector<Candidate> singles = changed({}, {});
    // One that leaves scans out has less in common, so all rows have their turn; of those that are about as
    // good in the order of the table.
    std::ranges::stable_sort(singles, std::less<>(), [](const Candidate& one) {
      return std::pair(std::lround(one.score.share_apart() / as_good), one.rows.front());
    });
    if (accept(singles, singles.size(), finding)) return finding;
    std::ranges::stable_sort(singles, std::greater<>(), &Candidate::evidence);
    std::vector<Candidate> pairs;
    std::vector<std::size_t> done;  // rows that were combined with all others
    for (const Candidate& single : singles) {
      if (done.size() == best_of_all) break;
      if (std::ranges::find(done, single.rows.front()) != done.end()) continue;
      for (Candidate& pair : changed(single, done)) pairs.push_back(std::move(pair));
      done.push_back(single.rows.front());
    }
    for (const Meaning& form : common_forms())
      for (Candidate& pair : best_of(row_of_scales, {form, {row_of_forms}, {}, 0}))
        pairs.push_back(std::move(pair));
    std::ranges::stable_sort(pairs, std::greater<>(), &Candidate::evidence);
    accept(pairs, best_of_all, finding);
    return finding;
  }

 private:
  /// What each row but these makes of a meaning, the best first.
  std::vector<Candidate> changed(const Candidate& from, const std::vector<std::size_t>& but) const {
    std::vector<Candidate> all;
    for (std::size_t row = 0; row < rows().size(); ++row) {
      if (std::ranges::find(from.rows, row) != from.rows.end() || std::ranges::find(but, row) != but.end())
        continue;
      for (Candidate& candidate : best_of(row, from)) all.push_back(std::move(candidate));
    }
    std::ranges::stable_sort(all, std::greater<>(), &Candidate::evidence);
    return all;
  }

  std::vector<Candidate> best_of(std::size_t row, const Candidate& from) const {
    std::vector<Candidate> candidates;
    for (Meaning& meaning : rows()[row].alternatives(recording_, from.meaning)) {
      candidates.push_back({std::move(meaning), from.rows, {}, 0});
      candidates.back().rows.push_back(row);
    }
    for (const Round& round : rounds) {
      std::vector<Views> views;
      std::vector<std::size_t> views_of;
      for (const Candidate& candidate : candidates) {
        const auto same = std::ranges::find_if(
            views, [&](const Views& one) { return candidate.meaning.same_readings(one.readings()); });
        views_of.push_back(static_cast<std::size_t>(same - views.begin()));
        if (same == views.end()) views.emplace_back(recording_, candidate.meaning, round.views);
      }
      geometry::share_among(threads_, candidates.size(), [&](std::size_t i) {
        candidates[i].evidence = views[views_of[i]].score(candidates[i].meaning, forgiving).evidence();
      });
      std::ranges::stable_sort(candidates, std::greater<>(), &Candidate::evidence);
      if (candidates.size() > round.best) candidates.resize(round.best);
    }
    geometry::share_among(threads_, candidates.size(), [&](std::size_t i) {
      fit(candidates[i], rows()[row].fitted);
      candidates[i].score =
          Views(recording_, candidates[i].meaning, many_views).score(candidates[i].meaning, 1);
      candidates[i].evidence = candidates[i].score.evidence();
    });
    return candidates;
  }

  /// Gauss and Newton, by ever smaller voxels.
  void fit(Candidate& candidate, const CommonParameters& free) const {
    if (free.isZero()) return;
    Views views(recording_, candidate.meaning, many_views);
    for (const double voxels : {16.0, 8.0, 4.0, 2.0, 1.0, 1.0}) {
      if (!candidate.meaning.same_readings(views.readings()))
        views = Views(recording_, candidate.meaning, many_views);
      std::vector<judgement::Offset> offsets;
      views.score(candidate.meaning, voxels, &offsets);
      for (judgement::Offset& offset : offsets) offset.by = offset.by.cwiseProduct(free.cast<float>());
      change(candidate.meaning,
             judgement::fitted(offsets, voxels * recording_.parameters().occupancy.resolution));
    }
  }

  static void change(Meaning& meaning, const CommonParameters& by) {
    const Eigen::Vector3d turn = by.head<3>();
    const double angle = turn.norm();
    if (angle > 0) meaning.mount.rotate(Eigen::AngleAxisd(angle, turn / angle));
    meaning.mount.pretranslate(by.segment<3>(3));
    if (meaning.reading == Meaning::Reading::inverse_depth)
      meaning.constant *= std::exp(by[6]);
    else
      meaning.pose_scale *= std::exp(-by[6]);
    meaning.focal *= std::exp(-by[7]);
    meaning.aside += by.tail<2>();
    meaning.late += by[8];
  }

  /// The first by which the recording agrees as a right one does.
  bool accept(std::vector<Candidate>& candidates, std::size_t most, Finding& finding) const {
    for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i) {
      settle_scale(recording_, candidates[i].meaning);
      Judgement verdict = judge(recording_, candidates[i].meaning);
      if (verdict.contradicts() || !sees_enough(verdict) || is_degenerate(candidates[i].meaning, verdict))
        continue;
      // Views that have nothing in common speak of units alone.
      if (finding.as_given.pairs == 0 && !changes_scale(candidates[i])) continue;
      // The same views are to agree, but for those of another session.
      const bool one_session = candidates[i].meaning.first_session >= recording_.poses().size();
      if (one_session && 4 * verdict.views < 3 * finding.as_given.views) continue;
      if (!is_explained(finding.as_given, verdict, fits(candidates[i]))) continue;
      finding.meaning = candidates[i].meaning;
      finding.as_meant = std::move(verdict);
      finding.or_drift = fits(candidates[i]) && hardly_contradict(finding.as_given);
      for (const std::size_t row : candidates[i].rows)
        finding.causes.push_back(rows()[row].words(recording_, candidates[i].meaning));
      return true;
    }
    return false;
  }

  /// Readings, or ways between them, that are hardly longer than the tolerance agree whatever they are, and
  /// so do many motions along a single plane. Scans that are left out need no such thing.
  bool is_degenerate(const Meaning& meaning, const Judgement& verdict) const {
    constexpr double fewest_voxels = 10;
    const double least = fewest_voxels * verdict.resolution_m;
    Eigen::AlignedBox3d box;
    for (const Recording::KeptScan& kept : recording_.kept())
      if (const auto T = meaning.pose_of(recording_, kept.index)) box.extend(T->translation());
    if (verdict.range_m < least || (meaning.pose_scale != 1 && box.diagonal().norm() < least)) return true;
    constexpr double fewest_across = 0.02;  // of the normals, on walls beside a floor, or across a corridor
    const bool motions = !meaning.without_odd && meaning.first_session > recording_.poses().size();
    return motions && Views(recording_, meaning, many_views).second_direction(meaning) < fewest_across;
  }

  const Recording& recording_;
  int threads_;
};

}  // namespace

bool sees_enough(const Judgement& judgement) {
  return judgement.pairs > 0 && judgement.pairs >= judgement.views && 4 * judgement.alone <= judgement.views;
}

Finding search(const Recording& recording, int threads) { return Search(recording, threads).run(); }

}  // namespace octosurf::check
