#include "surfaces/criteria/joining.hpp"

#include "surfaces/criteria/parts.hpp"

#include <cmath>

namespace octosurf::surfaces {

bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const sensing::NoiseModel& noise) {
  constexpr double cos_10_deg = 0.984807753012208;  // however uncertain the planes are
  if (a.plane().normal.dot(b.plane().normal) < cos_10_deg) return false;
  const auto patch = [&](const SurfaceModel& s) {
    return Patch{s.moments(&noise), s.reference(), s.readings()};
  };
  return one_plane(patch(a), patch(b), a.plane(), contact, noise.base_tolerance(), a.resolution());
}

bool joint_plane_fits(const SurfaceModel& a, const SurfaceModel& b, const sensing::NoiseModel& noise) {
  constexpr double cos_10_deg = 0.984807753012208;
  if (a.plane().normal.dot(b.plane().normal) < cos_10_deg) return false;
  geometry::Moments joint = b.moments(&noise).shifted(a.reference() - b.reference());
  joint.add(a.moments(&noise));
  const Plane plane = geometry::fitted_plane(joint, a.reference(), a.plane().normal);
  const auto fits = [&](const SurfaceModel& s) {
    const geometry::Moments m = s.moments(&noise);
    const auto rms = [&](const Plane& p) {
      return std::sqrt(m.mean_squared_distance(p.normal, p.offset - p.normal.dot(s.reference())));
    };
    return rms(plane) <= rms(s.plane()) + noise.base_tolerance() / 3;
  };
  return fits(a) && fits(b);
}

}  // namespace octosurf::surfaces
