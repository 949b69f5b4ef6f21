#include "bench/foothold_truth.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::bench {

Ground::Ground(const evaluation::Truth& truth, double tolerance) : tolerance_(tolerance), cell_(truth.cell) {
  for (const evaluation::TrueFace& face : truth.faces) {
    if (face.gone) continue;
    Face one{&face, evaluation::PlanarRegion(face.polygons), face.T_map_face.inverse(), {}, {}};
    for (const evaluation::CellRun& run : face.visible)
      for (int c = 0; c < run.count; ++c) {
        one.cells.push_back({run.column + c, run.row});
        one.seen.insert(key(run.column + c, run.row));
      }
    faces_.push_back(std::move(one));
  }
}

double Ground::off(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
  double least = false_from;
  for (const Face& face : faces_) {
    if (face.truth->plane.normal.dot(normal) < std::cos(max_slope)) continue;
    const Eigen::Vector3d local = face.T_face_map * p;
    if (std::abs(local.z()) > tolerance_ || face.region.empty()) continue;
    if (face.region.contains(local.head<2>())) return 0;
    least = std::min(least, face.region.ring_distance(local.head<2>(), least));
  }
  return least;
}

Ground::Place Ground::place(std::mt19937_64& rng, const std::vector<Eigen::Vector2d>& points) const {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> weights;
  for (const Face& face : faces_)
    weights.push_back(
        face.truth->plane.normal.z() < std::cos(max_slope) ? 0.0 : static_cast<double>(face.cells.size()));
  std::discrete_distribution<std::size_t> by_area(weights.begin(), weights.end());
  const Face& face = faces_[by_area(rng)];
  const auto& [column, row] = face.cells[rng() % face.cells.size()];
  const Eigen::Vector2d uv((column + uniform(rng)) * cell_, (row + uniform(rng)) * cell_);
  const Eigen::Rotation2Dd turn(2 * std::numbers::pi * uniform(rng));
  Place place{face.truth, face.truth->T_map_face, true, true};
  place.T_map_contact.translate(Eigen::Vector3d(uv.x(), uv.y(), 0));
  place.T_map_contact.rotate(Eigen::AngleAxisd(turn.angle(), Eigen::Vector3d::UnitZ()));
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d p = uv + turn * point;
    place.supported = place.supported && face.region.contains(p);
    place.seen = place.seen && face.seen.contains(key(static_cast<int>(std::floor(p.x() / cell_)),
                                                      static_cast<int>(std::floor(p.y() / cell_))));
  }
  return place;
}

bool Ground::has_ground() const {
  return std::any_of(faces_.begin(), faces_.end(), [](const Face& face) {
    return !face.cells.empty() && face.truth->plane.normal.z() >= std::cos(max_slope);
  });
}

}  // namespace octosurf::bench
