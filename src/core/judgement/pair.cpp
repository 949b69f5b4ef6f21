#include "judgement/pair.hpp"

#include "geometry/median.hpp"

#include <cmath>
#include <limits>

namespace octosurf::judgement {
namespace {

/// Places by which a pair is judged: that more than half of 30 differ where one in five does, which is the
/// worst of right pairs, has a chance of 5e-5, if they do so independently. Somebody who walks past is seen
/// through, while the rest agrees. Of surfaces in wrong places those within four tolerances are off by more
/// than one at 3/4, in right ones at hardly any: 1/4 lies between. With less than 10 such places that is not
/// known.
constexpr std::size_t fewest_places = 30, off_in = 4, fewest_surfaces = 10;

/// Where a surface is searched for: in tolerances along the normal, and beside the sample as a share of its
/// range, 1.7°, a little more than a cell.
constexpr float search_reach = 4, beside_share = 0.03F;
/// Points of 3 × 3 cells: without three nothing is known, and with four what is seen there has no gaps. One
/// offset in three is kept, for effort: 30,000 of a run determine nine numbers well.
constexpr std::size_t fewest_seen = 3, fewest_filled = 4, offsets_in = 3;

/// m; m where no class has samples enough for a median: a usual sensor's.
constexpr float first_range = 0.06F, classes_of_octave = 3, usual_noise = 0.005F;

/// What lies beside a sample.
struct Beside {
  std::vector<float> offsets;  // along the sample's normal, from it to the other view's points
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
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
bool Places::contradict() const {
  const std::size_t surfaces = agree + off;
  return judged() && 2 * apart() > all() && (surfaces < fewest_surfaces || off_in * off > surfaces);
}

namespace {

/// The samples of `from` with the points of `into`.
void compare_one_way(const View& from, const View& into, const Tolerance& tolerance, Places& places,
                     std::vector<Offset>& offsets) {
  const Eigen::Isometry3f T = (into.T_map_view.inverse() * from.T_map_view).cast<float>();
  const auto resolution = static_cast<float>(tolerance.resolution());
  Beside found;
  for (const Sample& sample : from.samples) {
    const Eigen::Vector3f p = T * sample.point;
    const float range = p.norm(), w = tolerance.at(range, sample.range), reach = search_reach * w;
    const Cell cell = cell_of(p);
    const Eigen::Vector3f normal = T.linear() * sample.normal;
    const float aside = std::max(resolution, beside_share * std::max(range, sample.range));
    found.offsets.clear();
    found.sum.setZero();
    std::size_t seen = 0;
    float nearest = std::numeric_limits<float>::infinity();
    into.around(cell, 1, [&](const Eigen::Vector3f& q) {
      ++seen;
      nearest = std::min(nearest, q.squaredNorm());
      if (!sample.flat) return;
      const Eigen::Vector3f d = q - p;
      const float along = d.dot(normal);
      if (std::fabs(along) > reach || d.squaredNorm() - along * along > aside * aside) return;
      found.offsets.push_back(along);
      found.sum += q;
    });
    if (seen < fewest_seen) continue;
    if (found.offsets.size() >= 2) {
      const float off = geometry::median_of(found.offsets);
      ++(std::fabs(off) < w ? places.agree : places.off);
      if ((places.agree + places.off) % offsets_in == 0)
        offsets.push_back(
            offset_of(from, sample, into, found.sum / static_cast<float>(found.offsets.size()), off));
      continue;
    }
    bool hit = false;
    into.around(cell, 0, [&](const Eigen::Vector3f&) { hit = true; });
    // Behind what is seen it is hidden: that says nothing.
    if (hit && seen >= fewest_filled && range < std::sqrt(nearest) - reach) ++places.through;
  }
}

}  // namespace

Places compare(const View& a, const View& b, const Tolerance& tolerance, std::vector<Offset>& offsets) {
  Places places;
  compare_one_way(a, b, tolerance, places, offsets);
  compare_one_way(b, a, tolerance, places, offsets);
  return places;
}

}  // namespace octosurf::judgement
