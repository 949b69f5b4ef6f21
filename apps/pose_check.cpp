#include "pose_check.hpp"

#include "geometry/median.hpp"
#include "geometry/voxel_key.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

namespace octosurf {
namespace {

constexpr std::size_t readings_kept = 2000;  // of a view: as dense as cells, in a view of 60°
constexpr double moved_m = 0.15, turned_rad = 10 * std::numbers::pi / 180;  // from view to view, at least
constexpr std::size_t least_views = 4;
/// A cell's share of the usual range: larger than errors of poses and readings, far smaller than those of
/// wrong poses.
constexpr double cell_share = 0.015;
constexpr double farthest_cell = (1 << 20) - 1;  // of 21 bits a coordinate in a key, its neighbours included
/// In the other form at most half of the readings may be unmatched, compared with the given form, and this
/// share more matched. Wrong poses match a third by chance, right ones all but newly seen places.
constexpr double alone_share = 0.5, more_laid = 0.2;

bool far_better(double other, double given) {
  return other >= given + more_laid && 1 - other <= alone_share * (1 - given);
}

/// Of readings to poses: millimetres, centimetres, inches, feet, tenths, the quarters, fifths, eighths and
/// tenths of millimetres that cameras count in, and a halved or doubled scale.
constexpr std::array scales{0.001, 0.01,   0.0254, 0.1, 0.125, 0.2,  0.25,  0.3048, 0.5,
                            2.0,   3.2808, 4.0,    5.0, 8.0,   10.0, 39.37, 100.0,  1000.0};

std::uint64_t key_of(const Eigen::Vector3i& cell) {
  constexpr std::uint64_t mask = (1U << 21U) - 1;
  return (static_cast<std::uint64_t>(cell.x()) & mask) << 42U |
         (static_cast<std::uint64_t>(cell.y()) & mask) << 21U | (static_cast<std::uint64_t>(cell.z()) & mask);
}

}  // namespace

Eigen::Isometry3d pose_from(PoseForm form, const Eigen::Isometry3d& pose) {
  const bool inverse = form == PoseForm::inverse || form == PoseForm::opengl_inverse;
  Eigen::Isometry3d T = inverse ? pose.inverse() : pose;
  if (form == PoseForm::opengl || form == PoseForm::opengl_inverse)
    T.linear() *= Eigen::Vector3d(1, -1, -1).asDiagonal();
  if (form == PoseForm::w_first) {
    const Eigen::Quaterniond q(pose.linear());
    T.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  }
  if (form == PoseForm::of_camera)
    T.linear() *= (Eigen::Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();
  return T;
}

void PoseCheck::add(const Scan& scan) {
  if (full()) return;
  if (!views_.empty()) {
    const Eigen::Isometry3d motion = views_.back().pose.inverse() * scan.T_map_sensor;
    if (motion.translation().norm() < moved_m && Eigen::AngleAxisd(motion.linear()).angle() < turned_rad)
      return;
  }
  View view{scan.T_map_sensor, {}, scan.sensor == SensorKind::depth_camera};
  const std::size_t step = std::max<std::size_t>(1, scan.points.size() / readings_kept);
  for (std::size_t i = step / 2; i < scan.points.size(); i += step)
    if (scan.points[i].allFinite()) view.points.push_back(scan.points[i]);
  if (!view.points.empty()) views_.push_back(std::move(view));
}

double PoseCheck::share_laid(PoseForm form, double cell, double scale) const {
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen;
  std::size_t laid = 0, all = 0;
  for (const View& view : views_) {
    Eigen::Isometry3d T = pose_from(form, view.pose);
    T.translation() *= scale;
    std::vector<std::uint64_t> own;
    for (const Eigen::Vector3f& point : view.points) {
      const Eigen::Vector3d at = T * point.cast<double>() / cell;
      if (!(at.array().abs() < farthest_cell).all()) continue;
      const Eigen::Vector3i middle = at.array().floor().cast<int>();
      for (int i = 0; i < 27 && !seen.empty(); ++i)
        if (seen.contains(key_of(middle + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)))) {
          ++laid;
          break;
        }
      own.push_back(key_of(middle));
    }
    if (!seen.empty()) all += view.points.size();
    seen.insert(own.begin(), own.end());
  }
  return static_cast<double>(laid) / static_cast<double>(std::max<std::size_t>(1, all));
}

double PoseCheck::usual_cell() const {
  std::vector<float> ranges;
  for (const View& view : views_)
    for (const Eigen::Vector3f& point : view.points) ranges.push_back(point.norm());
  if (ranges.empty()) return 0;
  return cell_share * static_cast<double>(geometry::median_of(ranges));
}

std::optional<PoseForm> PoseCheck::better_form() const {
  const double cell = usual_cell();
  if (views_.size() < least_views || !(cell > 0)) return {};
  const double given = share_laid(PoseForm::as_given, cell);
  std::optional<PoseForm> best;
  double most = 0;
  const bool cameras = std::all_of(views_.begin(), views_.end(), [](const View& v) { return v.camera; });
  for (const PoseForm form : {PoseForm::inverse, PoseForm::w_first, PoseForm::opengl,
                              PoseForm::opengl_inverse, PoseForm::of_camera}) {
    const bool any = form == PoseForm::inverse || form == PoseForm::w_first;
    if (!any && cameras != (form != PoseForm::of_camera)) continue;
    const double share = share_laid(form, cell);
    if (share > most) most = share, best = form;
  }
  return far_better(most, given) ? best : std::nullopt;
}

double PoseCheck::share_seen_through(double scale) const {
  constexpr double bin_rad = 3 * std::numbers::pi / 180;  // twice as wide as readings lie apart
  constexpr double before = 0.8;                          // of the nearest range of a bin
  const auto bin_of = [&](const Eigen::Vector3d& p) {
    const double azimuth = std::atan2(p.y(), p.x()), elevation = std::atan2(p.z(), p.head<2>().norm());
    return key_of(Eigen::Vector3i(static_cast<int>(std::floor(azimuth / bin_rad)),
                                  static_cast<int>(std::floor(elevation / bin_rad)), 0));
  };
  std::size_t through = 0, met = 0;
  for (const View& seeing : views_) {
    tsl::robin_map<std::uint64_t, double, geometry::PackedKeyHash> nearest;
    for (const Eigen::Vector3f& point : seeing.points) {
      const auto p = point.cast<double>().eval();
      double& range = nearest.try_emplace(bin_of(p), p.norm()).first.value();
      range = std::min(range, p.norm());
    }
    for (const View& other : views_) {
      Eigen::Isometry3d T = seeing.pose.inverse() * other.pose;
      T.translation() *= scale;
      for (const Eigen::Vector3f& point : other.points) {
        const Eigen::Vector3d p = T * point.cast<double>();
        const auto found = &other == &seeing ? nearest.end() : nearest.find(bin_of(p));
        if (found == nearest.end()) continue;
        ++met;
        through += p.norm() < before * found->second ? 1 : 0;
      }
    }
  }
  return static_cast<double>(through) / static_cast<double>(std::max<std::size_t>(1, met));
}

std::optional<double> PoseCheck::better_scale() const {
  const double cell = usual_cell();
  if (views_.size() < least_views || !(cell > 0)) return {};
  const double given = share_laid(PoseForm::as_given, cell);
  if (!far_better(1, given)) return {};
  double most = 0, best = 1;
  // The readings stay, with their cells, and the positions are scaled, so that no scale is favoured.
  for (const double scale : scales)
    if (const double share = share_laid(PoseForm::as_given, cell, scale); share > most)
      most = share, best = scale;
  if (!far_better(most, given)) return {};
  // Along a floor or a corridor, positions that are drawn together fit better, right or not. So it takes a
  // scale that fits better than no motion at all, or rays through what others have seen: a hundredth of right
  // poses' readings, and a tenth or more of wrong ones'.
  constexpr double many_through = 0.05;
  const double through = share_seen_through();
  const bool crossed = through > many_through && share_seen_through(best) < through / 2;
  if (!crossed && !far_better(most, share_laid(PoseForm::as_given, cell, 0))) return {};
  return best;
}

}  // namespace octosurf
