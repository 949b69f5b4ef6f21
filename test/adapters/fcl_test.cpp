// FCL's collision objects of surfaces and octree, against every surface and voxel asked by itself.
#include "io/exporters/room_snapshot.hpp"
#include "support/random_scans.hpp"
#include "support/seed.hpp"

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include <octosurf/adapters/fcl.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

bool collide(const fcl::CollisionObjectd& a, const fcl::CollisionObjectd& b) {
  const fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  return fcl::collide(&a, &b, request, result) > 0;
}

struct Hits {
  const fcl::CollisionObjectd* body;
  std::set<SurfaceId> ids;
};

bool note(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  auto& hits = *static_cast<Hits*>(data);
  const fcl::CollisionObjectd* surface = a == hits.body ? b : a;
  if (collide(*a, *b)) hits.ids.insert(FclSurfaces::id_of(*surface));
  return false;  // go on
}

std::set<SurfaceId> hit_by(FclSurfaces& surfaces, fcl::CollisionObjectd& body) {
  Hits hits{&body, {}};
  surfaces.manager().collide(&body, &hits, note);
  return hits.ids;
}

fcl::CollisionObjectd box_at(const Eigen::Vector3d& size, const Eigen::Vector3d& at, double yaw = 0) {
  fcl::CollisionObjectd object(std::make_shared<fcl::Boxd>(size.x(), size.y(), size.z()));
  object.setTransform(Eigen::Matrix3d(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), at);
  object.computeAABB();
  return object;
}

Eigen::Vector3d somewhere(std::mt19937_64& random) {
  std::uniform_real_distribution<double> x(-0.5, 6.5), y(-0.5, 4.5), z(-0.5, 3);
  return {x(random), y(random), z(random)};
}

/// What the manager finds for random bodies is what every object by itself says.
void expect_agreement(FclSurfaces& surfaces, const Snapshot& snapshot, std::mt19937_64& random) {
  ASSERT_EQ(surfaces.size(), snapshot.surfaces.size());
  for (int i = 0; i < 40; ++i) {
    fcl::CollisionObjectd body = box_at({0.6, 0.4, 0.5}, somewhere(random), i);
    std::set<SurfaceId> expected;
    for (const SurfacePtr& surface : snapshot.surfaces) {
      const fcl::CollisionObjectd alone(to_fcl_mesh(extrude(*surface, 0.02)));
      if (collide(alone, body)) expected.insert(surface->id);
    }
    EXPECT_EQ(hit_by(surfaces, body), expected);
  }
}

TEST(FclSurfaces, CollideWhereTheirMeshesAre) {
  std::mt19937_64 random = test::rng();
  const Snapshot room = test::make_room();
  FclSurfaces surfaces;
  surfaces.update(room);
  fcl::CollisionObjectd on_the_table = box_at({0.2, 0.2, 0.2}, {2.4, 1.7, 0.8});
  EXPECT_EQ(hit_by(surfaces, on_the_table), std::set<SurfaceId>{room.surfaces[6]->id});
  fcl::CollisionObjectd in_the_hole = box_at({0.4, 0.4, 0.2}, {2.4, 1.8, 0});  // of the floor
  EXPECT_TRUE(hit_by(surfaces, in_the_hole).empty());
  expect_agreement(surfaces, room, random);
}

TEST(FclSurfaces, FollowTheSnapshots) {
  std::mt19937_64 random = test::rng();
  Snapshot room = test::make_room();
  FclSurfaces surfaces;
  surfaces.update(room);
  const fcl::CollisionObjectd* wall = surfaces.object(room.surfaces[2]->id);
  // One is gone, one has moved up, one has come.
  const SurfaceId gone = room.surfaces[0]->id, moved = room.surfaces[6]->id;
  Surface higher = *room.surfaces[6];
  higher.T_map_surface.translation().z() += 0.5;
  higher.revision += 100;
  room.surfaces[6] = std::make_shared<const Surface>(higher);
  room.surfaces.erase(room.surfaces.begin());
  Surface come = higher;
  come.id = 900;
  come.T_map_surface.translation().z() += 0.5;
  room.surfaces.push_back(std::make_shared<const Surface>(come));
  surfaces.update(room);
  EXPECT_EQ(surfaces.object(gone), nullptr);
  EXPECT_EQ(surfaces.object(room.surfaces[1]->id), wall);  // untouched
  fcl::CollisionObjectd low = box_at({0.2, 0.2, 0.2}, {2.4, 1.7, 0.8}),
                        high = box_at({0.2, 0.2, 0.2}, {2.4, 1.7, 1.3});
  EXPECT_TRUE(hit_by(surfaces, low).empty());
  EXPECT_EQ(hit_by(surfaces, high), std::set<SurfaceId>{moved});
  expect_agreement(surfaces, room, random);
  surfaces.update({});
  EXPECT_EQ(surfaces.size(), 0u);
  EXPECT_TRUE(hit_by(surfaces, high).empty());
}

TEST(FclOctree, CollidesWithWhatIsOccupiedNow) {
  std::mt19937_64 random = test::rng();
  Parameters parameters;
  parameters.occupancy.resolution = 0.1;
  Mapper mapper(parameters);
  for (int i = 0; i < 3; ++i) mapper.insert(test::room_scan(random, 6000, {1.5, 1, 1.2}));
  const OccupancyView before = mapper.map().octree();
  const std::shared_ptr<octomap::OcTree> tree = to_octree(before);
  const fcl::CollisionObjectd held(
      std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(tree)));
  mapper.insert(test::room_scan(random, 6000, {0.8, 1, 1}, {0.3, 0, 0}));
  const OccupancyView view = mapper.map().octree();
  update_octree(*tree, before, view);
  const fcl::CollisionObjectd anew(to_fcl_octree(view)), old(to_fcl_octree(before));
  std::uniform_real_distribution<double> place(-1.7, 1.7);
  int hits = 0, changed = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d at(place(random), place(random), place(random)), half(0.15, 0.12, 0.2);
    bool expected = false;
    double nearest_miss = 1;  // how far the box is from touching or from missing a voxel
    const Eigen::AlignedBox3d reach(at - Eigen::Vector3d::Constant(0.5), at + Eigen::Vector3d::Constant(0.5));
    view.for_each_occupied(reach, [&](const OccupancyView::Voxel& voxel) {
      const double overlap = (half.array() + 0.05 - (voxel.center - at).array().abs()).minCoeff();
      nearest_miss = std::min(nearest_miss, std::abs(overlap));
      expected = expected || overlap > 0;
      return true;
    });
    if (nearest_miss < 1e-6) continue;
    const fcl::CollisionObjectd body = box_at(2 * half, at);
    ASSERT_EQ(collide(anew, body), expected);
    ASSERT_EQ(collide(held, body), expected);
    hits += expected;
    changed += collide(old, body) != expected;
  }
  EXPECT_GT(hits, 20);
  EXPECT_LT(hits, 280);
  EXPECT_GT(changed, 0);
}

}  // namespace
}  // namespace octosurf
