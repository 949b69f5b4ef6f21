#include "evaluation/stairs.hpp"

#include "evaluation/planar_region.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <octosurf/up.hpp>

namespace octosurf::evaluation {
namespace {

using Edge = std::array<Eigen::Vector3d, 2>;

Eigen::Vector3d middle_of(const Edge& edge) { return (edge[0] + edge[1]) / 2; }

/// Of somebody who steps up over the edge, level and of length 1.
Eigen::Vector3d heading_of(const Edge& edge, const Eigen::Vector3d& up) {
  return (edge[0] - edge[1]).cross(up).normalized();
}

double turn_between(const Edge& from, const Edge& to, const Eigen::Vector3d& up) {
  const Eigen::Vector3d a = heading_of(from, up), b = heading_of(to, up);
  return std::atan2(a.cross(b).dot(up), a.dot(b));
}

bool lies_on(const Step& step, const Edge& edge, const Eigen::Vector3d& up) {
  const Eigen::Vector3d along = edge[1] - edge[0], off = middle_of(step.edge) - edge[0];
  const double place = std::clamp(off.dot(along) / along.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector3d rest = off - place * along;
  const double height = rest.dot(up);
  return std::fabs(height) <= 0.05 && (rest - height * up).norm() <= 0.10;
}

/// Share that was seen of the face that begins at this edge.
double seen_behind(const Edge& edge, const Truth& truth, const Eigen::Vector3d& up) {
  const Eigen::Vector3d place = middle_of(edge) + 0.05 * heading_of(edge, up);
  for (const TrueFace& face : truth.faces) {
    if (face.gone || face.plane.normal.dot(up) < 0.9) continue;
    const Eigen::Vector3d at = face.T_map_face.inverse() * place;
    if (std::fabs(at.z()) > 0.01 || !PlanarRegion(face.polygons).contains(at.head<2>())) continue;
    double area = 0;
    for (const Polygon& polygon : face.polygons) area += enclosed_area(polygon);
    return face.visible_area_m2 / area;
  }
  return 0;
}

StairKind kind_of(const TrueStair& stair, const Eigen::Vector3d& up) {
  if (stair.kind == "spiral") return StairKind::spiral;
  const double turn = turn_between(stair.edges.front(), stair.edges.back(), up);
  return std::fabs(turn) < 0.1 ? StairKind::straight : StairKind::turning;
}

void score_measures(const Stair& found, const TrueStair& built, const Eigen::Vector3d& up,
                    StairScore& score) {
  score.found = found.steps.size();
  score.riser_m = found.riser.mean_m - built.riser_m;
  score.tread_m = found.tread.mean_m - built.tread_m;
  score.width_m = found.width_m - (built.edges.front()[1] - built.edges.front()[0]).norm();
  const Eigen::Vector3d heading = upright(up) * heading_of(built.edges.front(), up);
  score.heading_rad =
      std::remainder(found.heading_rad - std::atan2(heading.y(), heading.x()), 2 * std::numbers::pi);
  score.right_kind = found.kind == kind_of(built, up);
}

}  // namespace

StairScores evaluate_stairs(const std::vector<Stair>& found, const Truth& truth, const Eigen::Vector3d& up) {
  StairScores scores;
  std::vector<bool> on_some(found.size(), false);
  for (const TrueStair& built : truth.stairs) {
    StairScore& score = scores.stairs.emplace_back();
    score.kind = built.kind;
    score.steps = built.edges.size();
    score.seen = 1;
    for (const Edge& edge : built.edges) score.seen = std::min(score.seen, seen_behind(edge, truth, up));
    const Stair* best = nullptr;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto& steps = found[i].steps;
      const auto on = std::count_if(steps.begin(), steps.end(), [&](const Step& step) {
        return std::any_of(built.edges.begin(), built.edges.end(),
                           [&](const Edge& edge) { return lies_on(step, edge, up); });
      });
      if (2 * on <= std::ssize(steps)) continue;
      on_some[i] = true;
      ++score.pieces;
      if (best == nullptr || steps.size() > best->steps.size()) best = &found[i];
    }
    if (best != nullptr) score_measures(*best, built, up, score);
  }
  scores.invented = static_cast<std::size_t>(std::count(on_some.begin(), on_some.end(), false));
  return scores;
}

}  // namespace octosurf::evaluation
