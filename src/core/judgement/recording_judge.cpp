#include "geometry/median.hpp"
#include "judgement/common_error.hpp"
#include "judgement/oddities.hpp"
#include "judgement/pair.hpp"
#include "judgement/spread.hpp"
#include "judgement/view.hpp"
#include "sensing/downsample.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <optional>
#include <utility>

#include <octosurf/judgement.hpp>

namespace octosurf {
namespace judgement {
namespace {

/// Views are compared each with each, at 0.1 ms a pair: 36 take 0.1 s. Twice as many are kept, as half of
/// them go when there are too many; of scans of each oddity at most eight, as four, with 36 partners each,
/// tell a tenth from none.
constexpr std::size_t most_compared = 36, most_kept = 2 * most_compared, most_odd = 8;
/// A scan of fewer readings leaves most cells empty, as a tilting laser's line does, and is joined with those
/// after it to a sweep of so many, unless the sensor is a tenth of the range farther on: up to there things
/// look nearly the same.
constexpr std::size_t enough_readings = 4000, readings_of_sweep = 16000;
constexpr double same_place = 0.1;

/// Whether the pairs of some views contradict by the same rule, and half as often again as all: else what
/// stands out about them is not the cause.
bool convicts(const Judgement& some, const Judgement& all) {
  return some.many_pairs() && 2 * some.contradicting * all.pairs > 3 * all.contradicting * some.pairs;
}

/// Evenly spread, and numbered.
std::vector<const View*> chosen(std::vector<View>& kept) {
  std::vector<const View*> views;
  const std::size_t count = std::min(most_compared, kept.size());
  for (std::size_t k = 0; k < count; ++k) {
    View& view = kept[k * kept.size() / count];
    view.number = k;
    views.push_back(&view);
  }
  return views;
}

/// A judged one.
struct Pair {
  std::size_t before, after;  // indices of scans
  bool contradict;
};

/// Of the axes of all normals, the one along which most pairs contradict.
void judge_axes(const std::vector<Places>& pairs, Judgement& verdict) {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  for (const Places& pair : pairs) normals += pair.normals;
  const Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors();
  for (Eigen::Index k = 0; k < 3; ++k) {
    std::size_t measured = 0, moved = 0;
    for (const Places& pair : pairs) {
      if (!pair.measure(axes.col(k))) continue;
      Eigen::Index nearest = 0;
      (axes.transpose() * pair.along).cwiseAbs().maxCoeff(&nearest);
      ++measured;
      moved += pair.moves() && nearest == k;
    }
    if (moved < 2 || moved * verdict.axis_pairs < verdict.axis_contradicting * measured) continue;
    verdict.axis = axes.col(k).sum() < 0 ? Eigen::Vector3d(-axes.col(k)) : Eigen::Vector3d(axes.col(k));
    verdict.axis_pairs = measured;
    verdict.axis_contradicting = moved;
  }
}

/// Each view with each; what they say of pairs, scans and a common error is in the verdict.
std::vector<Pair> judge_pairs(const std::vector<const View*>& views, const Tolerance& tolerance,
                              Judgement& verdict) {
  std::vector<Pair> pairs;
  std::vector<Places> judged;
  std::vector<Offset> offsets;
  std::vector<std::size_t> partners(views.size()), contradicted(views.size());
  double most = 0;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      const View &a = *views[i], &b = *views[j];
      const Places places = compare(a, b, tolerance, offsets);
      if (!places.judged()) continue;
      judged.push_back(places);
      const bool contradict = places.contradict();
      pairs.push_back({a.scan, b.scan, contradict});
      for (const std::size_t one : {i, j}) {
        ++partners[one];
        contradicted[one] += contradict;
      }
      verdict.contradicting += contradict;
      const double apart = static_cast<double>(places.apart()) / static_cast<double>(places.all());
      if (const double bad = apart + (contradict ? 1 : 0); bad > most) {
        most = bad;
        verdict.worst = {a.name, b.name};
        verdict.worst_places = places.all();
        verdict.worst_apart = places.apart();
      }
    }
  verdict.pairs = pairs.size();
  judge_axes(judged, verdict);
  for (std::size_t i = 0; i < views.size(); ++i) {
    (views[i]->sparse ? verdict.sparse : verdict.alone) += partners[i] == 0;
    if (partners[i] < 3) continue;  // no majority
    ++verdict.judged;
    if (2 * contradicted[i] > partners[i]) verdict.outvoted.push_back(views[i]->name);
  }
  const CommonError common = common_error(offsets, tolerance.resolution());
  verdict.common_error = common.explains;
  verdict.common_error_m = common.moves_m;
  return pairs;
}

}  // namespace
}  // namespace judgement

using judgement::Oddities;
using judgement::View;

struct RecordingJudge::Impl {
  explicit Impl(const Parameters& parameters) : occupancy(parameters.occupancy) {}

  void add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor);
  Judgement judge() const;

  View view_of(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) const;
  /// At most most_readings of those that are mapped.
  std::vector<Eigen::Vector3f> readings_of(const Scan& scan) const;
  void join(const Scan& scan, const Eigen::Isometry3d& T_map_sensor);
  void keep_open_view();
  void judge_oddities(const std::vector<const View*>& compared, const judgement::Tolerance& tolerance,
                      const std::vector<judgement::Pair>& pairs, Judgement& verdict) const;

  OccupancyParameters occupancy;
  judgement::Spread<View> views{judgement::most_kept};
  std::optional<View> open;  // that is being joined
  std::size_t open_readings = 0;
  bool wanted = false;
  std::array<judgement::Spread<View>, Oddities::kinds> odd{judgement::Spread<View>{judgement::most_odd},
                                                           judgement::Spread<View>{judgement::most_odd},
                                                           judgement::Spread<View>{judgement::most_odd}};
  Oddities oddities;
  std::size_t scans = 0;
  double lever_m = 1;  // range of the last view
  std::optional<Eigen::Isometry3d> T_map_last;
};

View RecordingJudge::Impl::view_of(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) const {
  View view;
  view.name = scan.name;
  view.scan = scans;
  view.camera = scan.sensor == SensorKind::depth_camera;
  view.T_map_view = T_map_sensor;
  view.T_map_before = T_map_last;
  return view;
}

std::vector<Eigen::Vector3f> RecordingJudge::Impl::readings_of(const Scan& scan) const {
  const double most_m = occupancy.max_range.value_or(sensing::default_max_range(scan.sensor));
  std::vector<Eigen::Vector3f> readings = judgement::thinned(scan.points);
  std::erase_if(readings, [&](const Eigen::Vector3f& reading) {
    const auto range = static_cast<double>(reading.norm());
    return !(range > 0 && range >= occupancy.min_range && range <= most_m);  // NaN goes
  });
  return readings;
}

void RecordingJudge::Impl::add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
  View* const last = open ? &*open : views.kept().empty() ? nullptr : &views.kept().back();
  if (last != nullptr && last->scan + 1 == scans) last->T_map_after = T_map_sensor;
  if (const auto kind = oddities.add(scan, T_map_sensor, lever_m)) {
    if (scan.points.size() >= judgement::enough_readings && odd[*kind].wants()) {
      View view = view_of(scan, T_map_sensor);
      view.points = readings_of(scan);
      view.finish();
      odd[*kind].take(std::move(view));
    }
  }
  join(scan, T_map_sensor);
  T_map_last = T_map_sensor;
  ++scans;
}

void RecordingJudge::Impl::join(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
  if (open &&
      (open->T_map_view.translation() - T_map_sensor.translation()).norm() > judgement::same_place * lever_m)
    keep_open_view();
  if (!open) {
    wanted = views.wants();
    open = view_of(scan, T_map_sensor);
    open_readings = 0;
  }
  open_readings += scan.points.size();
  if (wanted) {
    const Eigen::Isometry3f T = (open->T_map_view.inverse() * T_map_sensor).cast<float>();
    const bool first = open->points.empty();
    for (const Eigen::Vector3f& point : readings_of(scan)) open->points.push_back(first ? point : T * point);
  }
  const bool alone = open->scan == scans;
  if (open_readings >= (alone ? judgement::enough_readings : judgement::readings_of_sweep)) keep_open_view();
}

void RecordingJudge::Impl::keep_open_view() {
  if (wanted && !open->points.empty()) {
    open->points = judgement::thinned(open->points);
    open->finish();
    lever_m = static_cast<double>(open->range);
    views.take(std::move(*open));
  }
  open.reset();
}

Judgement RecordingJudge::Impl::judge() const {
  using namespace judgement;
  std::vector<View> all = views.kept();
  if (open && wanted && !open->points.empty()) {
    all.push_back(*open);
    all.back().points = thinned(open->points);
    all.back().finish();
  }
  const std::vector<const View*> compared = chosen(all);
  std::vector<float> ranges;
  for (const View* const view : compared) ranges.push_back(view->range);
  Judgement verdict;
  verdict.views = compared.size();
  verdict.resolution_m = occupancy.resolution;
  verdict.range_m = ranges.empty() ? 0 : static_cast<double>(geometry::median_of(ranges));
  verdict.step_m = oddities.median_step_m();
  const Tolerance tolerance(compared, occupancy.resolution);
  const std::vector<Pair> pairs = judge_pairs(compared, tolerance, verdict);
  judge_oddities(compared, tolerance, pairs, verdict);
  return verdict;
}

void RecordingJudge::Impl::judge_oddities(const std::vector<const View*>& compared,
                                          const judgement::Tolerance& tolerance,
                                          const std::vector<judgement::Pair>& pairs,
                                          Judgement& verdict) const {
  constexpr std::array what{"readings are those of the scan before at ", "the pose is the identity again at ",
                            "the pose is that of the scan before at "};
  std::vector<judgement::Offset> ignored;
  for (std::size_t kind = 0; kind < Oddities::kinds; ++kind) {
    const std::vector<View>& views_of_kind = odd[kind].kept();
    if (views_of_kind.size() < 2) continue;  // one scan is no rule
    Judgement alone;
    for (const View& view : views_of_kind)
      for (const View* const other : compared) {
        if (other->scan == view.scan) continue;
        const judgement::Places places = judgement::compare(view, *other, tolerance, ignored);
        alone.pairs += places.judged();
        alone.contradicting += places.contradict();
      }
    if (judgement::convicts(alone, verdict))
      verdict.oddities.push_back(what[kind] + views_of_kind.front().name);
  }
  const auto step = oddities.longest_step(occupancy.resolution);
  if (!step) return;
  Judgement across;
  for (const judgement::Pair& pair : pairs)
    if (pair.before < step->scan && pair.after >= step->scan) {
      ++across.pairs;
      across.contradicting += pair.contradict;
    }
  if (judgement::convicts(across, verdict)) verdict.oddities.push_back("poses step at " + step->name);
}

RecordingJudge::RecordingJudge(const Parameters& parameters) : impl_(std::make_unique<Impl>(parameters)) {}
RecordingJudge::RecordingJudge(RecordingJudge&&) noexcept = default;
RecordingJudge& RecordingJudge::operator=(RecordingJudge&&) noexcept = default;
RecordingJudge::~RecordingJudge() = default;
void RecordingJudge::add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
  impl_->add(scan, T_map_sensor);
}
Judgement RecordingJudge::judge() const { return impl_->judge(); }

}  // namespace octosurf
