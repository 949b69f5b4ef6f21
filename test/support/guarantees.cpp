#include "support/guarantees.hpp"

#include "occupancy/occupancy_map.hpp"
#include "support/slow_polygons.hpp"
#include "surfaces/map_state.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>

namespace octosurf::test {

void expect_guarantees(const Map& map) {
  EXPECT_THAT(check_invariants(map), ::testing::IsEmpty());
  const surfaces::MapState& state = map.state();
  const double h = state.parameters.max_hole_size();
  const auto snapshot = map.snapshot();
  EXPECT_EQ(snapshot->surfaces.size(), map.size().surfaces);
  for (const SurfacePtr& surface : snapshot->surfaces) {
    SCOPED_TRACE("surface " + std::to_string(surface->id));
    EXPECT_EQ(invalid(surface->polygons), "");
    EXPECT_EQ(invalid(simplified(*surface)), "");
    EXPECT_LE(surface->revision, snapshot->revision);
    const double total = area(surface->polygons);
    EXPECT_NEAR(surface->area_m2, total, 1e-9 * (1 + total));
    EXPECT_EQ(surface->boundary.size(), count_vertices(surface->polygons));
    for (const Eigen::Vector3d& p : surface->boundary)
      EXPECT_NEAR(surface->plane.signed_distance(p), 0, 1e-6);
    for (std::size_t a = 0; a < surface->polygons.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(overlap(surface->polygons[a], surface->polygons[b]));

    // The polygons are the alpha shape of the inliers and rim points: so each of the former lies inside or
    // spans no triangle. Of what was loaded since it was derived the noise of then is not known any more.
    const surfaces::SurfaceModel& model = *state.surfaces.find(surface->id);
    surfaces::SurfaceModel::Overreach now;
    for (unsigned c = 0; c < now.size(); ++c) now[c] = std::min(model.resolution(), state.noise.overreach(c));
    EXPECT_LE(std::min(difference(surface->polygons, slow_polygons(model, h)),
                       difference(surface->polygons, slow_polygons(model, h, now))),
              1e-9 * (1 + total));
    double squares = 0;
    model.for_each_inlier([&](const surfaces::Inlier& inlier) {
      squares += std::pow(surface->plane.signed_distance(inlier.position.cast<double>()), 2);
    });
    EXPECT_EQ(surface->covariance, surface->covariance.transpose());
    EXPECT_EQ(surface->covariance.llt().info(), Eigen::Success) << surface->covariance;
    EXPECT_NEAR(surface->rms_m, std::sqrt(squares / static_cast<double>(model.size())), 1e-6);
  }
}

std::string digest(const Map& map) {
  const surfaces::MapState& state = map.state();
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto put_rings = [&](const std::vector<Polygon>& polygons) {
    for (const Polygon& polygon : polygons) {
      std::vector<Ring2> rings = polygon.holes;
      rings.push_back(polygon.outer);
      for (const Ring2& ring : rings)
        for (const Eigen::Vector2d& p : ring) put(p.x()), put(p.y());
    }
  };
  state.occupancy.write_nodes([&](const std::string& chunk) { bytes += chunk; });
  for (const auto& [id, surface] : state.surfaces) {
    const surfaces::SurfaceModel::State s = surface.state();
    put(s.id);
    for (const Plane* plane : {&s.plane, &s.checked_plane}) {
      for (int a = 0; a < 3; ++a) put(plane->normal[a]);
      put(plane->offset);
    }
    for (const Eigen::Isometry3d* pose : {&s.pose, &s.hash_frame})
      for (int i = 0; i < 16; ++i) put(pose->matrix().data()[i]);
    const auto put_moments = [&](const geometry::Moments& m) {
      put(m.count);
      for (int a = 0; a < 3; ++a) put(m.sum[a]);
      for (int i = 0; i < 9; ++i) put(m.outer.data()[i]);
    };
    for (const geometry::Moments& m : s.moments) put_moments(m);
    put_moments(s.evidence.moments);
    put(s.evidence.readings);
    for (const surfaces::Inlier& i : s.inliers) {
      put(i.key.packed());
      put(i.range_class);
      for (int a = 0; a < 3; ++a) put(i.position[a]);
    }
    for (int i = 0; i < 9; ++i) put(s.covariance.data()[i]);
    put_rings(s.polygons);
    for (const SurfaceId parent : s.parents) put(parent);
    put(s.polygons_stale);
    put(s.revision);
  }
  put(state.surfaces.next_id());
  for (const auto& [id, cylinder] : state.cylinders) {
    put(id);
    for (int a = 0; a < 3; ++a) put(cylinder.shape.point[a]), put(cylinder.shape.axis[a]);
    put(cylinder.shape.radius);
    for (const auto& [key, inlier] : cylinder.inliers) put(key.packed());
    put(cylinder.unchecked);
    put(cylinder.revision);
  }
  put(state.cylinders.next_id());
  for (const auto& row : state.noise.histogram())
    for (const std::uint32_t n : row) put(n);
  put(state.noise.range_noise());
  for (const geometry::VoxelKey k : state.accumulated) put(k.packed());
  put(state.points);
  put(state.scans);
  put(state.revision);
  return bytes;
}

}  // namespace octosurf::test
