#include "geometry/directions.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <octosurf/up.hpp>

namespace octosurf {
namespace {

const double level_cosine = std::cos(5 * std::numbers::pi / 180);
constexpr double seen_from_below = 0.5;  // share of a ceiling's area that counts
constexpr double mounted_upright = 0.9;  // share of sensors whose up direction is right

struct Level {
  double score_m2 = 0;
  Eigen::Vector3d normals = Eigen::Vector3d::Zero();  // oriented up, weighted by area
};

Level level_to(const Snapshot& snapshot, const Eigen::Vector3d& up) {
  Level level;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    const double cosine = surface->plane.normal.dot(up);
    if (std::fabs(cosine) < level_cosine) continue;
    level.score_m2 += (cosine > 0 ? 1 : seen_from_below) * surface->area_m2;
    level.normals += (cosine > 0 ? 1 : -1) * surface->area_m2 * surface->plane.normal;
  }
  return level;
}

/// Agreement of a direction with the sensors: 1 along their mean, 1 − t at right angles to it and beyond.
double suits(const Eigen::Vector3d& up, const Eigen::Vector3d& sensors_up) {
  const double length = sensors_up.norm(), t = mounted_upright * length;
  if (length < 1e-9) return 1;
  const double cosine = std::max(0.0, up.dot(sensors_up) / length);
  return 1 - t + t * cosine * cosine;
}

}  // namespace

const char* name_of(Up::Source source) {
  return source == Up::Source::given ? "given" : source == Up::Source::surfaces ? "surfaces" : "assumed";
}

Up estimate_up(const Snapshot& snapshot, const Eigen::Vector3d& sensors_up) {
  double most = 0;
  Eigen::Vector3d best;
  for (const SurfacePtr& surface : snapshot.surfaces)
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector3d up = side * surface->plane.normal;
      const double score = level_to(snapshot, up).score_m2 * suits(up, sensors_up);
      if (score <= most) continue;
      most = score;
      best = up;
    }
  if (most <= 0) return {.source = Up::Source::assumed};
  const Eigen::Vector3d mean = level_to(snapshot, best).normals.normalized();
  return {level_to(snapshot, mean).normals.normalized(), Up::Source::surfaces};  // refined about their mean
}

Up up_of(const Map& map) {
  const auto& given = map.parameters().up;
  return given ? Up{*given, Up::Source::given} : up_from_surfaces(map);
}

Up up_from_surfaces(const Map& map) {
  const surfaces::MapState& state = surfaces::state_of(map);
  return estimate_up(*map.snapshot(), state.sensors_up / std::max(1.0, static_cast<double>(state.scans)));
}

double slope_rad(const Surface& surface, const Eigen::Vector3d& up) {
  const Eigen::Vector3d& n = surface.plane.normal;
  return std::atan2(n.cross(up).norm(), n.dot(up));  // exact near 0, where acos is not
}

Eigen::Quaterniond upright(const Eigen::Vector3d& up) {
  const Eigen::Vector3d unit = up.normalized();
  const double across = std::hypot(unit.x(), unit.y());
  if (across < 1e-12) return unit.z() > 0 ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(0, 1, 0, 0);
  const Eigen::Vector3d axis(unit.y() / across, -unit.x() / across, 0);  // up × z
  return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(across, unit.z()), axis));
}

}  // namespace octosurf
