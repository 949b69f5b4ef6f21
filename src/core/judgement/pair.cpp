#include "judgement/pair.hpp"

#include "geometry/median.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace octosurf::judgement {
namespace {

/// Places by which a pair is judged: that more than half of 30 differ where one in five does, which is the
/// worst of right pairs, has a chance of 5e-5, if they do so independently. Somebody who walks past is seen
/// through, while the rest agrees. Of surfaces in wrong places those within four tolerances are off by more
/// than one at 3/4, in right ones at hardly any: 1/4 lies between. With less than 10 such places that is not
/// known.
constexpr std::size_t fewest_places = 30, off_in = 4, fewest_surfaces = 10;

/// Where a surface is searched for along the normal, in tolerances.
constexpr float search_reach = 4;
/// Points of 3 × 3 cells: with four what is seen there has no gaps. One offset in three is kept, for effort:
/// 30,000 of a run determine nine numbers well.
constexpr std::size_t fewest_seen = 4, offsets_in = 3;

/// Places count as moved from two tolerances on: along their normals all are off then, as most in all
/// directions are. By one motion: within these, and a tenth of the way, by which a turn of 25° differs from
/// its derivative.
constexpr float moved_tolerances = 2, moved_share = 0.1F;
/// So many agree before any is compared, lest a few places along an edge speak for a direction: that five of
/// right ones, one in ten of which is off, are so has a chance of 1e-5. And the least cosine to the motion of
/// those that say how far it is: 70°.
constexpr double agree_before = 5, facing = 0.3;

/// m; m where no class has samples enough for a median: a usual sensor's.
constexpr float first_range = 0.06F, classes_of_octave = 3, usual_noise = 0.005F;

using Motion = Eigen::Matrix<double, 6, 1>;  // turn, times the range, and shift

struct Surface {      // that both views see
  Motion by;          // derivative of its distance by a motion of the first view
  double off = 0;     // m, how far that is to move it; 0: it agrees, or no motion does
  double within = 0;  // m
};

/// Points of the other view in the direction of a sample.
struct Seen {
  std::vector<float> offsets;  // m, from the sample along its normal
  std::vector<float> beside;   // of those that lie near it
  Eigen::Vector3f sum_beside = Eigen::Vector3f::Zero();
  float nearest = std::numeric_limits<float>::infinity();  // m

  /// In 3 × 3 cells about a sample at `p`; beside it: by `reach` along its normal, and less than `aside`
  /// across.
  void look(const View& into, Cell cell, const Eigen::Vector3f& p, const Eigen::Vector3f& normal, float reach,
            float aside) {
    *this = {std::move(offsets), std::move(beside)};
    offsets.clear();
    beside.clear();
    into.around(cell, 1, [&](const Eigen::Vector3f& q) {
      const Eigen::Vector3f d = q - p;
      const float along = d.dot(normal);
      nearest = std::min(nearest, q.norm());
      offsets.push_back(along);
      if (std::fabs(along) > reach || d.squaredNorm() - along * along >= aside * aside) return;
      beside.push_back(along);
      sum_beside += q;
    });
  }
  /// They are of a parallel plane farther on; `away`: where the view looks, along the normal.
  bool lie_beyond(float off, float away, float reach, float tolerance) const {
    const auto [low, high] = std::ranges::minmax(offsets);
    return off * away > 0 && std::fabs(off) > reach &&
           high - low < moved_tolerances * tolerance + moved_share * std::fabs(off);
  }
};

}  // namespace

Tolerance::Tolerance(const std::vector<const View*>& views, double resolution) : resolution_(resolution) {
  std::array<std::vector<float>, classes> scatters;
  for (const View* const view : views)
    for (const Sample& sample : view->samples)
      if (sample.flat) scatters[class_of(sample.range)].push_back(sample.scatter);
  constexpr std::size_t enough = 20;
  float known = 0;
  for (std::size_t c = 0; c < classes; ++c) {
    if (scatters[c].size() > enough) known = geometry::median_of(scatters[c]);
    noise_[c] = known;
  }
  known = usual_noise;
  for (std::size_t c = classes; c-- > 0;) noise_[c] = known = noise_[c] > 0 ? noise_[c] : known;
}

std::size_t Tolerance::class_of(float range) {
  const float octaves = std::log2(std::max(first_range, range) / first_range);
  return static_cast<std::size_t>(std::min(static_cast<float>(classes - 1), classes_of_octave * octaves));
}

bool Places::judged() const { return all() >= fewest_places; }
bool Places::measure(const Eigen::Vector3d& direction) const {
  return direction.dot(normals * direction) >= static_cast<double>(fewest_surfaces);
}
bool Places::contradict() const {
  const std::size_t surfaces = agree + off;
  return judged() &&
         (moves() || (2 * apart() > all() && surfaces >= fewest_surfaces && off_in * off > surfaces));
}

namespace {

/// Compares the views both ways.
class Comparison {
 public:
  Comparison(const View& a, const View& b, const Tolerance& tolerance, std::vector<Offset>& offsets)
      : tolerance_(&tolerance),
        offsets_(&offsets),
        middle_((a.T_map_view.translation() + b.T_map_view.translation()) / 2),
        lever_(static_cast<double>(std::max(a.range, b.range))) {
    compare(a, b, 1);
    compare(b, a, -1);
    find_motion();
  }
  const Places& places() const { return places_; }

 private:
  /// The samples of `from` with the points of `into`.
  void compare(const View& from, const View& into, double sign);
  void note_surface(const View& from, const Sample& sample, double sign, float off, float tolerance);
  void find_motion();

  const Tolerance* tolerance_;
  std::vector<Offset>* offsets_;
  Eigen::Vector3d middle_;
  double lever_;
  Places places_;
  std::vector<Surface> surfaces_;
};

void Comparison::compare(const View& from, const View& into, double sign) {
  const Eigen::Isometry3f T = (into.T_map_view.inverse() * from.T_map_view).cast<float>();
  const auto resolution = static_cast<float>(tolerance_->resolution());
  Seen seen;
  for (const Sample& sample : from.samples) {
    const Eigen::Vector3f p = T * sample.point;
    const float range = p.norm(), w = tolerance_->at(range, sample.range), reach = search_reach * w;
    const Cell cell = into.cell_of(p);
    const Eigen::Vector3f normal = T.linear() * sample.normal;
    const float aside = std::max(resolution, sample.spread);
    seen.look(into, cell, p, normal, reach, sample.flat ? aside : 0);
    if (seen.offsets.size() < fewest_seen) continue;
    const float away = normal.dot(p);
    const bool same_side = away * sample.normal.dot(sample.point) > 0;
    if (seen.beside.size() >= 2) {
      if (!same_side) continue;  // it is another face of the thing, as a wall has two
      const float off = geometry::median_of(seen.beside);
      ++(std::fabs(off) < w ? places_.agree : places_.off);
      note_surface(from, sample, sign, off, w);
      if ((places_.agree + places_.off) % offsets_in == 0)
        offsets_->push_back(
            offset_of(from, sample, into, seen.sum_beside / static_cast<float>(seen.beside.size()), off));
      continue;
    }
    // Behind what is seen it is hidden: that says nothing.
    const float off = geometry::median_of(seen.offsets);
    if (sample.flat && same_side && seen.lie_beyond(off, away, reach, w)) {
      ++places_.through;
      note_surface(from, sample, sign, off, w);
      continue;
    }
    bool hit = false;
    into.around(cell, 0, [&](const Eigen::Vector3f&) { hit = true; });
    if (!hit || range > seen.nearest - reach) continue;
    ++places_.through;
    if (sample.flat) note_surface(from, sample, sign, 0, w);
  }
}

void Comparison::note_surface(const View& from, const Sample& sample, double sign, float off,
                              float tolerance) {
  const Eigen::Vector3d normal = from.T_map_view.linear() * sample.normal.cast<double>();
  const Eigen::Vector3d at = from.T_map_view * sample.point.cast<double>() - middle_;
  Surface surface;
  surface.by << at.cross(normal) / lever_, normal;
  surface.by *= sign;
  surface.off = std::fabs(off) < moved_tolerances * tolerance ? 0 : static_cast<double>(off);
  surface.within = static_cast<double>(moved_tolerances * tolerance + moved_share * std::fabs(off));
  surfaces_.push_back(surface);
}

/// Each surface that is off votes for motions along its normal, with its sign: what somebody hid or brought
/// along is seen through in both views and cancels out. Of the motion that they determine together, the
/// median distance.
void Comparison::find_motion() {
  Eigen::Matrix<double, 6, 6> information = agree_before * Eigen::Matrix<double, 6, 6>::Identity();
  Motion votes = Motion::Zero();
  for (const Surface& surface : surfaces_) {
    information.selfadjointView<Eigen::Lower>().rankUpdate(surface.by);
    if (surface.off != 0) votes += std::copysign(1.0, surface.off) * surface.by;
  }
  places_.normals = information.bottomRightCorner<3, 3>().selfadjointView<Eigen::Lower>();
  places_.normals.diagonal().array() -= agree_before;
  if (votes.isZero()) return;
  const Motion direction = information.selfadjointView<Eigen::Lower>().ldlt().solve(votes).normalized();
  std::vector<double> steps;
  for (const Surface& surface : surfaces_)
    if (surface.off != 0 && std::fabs(surface.by.dot(direction)) > facing)
      steps.push_back(surface.off / surface.by.dot(direction));
  if (steps.empty()) return;
  const double step = geometry::median_of(steps);
  double moved = 0, all = agree_before;
  for (const Surface& surface : surfaces_) {
    const double along = surface.by.dot(direction);
    all += along * along;
    if (surface.off != 0 && std::fabs(surface.off - step * along) < surface.within) moved += along * along;
  }
  places_.moved = moved / all;
  places_.along = direction.tail<3>();
}

}  // namespace

Places compare(const View& a, const View& b, const Tolerance& tolerance, std::vector<Offset>& offsets) {
  return Comparison(a, b, tolerance, offsets).places();
}

}  // namespace octosurf::judgement
