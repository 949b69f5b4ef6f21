#include "pose_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_set>

namespace octosurf {
namespace {

constexpr std::size_t readings_kept = 500;  // of a view: shares of them are known to 2 %
constexpr double moved_m = 0.15, turned_rad = 10 * std::numbers::pi / 180;  // from view to view, at least
constexpr std::size_t least_views = 4;
/// A cell's share of the usual range: larger than errors of poses and readings, far smaller than those of
/// wrong poses.
constexpr double cell_share = 0.03;
constexpr double farthest_cell = (1 << 20) - 1;  // of 21 bits a coordinate in a key, its neighbours included
/// In the other form at most half of the readings may be unmatched, compared with the given form, and this
/// share more matched. Wrong poses match a third by chance, right ones all but newly seen places.
constexpr double alone_share = 0.5, more_laid = 0.2;

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

double PoseCheck::share_laid(PoseForm form, double cell) const {
  std::unordered_set<std::uint64_t> seen;
  std::size_t laid = 0, all = 0;
  for (const View& view : views_) {
    const Eigen::Isometry3d T = pose_from(form, view.pose);
    std::vector<std::uint64_t> own;
    for (const Eigen::Vector3f& point : view.points) {
      const Eigen::Vector3d at = T * point.cast<double>() / cell;
      if (!(at.array().abs() < farthest_cell).all()) continue;
      const Eigen::Vector3i middle = at.array().floor().cast<int>();
      laid += seen.contains(key_of(middle)) ? 1 : 0;
      for (int i = 0; i < 27; ++i)
        own.push_back(key_of(middle + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
    }
    if (!seen.empty()) all += view.points.size();
    seen.insert(own.begin(), own.end());
  }
  return static_cast<double>(laid) / static_cast<double>(std::max<std::size_t>(1, all));
}

std::optional<PoseForm> PoseCheck::better_form() const {
  if (views_.size() < least_views) return {};
  std::vector<float> ranges;
  for (const View& view : views_)
    for (const Eigen::Vector3f& point : view.points) ranges.push_back(point.norm());
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  const double cell = cell_share * static_cast<double>(*middle);
  if (!(cell > 0)) return {};
  const double given = share_laid(PoseForm::as_given, cell);
  std::optional<PoseForm> best;
  double most = 0;
  const bool cameras = std::all_of(views_.begin(), views_.end(), [](const View& v) { return v.camera; });
  for (const PoseForm form : {PoseForm::inverse, PoseForm::opengl, PoseForm::opengl_inverse}) {
    if (form != PoseForm::inverse && !cameras) continue;
    const double share = share_laid(form, cell);
    if (share > most) most = share, best = form;
  }
  if (most < given + more_laid || 1 - most > alone_share * (1 - given)) return {};
  return best;
}

}  // namespace octosurf
