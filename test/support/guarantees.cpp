#include "support/guarantees.hpp"

#include "occupancy/occupancy_map.hpp"
#include "support/slow_polygons.hpp"
#include "surfaces/map_state.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <span>
#include <sstream>

namespace octosurf::test {

namespace {

/// What polygons have beside the alpha shape of inliers and boundary points are triangles to points on the
/// planes of other surfaces, which may have moved since by less than a voxel. These may lie across long
/// triangles of the shape, and have sides longer than h themselves: so it may lack a little there.
void expect_intersections_beyond(const Map& map, const Surface& surface, const std::vector<Polygon>& bare) {
  const double lacking = area(bare) - intersection(bare, surface.polygons).area;
  EXPECT_LE(lacking, 0.01 * surface.area_m2) << "surface " << surface.id;
  const std::shared_ptr<const Snapshot> all = map.snapshot();
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& vertex : polygon.outer) {
      if (distance_to_rings(vertex, bare) < 1e-6) continue;
      const bool on_another =
          std::any_of(all->surfaces.begin(), all->surfaces.end(), [&](const SurfacePtr& other) {
            return other->id != surface.id &&
                   std::fabs(other->plane.signed_distance(surface.to_map(vertex))) < all->resolution;
          });
      EXPECT_TRUE(on_another) << "surface " << surface.id << " reaches to " << vertex.transpose();
    }
}

}  // namespace

void expect_guarantees(const Map& map) {
  EXPECT_THAT(check_invariants(map), ::testing::IsEmpty());
  const surfaces::MapState& state = surfaces::state_of(map);
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

    // The polygons are the alpha shape of the inliers, boundary points and intersections: so each of the
    // former lies inside or spans no triangle. Of what was loaded since it was derived the noise of then and
    // where it met others then are not known any more.
    const surfaces::SurfaceModel& model = *state.surfaces.find(surface->id);
    surfaces::SurfaceModel::EdgeBleed now;
    for (unsigned c = 0; c < now.size(); ++c)
      now[c] = std::min(model.resolution(), state.noise.edge_bleed(c));
    const std::vector<Polygon> then = slow_polygons(model, h), with_noise = slow_polygons(model, h, now);
    const double off =
        std::min(difference(surface->polygons, then), difference(surface->polygons, with_noise));
    if (off > 1e-9 * (1 + total)) {
      EXPECT_EQ(model.outline_sites(), 0U) << "surface " << surface->id << " is off by " << off << " m²";
      expect_intersections_beyond(map, *surface, with_noise);
    }
    double squares = 0;
    model.for_each_inlier([&](const surfaces::Inlier& inlier) {
      squares += std::pow(surface->plane.signed_distance(inlier.position.cast<double>()), 2);
    });
    EXPECT_EQ(surface->covariance, surface->covariance.transpose());
    EXPECT_EQ(surface->covariance.llt().info(), Eigen::Success) << surface->covariance;
    EXPECT_NEAR(surface->rms_m, std::sqrt(squares / static_cast<double>(model.size())), 1e-6);
  }
}

Leaves leaves_of(const Map& map) {
  Leaves all;
  map.octree().for_each_leaf([&](std::span<const OccupancyView::Leaf> leaves) {
    for (const OccupancyView::Leaf& leaf : leaves) all.emplace_back(leaf.corner, leaf.level, leaf.log_odds);
  });
  return all;
}

}  // namespace octosurf::test
