#include "alignment/recording_check.hpp"

#include "geometry/directions.hpp"
#include "geometry/median.hpp"
#include "geometry/voxel_key.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

namespace octosurf::alignment {
namespace {

using geometry::packed_cell;

constexpr std::size_t most_views = 2 * RecordingCheck::enough_views;  // effort, memory
constexpr std::size_t readings_kept = 2000;  // of a view: as dense as cells, in a view of 60°
/// Of a scan one reading in so many at most: neighbours on a line repeat each other. A lidar's lines make a
/// view together.
constexpr std::size_t of_a_scan = 8;
constexpr double moved_m = 0.15, turned_rad = 10 * std::numbers::pi / 180;  // from view to view, at least
constexpr std::size_t least_views = 4;
/// A cell's share of the usual range: larger than errors of poses and readings, far smaller than those of
/// poses in another form.
constexpr double cell_share = 0.015;
/// The same where small errors are compared: a camera's noise, a degree's arc.
constexpr double fine_cell_share = 0.006;
constexpr double farthest_cell = (1 << 20) - 1;  // of geometry::packed_cell(), its neighbours included
/// In the other form at most half of the readings may be unmatched, compared with the given form, and this
/// share more matched. Wrong poses match a third by chance, right ones all but newly seen places.
constexpr double alone_share = 0.5, more_laid = 0.2;

bool far_better(double other, double given) {
  return other >= given + more_laid && 1 - other <= alone_share * (1 - given);
}

/// Cells are finer than readings are dense, so that right scans match by 0.1 to 0.9 of them. Those that match
/// best are the right ones, in all recordings tried; what is right but for noise, drift and a tenth of the
/// errors looked for is within a tenth of it.
bool is_clear(double other, double given) {
  constexpr double least = 0.05, more = 1.25;
  return other >= given + least && (other >= more * given || 1 - other <= alone_share * (1 - given));
}

/// Of readings to poses: millimetres, centimetres, inches, feet, tenths, the quarters, fifths, eighths and
/// tenths of millimetres that cameras count in, and a halved or doubled scale.
constexpr std::array scales{0.001, 0.01,   0.0254, 0.1, 0.125, 0.2,  0.25,  0.3048, 0.5,
                            2.0,   3.2808, 4.0,    5.0, 8.0,   10.0, 39.37, 100.0,  1000.0};

/// A meaning to be tried with `value` and its opposite, refined by steps from `step` on.
struct Trial {
  Meaning meaning;
  double value, step;
  double opposite() const {
    return meaning == Meaning::scale || meaning == Meaning::focal ? 1 / value : -value;
  }
};
constexpr double turn_rad = 5 * std::numbers::pi / 180;
/// Of errors that are not of form or unit: sizes that scans show, and that people make.
constexpr std::array trials{Trial{Meaning::late, 0.05, 0.02},
                            Trial{Meaning::late, 0.1, 0.05},
                            Trial{Meaning::late, 0.2, 0.1},
                            Trial{Meaning::late, 0.4, 0.1},
                            Trial{Meaning::scale, 1.1, 0.05},
                            Trial{Meaning::scale, 1.25, 0.1},
                            Trial{Meaning::focal, 1.1, 0.05},
                            Trial{Meaning::focal, 1.25, 0.1},
                            Trial{Meaning::turned_x, turn_rad, turn_rad / 2},
                            Trial{Meaning::turned_y, turn_rad, turn_rad / 2},
                            Trial{Meaning::turned_z, turn_rad, turn_rad / 2}};

bool is_form(Meaning meaning) { return static_cast<std::size_t>(meaning) < pose_forms; }

/// Factors on a reading's coordinates.
Eigen::Vector3d factors_of(Meaning meaning, double value) {
  switch (meaning) {
    case Meaning::mirrored_x:
      return {-1, 1, 1};
    case Meaning::mirrored_y:
      return {1, -1, 1};
    case Meaning::focal:
      return {value, value, 1};
    default:
      return {1, 1, 1};
  }
}

/// x right, y down, z forward in x forward, y left, z up.
const Eigen::Matrix3d& R_body_camera() {
  static const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return R;
}

}  // namespace

Eigen::Isometry3d pose_from(Meaning form, const Eigen::Isometry3d& pose) {
  const bool inverse = form == Meaning::inverse || form == Meaning::opengl_inverse;
  Eigen::Isometry3d T = inverse ? pose.inverse() : pose;
  if (form == Meaning::opengl || form == Meaning::opengl_inverse)
    T.linear() *= Eigen::Vector3d(1, -1, -1).asDiagonal();
  if (form == Meaning::w_first) {
    const Eigen::Quaterniond q(pose.linear());
    T.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  }
  if (form == Meaning::of_camera) T.linear() *= R_body_camera().transpose();
  if (form == Meaning::of_body) T.linear() *= R_body_camera();
  return T;
}

void RecordingCheck::add(const Scan& scan) {
  ascending_ &= poses_.empty() || scan.stamp_s > poses_.back().stamp_s;
  poses_.push_back({scan.stamp_s, scan.T_map_sensor});
  const Eigen::Isometry3d motion = place_.inverse() * scan.T_map_sensor;
  const bool moved = taken_ == 0 || motion.translation().norm() >= moved_m ||
                     Eigen::AngleAxisd(motion.linear()).angle() >= turned_rad;
  const bool continues = taken_ > 0 && open_readings_ < readings_kept;
  if (!moved && !continues) return;
  Part part{scan.stamp_s, scan.T_map_sensor, {}};
  const std::size_t step = std::max(of_a_scan, scan.points.size() / readings_kept);
  for (std::size_t i = step / 2; i < scan.points.size(); i += step)
    if (scan.points[i].allFinite()) part.points.push_back(scan.points[i]);
  if (part.points.empty()) return;
  cameras_ &= scan.sensor == SensorKind::depth_camera;
  if (!continues) {
    place_ = scan.T_map_sensor;
    open_readings_ = 0;
    keeps_ = taken_++ % every_ == 0;
    if (keeps_ && views_.size() == most_views) {
      for (std::size_t i = 0; i < most_views / 2; ++i) views_[i] = std::move(views_[2 * i]);
      views_.resize(most_views / 2);
      every_ *= 2;
    }
    if (keeps_) views_.emplace_back();
  }
  open_readings_ += part.points.size();
  if (!keeps_) return;
  views_.back().push_back(std::move(part));
}

std::optional<Eigen::Isometry3d> RecordingCheck::pose_of(const Part& part, Meaning meaning,
                                                         double value) const {
  if (is_form(meaning)) return pose_from(meaning, part.pose);
  Eigen::Isometry3d T = part.pose;
  if (meaning == Meaning::scale) T.translation() *= value;
  if (meaning == Meaning::late) {
    const double stamp_s = part.stamp_s + value;
    const auto after = std::ranges::upper_bound(poses_, stamp_s, {}, &StampedPose::stamp_s);
    if (after == poses_.begin() || after == poses_.end()) return {};
    const StampedPose &a = *(after - 1), &b = *after;
    return geometry::pose_between(a.T_map_sensor, b.T_map_sensor,
                                  (stamp_s - a.stamp_s) / (b.stamp_s - a.stamp_s));
  }
  for (const auto& [turned, axis] :
       {std::pair(Meaning::turned_x, 0), std::pair(Meaning::turned_y, 1), std::pair(Meaning::turned_z, 2)})
    if (meaning == turned) T.rotate(Eigen::AngleAxisd(value, Eigen::Vector3d::Unit(axis)));
  return T;
}

RecordingCheck::Laid RecordingCheck::share_laid(Meaning meaning, double value, double cell,
                                                std::size_t thin) const {
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen;
  const Eigen::Vector3d factors = factors_of(meaning, value) / cell;
  std::vector<double> shares;
  for (const View& view : views_) {
    std::vector<std::uint64_t> own;
    std::size_t i = 0, laid = 0, all = 0;
    for (const Part& part : view) {
      std::optional<Eigen::Isometry3d> T = pose_of(part, meaning, value);
      if (!T) {  // matches nothing, lest a meaning gain by what it leaves out
        if (!seen.empty()) all += part.points.size() / thin;
        continue;
      }
      T->translation() /= cell;
      for (const Eigen::Vector3f& point : part.points) {
        const bool tested = !seen.empty() && i++ % thin == 0;
        all += tested ? 1 : 0;
        const Eigen::Vector3d at = *T * point.cast<double>().cwiseProduct(factors);
        if (!(at.array().abs() < farthest_cell).all()) continue;
        const Eigen::Vector3i middle = at.array().floor().cast<int>();
        own.push_back(packed_cell(middle));
        for (int k = 0; tested && k < 27; ++k)
          if (seen.contains(packed_cell(middle + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)))) {
            ++laid;
            break;
          }
      }
    }
    seen.insert(own.begin(), own.end());
    if (all > 0) shares.push_back(static_cast<double>(laid) / static_cast<double>(all));
  }
  if (shares.empty()) return {};
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  return {sum / static_cast<double>(shares.size()), geometry::median_of(shares)};
}

double RecordingCheck::usual_range() const {
  std::vector<float> ranges;
  for (const View& view : views_)
    for (const Part& part : view)
      for (const Eigen::Vector3f& point : part.points) ranges.push_back(point.norm());
  return ranges.empty() ? 0 : static_cast<double>(geometry::median_of(ranges));
}

std::optional<Meaning> RecordingCheck::better_form() const {
  const double cell = cell_share * usual_range();
  if (views_.size() < least_views || !(cell > 0)) return {};
  const double given = share_laid(Meaning::as_given, 0, cell).mean;
  std::optional<Meaning> best;
  double most = 0;
  for (const Meaning form : {Meaning::inverse, Meaning::w_first, Meaning::opengl, Meaning::opengl_inverse,
                             Meaning::of_camera, Meaning::of_body}) {
    const bool any = form == Meaning::inverse || form == Meaning::w_first;
    if (!any && cameras_ != (form != Meaning::of_camera)) continue;
    const double share = share_laid(form, 0, cell).mean;
    if (share > most) most = share, best = form;
  }
  return far_better(most, given) ? best : std::nullopt;
}

double RecordingCheck::share_seen_through(double scale) const {
  constexpr double bin_rad = 3 * std::numbers::pi / 180;  // twice as wide as readings lie apart
  constexpr double before = 0.8;                          // of the nearest range of a bin
  const auto bin_of = [&](const Eigen::Vector3d& p) {
    const double azimuth = std::atan2(p.y(), p.x()), elevation = std::atan2(p.z(), p.head<2>().norm());
    return packed_cell({static_cast<int>(std::floor(azimuth / bin_rad)),
                        static_cast<int>(std::floor(elevation / bin_rad)), 0});
  };
  std::vector<double> shares;
  for (std::size_t k = 1; k < views_.size(); ++k) {
    const Part& eye = views_[k - 1].front();
    tsl::robin_map<std::uint64_t, double, geometry::PackedKeyHash> nearest;
    for (const Eigen::Vector3f& point : eye.points) {
      const auto p = point.cast<double>().eval();
      double& range = nearest.try_emplace(bin_of(p), p.norm()).first.value();
      range = std::min(range, p.norm());
    }
    std::size_t through = 0, met = 0;
    for (const Part& part : views_[k]) {
      Eigen::Isometry3d T = eye.pose.inverse() * part.pose;
      T.translation() *= scale;
      for (const Eigen::Vector3f& point : part.points) {
        const Eigen::Vector3d p = T * point.cast<double>();
        const auto found = nearest.find(bin_of(p));
        if (found == nearest.end()) continue;
        ++met;
        through += p.norm() < before * found->second ? 1 : 0;
      }
    }
    if (met > 0) shares.push_back(static_cast<double>(through) / static_cast<double>(met));
  }
  return shares.empty() ? 0 : geometry::median_of(shares);
}

std::optional<double> RecordingCheck::better_scale() const {
  const double cell = cell_share * usual_range();
  if (views_.size() < least_views || !(cell > 0)) return {};
  const double given = share_laid(Meaning::as_given, 0, cell).median;
  if (!far_better(1, given)) return {};
  double most = 0, best = 1;
  // The readings stay, with their cells, and the positions are scaled, so that no scale is favoured.
  for (const double scale : scales)
    if (const double share = share_laid(Meaning::scale, scale, cell).median; share > most)
      most = share, best = scale;
  if (!far_better(most, given)) return {};
  // Along a floor or a corridor, positions that are drawn together fit better, right or not. So it takes a
  // scale that fits better than no motion at all, or rays through what others have seen: a hundredth of right
  // poses' readings, and a tenth or more of wrong ones'.
  constexpr double many_through = 0.05;
  const double through = share_seen_through();
  const bool crossed = through > many_through && share_seen_through(best) < through / 2;
  if (!crossed && !far_better(most, share_laid(Meaning::scale, 0, cell).median)) return {};
  return best;
}

std::optional<RecordingCheck::Finding> RecordingCheck::better_meaning() const {
  constexpr std::size_t thin = 3;  // effort
  const double cell = fine_cell_share * usual_range();
  if (views_.size() < least_views || !(cell > 0)) return {};
  const double given = share_laid(Meaning::as_given, 0, cell, thin).mean;
  Finding best{Meaning::as_given, 0, given, given};
  double step = 0;
  // As in better_scale().
  const double still = share_laid(Meaning::scale, 0, cell, thin).mean;
  const auto attempt = [&](Meaning meaning, double value) {
    const double share = share_laid(meaning, value, cell, thin).mean;
    if (share <= best.share || (meaning == Meaning::scale && !is_clear(share, still))) return false;
    best = {meaning, value, share, given};
    return true;
  };
  for (const Trial& trial : trials) {
    if ((trial.meaning == Meaning::focal && !cameras_) || (trial.meaning == Meaning::late && !ascending_))
      continue;
    for (const double value : {trial.value, trial.opposite()})
      if (attempt(trial.meaning, value)) step = trial.step;
  }
  for (const Meaning mirrored : {Meaning::mirrored_x, Meaning::mirrored_y})
    if (attempt(mirrored, 0)) step = 0;
  if (!is_clear(best.share, given)) return {};
  for (; step > 0 && step > std::fabs(best.value) / 100; step /= 2) {
    const double value = best.value;
    attempt(best.meaning, value - step);
    attempt(best.meaning, value + step);
  }
  return best;
}

}  // namespace octosurf::alignment
