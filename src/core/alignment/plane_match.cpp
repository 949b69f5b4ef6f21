#include "alignment/plane_match.hpp"

#include "alignment/linear.hpp"
#include "alignment/pose_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace octosurf::alignment {
namespace {

constexpr double normal_spread = std::numbers::pi / 180;  // rad: error of a scan's plane of a few patches
constexpr double offset_spread = 0.01;                    // m
constexpr std::size_t most_planes = 12, most_surfaces = 5;
/// Triples whose normals span less volume determine a direction worse than a quarter as well as their planes.
constexpr double least_volume = 0.25;

struct Match {
  const ScanPlane* plane;
  const AlignedSurface* surface;
};

class Matcher {
 public:
  Matcher(const Eigen::Isometry3d& start, const AlignmentReach& reach) : start_(start), reach_(reach) {
    prior_.head<3>().setConstant(1 / (reach.rotation_rad * reach.rotation_rad));
    prior_.tail<3>().setConstant(1 / (reach.translation_m * reach.translation_m));
  }

  /// The surfaces that a plane may correspond to, nearest first.
  std::vector<Match> candidates(const ScanPlane& plane,
                                std::span<const AlignedSurface* const> surfaces) const {
    const Eigen::Vector3d normal = start_.linear() * plane.normal, centroid = start_ * plane.centroid;
    const double least_cosine = std::cos(reach_.rotation_rad + 3 * normal_spread);
    const double most_off = reach_.translation_m + reach_.rotation_rad * plane.centroid.norm();
    std::vector<std::pair<double, Match>> found;
    for (const AlignedSurface* surface : surfaces) {
      const double off = std::fabs(surface->plane.signed_distance(centroid));
      if (normal.dot(surface->plane.normal) < least_cosine || off > most_off) continue;
      if (!surface->raster.near((surface->T_surface_map * centroid).head<2>(), most_off)) continue;
      found.push_back({off, {&plane, surface}});
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Match> matches;
    for (std::size_t i = 0; i < std::min(most_surfaces, found.size()); ++i)
      matches.push_back(found[i].second);
    return matches;
  }

  /// Least-squares pose; false if it is out of reach.
  bool solve(std::span<const Match> matches, Eigen::Isometry3d& pose) const {
    TwistCovariance normal_matrix = prior_.asDiagonal();
    Twist right = Twist::Zero();
    for (const Match& match : matches) {
      const Eigen::Vector3d from = start_.linear() * match.plane->normal, &to = match.surface->plane.normal;
      const Eigen::Vector3d arm = start_.linear() * match.plane->centroid;
      Eigen::Matrix<double, 4, 6> rows = Eigen::Matrix<double, 4, 6>::Zero();
      Eigen::Vector4d values;
      // ω × from = to − from
      rows.topLeftCorner<3, 3>() << 0, from.z(), -from.y(), -from.z(), 0, from.x(), from.y(), -from.x(), 0;
      values.head<3>() = to - from;
      rows.topRows<3>() /= normal_spread;
      values.head<3>() /= normal_spread;
      rows.row(3) << arm.cross(to).transpose() / offset_spread, to.transpose() / offset_spread;
      values[3] = -match.surface->plane.signed_distance(start_.translation() + arm) / offset_spread;
      normal_matrix += rows.transpose() * rows;
      right += rows.transpose() * values;
    }
    const Twist twist = alignment::solve(normal_matrix, right);
    constexpr double slack = 1.5;  // tolerance for planes of a few patches
    pose = moved(start_, twist);
    return twist.head<3>().norm() < slack * reach_.rotation_rad &&
           twist.tail<3>().norm() < slack * reach_.translation_m;
  }

 private:
  Eigen::Isometry3d start_;
  AlignmentReach reach_;
  Twist prior_;
};

using Triple = std::array<std::size_t, 3>;

/// Triples of planes with normals far from coplanar, sorted by the readings of the smallest, largest first.
/// Without any, as in a corridor or on a floor: pairs, then single planes, with a plane repeated.
std::vector<Triple> triples_of(std::span<const ScanPlane> planes) {
  std::vector<Triple> triples;
  for (const std::size_t different : {3U, 2U, 1U}) {
    for (std::size_t i = 0; i < planes.size(); ++i)
      for (std::size_t j = different > 1 ? i + 1 : i; j < (different > 1 ? planes.size() : i + 1); ++j)
        for (std::size_t k = different > 2 ? j + 1 : j; k < (different > 2 ? planes.size() : j + 1); ++k) {
          const Eigen::Vector3d across = planes[i].normal.cross(planes[j].normal);
          if (different == 3 && std::fabs(across.dot(planes[k].normal)) < least_volume) continue;
          if (different == 2 && across.norm() < least_volume) continue;
          triples.push_back({i, j, k});
        }
    if (!triples.empty()) break;
  }
  std::stable_sort(triples.begin(), triples.end(), [&](const Triple& a, const Triple& b) {
    return planes[a[2]].readings > planes[b[2]].readings;
  });
  return triples;
}

}  // namespace

std::vector<Eigen::Isometry3d> poses_by_planes(std::span<const ScanPlane> planes,
                                               std::span<const AlignedSurface* const> surfaces,
                                               const Eigen::Isometry3d& start, const AlignmentReach& reach,
                                               std::size_t most) {
  const Matcher matcher(start, reach);
  std::vector<ScanPlane> known;
  std::vector<std::vector<Match>> candidates;
  for (const ScanPlane& plane : planes) {
    std::vector<Match> of_plane = matcher.candidates(plane, surfaces);
    if (of_plane.empty()) continue;
    known.push_back(plane);
    candidates.push_back(std::move(of_plane));
    if (known.size() == most_planes) break;
  }
  std::vector<Eigen::Isometry3d> poses;
  for (const auto& [i, j, k] : triples_of(known)) {
    for (const Match& a : candidates[i])
      for (const Match& b : candidates[j]) {
        if (j == i && b.surface != a.surface) continue;
        for (const Match& c : candidates[k]) {
          if (k == j && c.surface != b.surface) continue;
          Eigen::Isometry3d pose;
          if (matcher.solve(std::array{a, b, c}, pose)) poses.push_back(pose);
          if (poses.size() == most) return poses;
        }
      }
  }
  return poses;
}

}  // namespace octosurf::alignment
