// What occupied voxels hold, and what is kept clear of it: footholds, regions, and the boxes of planned
// steps.
#include "footsteps/obstacle_columns.hpp"
#include "planning/contact_cells.hpp"
#include "shapes.hpp"
#include "support/painted_octree.hpp"

#include <octosurf/contact.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;

constexpr double d = 0.02;

Eigen::Isometry3d random_pose(std::mt19937_64& random, double half) {
  return pose(random_vector(random, 1), random_vector(random, 3).x(), random_vector(random, half));
}

/// Occupied where there are points, the voxels being whose the points are.
OccupancyView octree_of(const std::vector<std::pair<Eigen::Vector3d, SurfaceId>>& points) {
  test::PaintedOctree octree(d);
  for (const auto& [p, id] : points) {
    const Eigen::Array3i at = (p / d).array().floor().cast<int>();
    octree.occupy(at.x(), at.y(), at.z(), 1, id);
  }
  return octree.view();
}

/// All that bounds it, one by one: a cube's corners, or what they are moved to on either side of the plane.
std::vector<Eigen::Vector3d> corners_of(const VoxelMatter& matter) {
  std::vector<Eigen::Vector3d> corners;
  for (int corner = 0; corner < 16; ++corner) {
    Eigen::Vector3d off(matter.half_edge, matter.half_edge, matter.half_edge);
    for (int axis = 0; axis < 3; ++axis)
      if ((corner >> axis & 1) != 0) off[axis] = -off[axis];
    off -= off.dot(matter.normal) * matter.normal;
    off += ((corner & 8) != 0 ? -1 : 1) * matter.half_depth * matter.normal;
    corners.push_back(matter.middle + off);
  }
  return corners;
}

std::vector<OccupancyView::Voxel> voxels_of(const OccupancyView& octree) {
  std::vector<OccupancyView::Voxel> voxels;
  octree.for_each_occupied({Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9)},
                           [&](const OccupancyView::Voxel& voxel) {
                             voxels.push_back(voxel);
                             return true;
                           });
  return voxels;
}

TEST(VoxelMatter, ReachesAsFarAsItsCorners) {
  std::mt19937_64 random(test::seed());
  for (int round = 0; round < 200; ++round) {
    VoxelMatter matter{random_vector(random, 1), Eigen::Vector3d::Zero(), d / 2, 0};
    if (round % 2 == 0) matter.normal = random_vector(random, 1).normalized(), matter.half_depth = 0.003;
    const Eigen::Vector3d along = random_vector(random, 1);
    double farthest = 0;
    for (const Eigen::Vector3d& corner : corners_of(matter))
      farthest = std::max(farthest, along.dot(corner - matter.middle));
    EXPECT_NEAR(matter.reach(along), farthest, 1e-12);
  }
}

TEST(VoxelMatter, OfASurfaceIsOnItsPlaneAsFarAsThatIsKnown) {
  Surface wall = surface(7, {{box(-1, -1, 2, 2), {}}}, pose({0, 1, 0}, std::numbers::pi / 2, {0.5, 0, 0}));
  const auto of = [&wall](const Eigen::Vector3d& center, SurfaceId id) {
    const auto snapshot = snapshot_of({wall});
    return MatterOfVoxels(snapshot.get(), d)({OccupancyView::State::occupied, 1, id, center});
  };
  const VoxelMatter sure = of({0.53, 0.01, 0.01}, 7);
  EXPECT_NEAR((sure.middle - Eigen::Vector3d(0.5, 0.01, 0.01)).norm(), 0, 1e-12);
  EXPECT_NEAR(sure.half_depth, 0.003, 1e-12);  // three deviations of what readings have in common
  EXPECT_EQ(of({0.53, 0.01, 0.01}, 0).middle, Eigen::Vector3d(0.53, 0.01, 0.01));  // pending
  EXPECT_FALSE(of({0.53, 0.01, 0.01}, 0).flat());
  EXPECT_FALSE(of({0.53, 0.01, 0.01}, 8).flat());  // of one that the snapshot does not have
  EXPECT_FALSE(of({0.59, 0.01, 0.01}, 7).flat());  // farther off than any reading can belong
  wall.covariance(2, 2) = 0.002 * 0.002;
  EXPECT_NEAR(of({0.53, 0.01, 0.01}, 7).half_depth, 3 * std::hypot(0.001, 0.002), 1e-12);
  wall.covariance(0, 0) = 0.01 * 0.01;  // a tilt: a metre from its origin it is known to a centimetre only
  EXPECT_TRUE(of({0.53, 0.01, 0.01}, 7).flat());
  EXPECT_FALSE(of({0.53, 0.01, 0.99}, 7).flat());
}

// All that voxels cover of a plane, and nothing a cell's diagonal beside it.
TEST(ContactCells, CoverEachVoxel) {
  std::mt19937_64 random(test::seed());
  for (int round = 0; round < 4; ++round) {
    const Surface on = surface(1, {}, random_pose(random, 0.1));
    const auto surfaces = snapshot_of({on, surface(2, {}, random_pose(random, 0.1))});
    std::vector<std::pair<Eigen::Vector3d, SurfaceId>> points;
    for (int i = 0; i < 40; ++i)
      points.emplace_back(random_vector(random, 0.3), static_cast<SurfaceId>(random() % 3));
    const OccupancyView octree = octree_of(points);
    ContactLimits limits;
    limits.obstacle_from_m = 0.01;
    limits.clearance_m = 0.3;
    constexpr double edge = d / 4, half = 0.6;
    const Eigen::AlignedBox2d box(Eigen::Vector2d(-half, -half), Eigen::Vector2d(half, half));
    const ContactCells over(on, box, box, edge, limits, &octree, surfaces.get());
    MatterOfVoxels matter_of(surfaces.get(), d);
    std::vector<VoxelMatter> there;
    for (const OccupancyView::Voxel& voxel : voxels_of(octree)) {
      const VoxelMatter matter = matter_of(voxel);
      const double height = on.plane.signed_distance(matter.middle), reach = matter.reach(on.plane.normal);
      if (voxel.surface == 1 || height + reach <= 0.01 || height - reach >= 0.3) continue;
      there.push_back(matter);
      for (const Eigen::Vector3d& corner : corners_of(matter))
        EXPECT_TRUE(over.obstacles.touched_by({to_uv(on, corner)}));
    }
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector2d p = half * random_vector(random, 0.9).head<2>();
      const bool apart = std::ranges::all_of(there, [&](const VoxelMatter& matter) {
        return (to_uv(on, matter.middle) - p).norm() > 2 * MatterOfVoxels::farthest_reach * d + 1.5 * edge;
      });
      if (apart) {
        EXPECT_FALSE(over.obstacles.touched_by({p}));
      }
    }
  }
}

/// A floor, and a wall of points that scatter by up to 5 cm about its plane, at x = 0.
struct Corner {
  Surface floor = surface(1, {{box(-0.02, 0, 1, 1), {}}});
  std::shared_ptr<Snapshot> surfaces = snapshot_of(
      {floor, surface(2, {{box(-1, -1, 2, 2), {}}}, pose({0, 1, 0}, std::numbers::pi / 2, {0, 0, 0}))});
  std::vector<std::pair<Eigen::Vector3d, SurfaceId>> points;
  ContactShape sole = ContactShape::rectangle(0.2, 0.1);
  ContactLimits limits;

  Corner() {
    limits.clearance_m = 0.2;
    std::mt19937_64 random(test::seed());
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d p = random_vector(random, 0.5) + Eigen::Vector3d(0, 0.5, 0.5);
      points.emplace_back(Eigen::Vector3d(p.x() / 10, p.y(), p.z()), 2);
    }
  }
  std::optional<ContactRefusal> refused(double heel, const Snapshot* others) const {
    const OccupancyView octree = octree_of(points);
    return foothold(floor, sole, {heel + 0.1, 0.5, 0}, 0, limits, &octree, others).refused;
  }
};

TEST(Foothold, BesideAWallWhoseReadingsScatterIsAccepted) {
  const Corner corner;
  EXPECT_EQ(corner.refused(0.01, nullptr), ContactRefusal::clearance);  // as if the wall were 5 cm thick
  EXPECT_EQ(corner.refused(0.01, corner.surfaces.get()), std::nullopt);
  EXPECT_EQ(corner.refused(0.002, corner.surfaces.get()), ContactRefusal::clearance);
  EXPECT_EQ(corner.refused(-0.01, corner.surfaces.get()), ContactRefusal::clearance);  // in the wall
}

TEST(Foothold, BesideAVoxelOfNoSurfaceIsRefusedAllTheSame) {
  Corner corner;
  corner.points = {{{0.025, 0.505, 0.105}, 0}};
  EXPECT_EQ(corner.refused(0.03, corner.surfaces.get()), ContactRefusal::clearance);
  EXPECT_EQ(corner.refused(0.0401 + d / 4, corner.surfaces.get()), std::nullopt);  // to a cell
}

TEST(Foothold, AgreesWithTheRegionBesideWhatIsFlat) {
  const Corner corner;
  const OccupancyView octree = octree_of(corner.points);
  const ContactRegion region =
      contact_region(corner.floor, corner.sole, 0.3, corner.limits, &octree, corner.surfaces.get());
  ASSERT_EQ(region.polygons.size(), 1u);
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d at = random_vector(random, 0.1) + Eigen::Vector3d(0.1, 0.5, 0);
    // Beside the region's edge lie cells that only part of is free.
    const bool in = inside(region.polygons.front(), at.head<2>());
    if (!in && edge_distance(region.polygons.front(), at.head<2>()) < d) continue;
    EXPECT_EQ(
        foothold(corner.floor, corner.sole, at, 0.3, corner.limits, &octree, corner.surfaces.get()).accepted,
        in);
  }
}

// The walking frame and the planes turned at random. Slow: of every voxel's corners, their bounds along the
// box's sides.
TEST(ObstacleColumns, BlockABoxAsTheVoxelsOneByOne) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-1, 1);
  int blocked = 0;
  constexpr int boxes = 400;
  for (int round = 0; round < 4; ++round) {
    const auto surfaces =
        snapshot_of({surface(1, {}, random_pose(random, 0.1)), surface(2, {}, random_pose(random, 0.1))});
    std::vector<std::pair<Eigen::Vector3d, SurfaceId>> points;
    for (int i = 0; i < 300; ++i)
      points.emplace_back(random_vector(random, 0.3), static_cast<SurfaceId>(random() % 4));
    const OccupancyView octree = octree_of(points);
    const std::vector<OccupancyView::Voxel> voxels = voxels_of(octree);
    const Eigen::Matrix3d R_walk_map =
        (round == 0 ? Eigen::Isometry3d::Identity() : random_pose(random, 1)).linear();
    footsteps::ObstacleColumns columns(octree, surfaces, R_walk_map, -1, 1);
    MatterOfVoxels matter_of(surfaces.get(), d);
    for (int i = 0; i < boxes / 4; ++i) {
      footsteps::UprightBox box;
      box.center = 0.3 * Eigen::Vector2d(uniform(random), uniform(random));
      box.yaw_rad = 4 * uniform(random);
      box.half_length = 0.02 + 0.02 * uniform(random);
      box.half_width = 0.02 + 0.02 * uniform(random);
      box.from_z = 0.3 * uniform(random);
      box.to_z = box.from_z + 0.05;
      if (i % 2 == 0) box.rise = 0.4 * Eigen::Vector2d(uniform(random), uniform(random));
      const SurfaceId but = i % 3 == 0 ? 1 : 0;
      const Eigen::Rotation2Dd turn(-box.yaw_rad);
      const auto meets = [&](const OccupancyView::Voxel& voxel) {
        Eigen::AlignedBox3d bounds;
        for (const Eigen::Vector3d& corner : corners_of(matter_of(voxel))) {
          const Eigen::Vector3d p = R_walk_map * corner;
          const Eigen::Vector2d off = p.head<2>() - box.center, turned = turn * off;
          bounds.extend(Eigen::Vector3d(turned.x(), turned.y(), p.z() - box.rise.dot(off)));
        }
        return bounds.intersects(
            Eigen::AlignedBox3d(Eigen::Vector3d(-box.half_length, -box.half_width, box.from_z),
                                Eigen::Vector3d(box.half_length, box.half_width, box.to_z)));
      };
      const bool expected = std::any_of(voxels.begin(), voxels.end(), [&](const OccupancyView::Voxel& voxel) {
        return (but == 0 || voxel.surface != but) && meets(voxel);
      });
      EXPECT_EQ(columns.blocked(box, but), expected);
      blocked += expected;
    }
  }
  EXPECT_GT(blocked, boxes / 20);
  EXPECT_LT(blocked, boxes - boxes / 20);
}

}  // namespace
}  // namespace octosurf::planning
