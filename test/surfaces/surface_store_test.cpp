// Look-ups by place and by plane against a walk over all surfaces.
#include "surfaces/surface_store.hpp"

#include "support/double_layers.hpp"
#include "support/pending_points.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/cells.hpp"
#include "surfaces/cylinder_store.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;

struct Filled {
  SurfaceStore store{d};
  std::map<SurfaceId, std::vector<Inlier>> inliers;
};

void add_surface(Filled& filled, std::mt19937_64& rng, double reach) {
  const Eigen::Isometry3d pose = test::random_pose(rng, reach);
  SurfaceModel& surface = filled.store.create(test::plane_of(pose), pose.translation());
  for (const Inlier& i : test::voxels_of(test::random_blob(rng, 0.3, 0.05), pose, d, 0.3, 0.004, rng)) {
    filled.store.add(surface, i);
    filled.inliers[surface.id()].push_back(i);
  }
}

/// `edge`: of the blocks or regions, voxels.
std::vector<SurfaceId> slowly_near(const Filled& filled, geometry::VoxelKey key, int reach, int edge) {
  std::vector<SurfaceId> ids;
  const auto met = [&](std::uint16_t k, std::uint16_t centre) {
    return k / edge >= (centre - reach) / edge && k / edge <= (centre + reach) / edge;
  };
  for (const auto& [id, inliers] : filled.inliers)
    if (std::any_of(inliers.begin(), inliers.end(), [&](const Inlier& i) {
          return met(i.key.x, key.x) && met(i.key.y, key.y) && met(i.key.z, key.z);
        }))
      ids.push_back(id);
  return ids;
}

void expect_found(const Filled& filled, std::mt19937_64& rng) {
  for (const auto& [id, inliers] : filled.inliers)
    for (std::size_t i = 0; i < inliers.size(); i += 1 + inliers.size() / 10) {
      geometry::VoxelKey key = inliers[i].key;
      key.x = static_cast<std::uint16_t>(key.x + rng() % 31 - 15);
      key.z = static_cast<std::uint16_t>(key.z + rng() % 31 - 15);
      for (const int reach : {0, 2, 9}) {
        const SurfaceStore::Ids found = filled.store.near(key, reach);
        EXPECT_EQ(std::vector<SurfaceId>(found.begin(), found.end()), slowly_near(filled, key, reach, 8));
        const SurfaceStore::Ids in_regions = filled.store.in_regions_near(key, reach);
        EXPECT_EQ(std::vector<SurfaceId>(in_regions.begin(), in_regions.end()),
                  slowly_near(filled, key, reach, 64));
      }
    }
}

TEST(SurfaceStore, FindsByPlaceUnderChurn) {
  std::mt19937_64 rng = test::rng();
  Filled filled;
  for (int i = 0; i < 12; ++i) add_surface(filled, rng, 0.5);
  expect_found(filled, rng);
  for (int round = 0; round < 4; ++round) {
    for (auto& [id, inliers] : filled.inliers) {
      SurfaceModel& surface = *filled.store.find(id);
      std::shuffle(inliers.begin(), inliers.end(), rng);
      const std::size_t left = id % 4 == 0 ? 0 : inliers.size() / 2;
      while (inliers.size() > left) {
        ASSERT_TRUE(filled.store.remove(surface, inliers.back().key, inliers.back().position));
        inliers.pop_back();
      }
    }
    for (auto at = filled.inliers.begin(); at != filled.inliers.end();)
      if (at->second.empty()) {
        filled.store.erase(at->first);
        EXPECT_EQ(filled.store.find(at->first), nullptr);
        at = filled.inliers.erase(at);
      } else {
        ++at;
      }
    EXPECT_EQ(filled.store.size(), filled.inliers.size());
    expect_found(filled, rng);
    add_surface(filled, rng, 0.5);
  }
}

TEST(SurfaceStore, IdsRiseAndAreNeverUsedAgain) {
  SurfaceStore store(d);
  const SurfaceId first = store.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0}).id();
  const SurfaceId second = store.create({Eigen::Vector3d::UnitX(), 0}, {0, 0, 0}).id();
  EXPECT_EQ(first, 1U);
  EXPECT_EQ(second, 2U);
  store.erase(second);
  EXPECT_EQ(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}).id(), 3U);
  EXPECT_EQ(store.next_id(), 4U);
  // A voxel's 24 bits must stand for one surface: those of 1 and 3 are taken, and 0 is none.
  store.set_next_id(0x1000000);
  for (const SurfaceId next : {0x1000002U, 0x1000004U})
    EXPECT_EQ(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}).id(), next);
  store.set_next_id(last_id);
  EXPECT_EQ(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}).id(), last_id);
  EXPECT_ANY_THROW(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}));
}

// Cells of a map's voxels, beside a search through all voxels.

using Members = std::map<geometry::VoxelKey, std::vector<PointId>>;

/// Of every cell its voxels, by arithmetic on coordinates.
Members members_of(const test::PendingPoints& points, double edge) {
  Members cells;
  const geometry::VoxelGrid grid(edge);
  for (const PointId i : points.all) {
    geometry::VoxelKey key;
    EXPECT_TRUE(grid.key_of(points.ledger.grid.centre_of(points.ledger.window[i].key), key));
    cells[key].push_back(i);
  }
  return cells;
}

void expect_cells(const test::PendingPoints& points, const Members& members) {
  const Cells& cells = points.ledger.cells;
  ASSERT_EQ(cells.of(points.all).size(), members.size());
  for (const auto& [key, its] : members) {
    const PointId cell = cells.map().window.find(key);
    ASSERT_NE(cell, PointId::none);
    const occupancy::VoxelPoint& point = cells.map().window[cell];
    std::vector<PointId> visited;
    cells.for_each_voxel(cell, [&](PointId i) { visited.push_back(i); });
    EXPECT_TRUE(std::is_permutation(visited.begin(), visited.end(), its.begin(), its.end()));
    EXPECT_EQ(point.position, points.ledger.window[visited.front()].position);
    EXPECT_EQ(point.surface, points.ledger.window[visited.front()].surface);
    const auto with = [&](SurfaceId id) {
      return std::ranges::count_if(its, [&](PointId i) { return points.ledger.window[i].surface == id; });
    };
    for (const PointId i : its) EXPECT_LE(with(points.ledger.window[i].surface), with(point.surface));
    EXPECT_TRUE(point.surface == 0 || with(0) < with(point.surface)) << "pending ones count on a tie";
    EXPECT_EQ(cells.pending_in(cell), static_cast<std::size_t>(with(0)));
  }
}

TEST(Cells, AreThoseOfACoarserGridAndFollowTheirVoxels) {
  for (const double resolution : {0.02, 0.01, 0.005}) {
    SCOPED_TRACE(resolution);
    Scan scan;
    scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 2);
    std::mt19937_64 random = test::rng();
    std::uniform_real_distribution<float> length(-0.1F, 0.1F);
    for (int i = 0; i < 2000; ++i)  // on both sides of the origin
      scan.points.emplace_back(length(random), length(random), 0.2F * length(random) - 2);
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    test::PendingPoints points({scan}, parameters);
    const Members members = members_of(points, 0.02);
    expect_cells(points, members);
    std::vector<SurfaceModel*> surfaces;
    for (int k = 0; k < 2; ++k)
      surfaces.push_back(&points.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0}));
    for (const PointId i : points.all)
      if (const auto which = random() % 3; which < 2) points.ledger.give(i, *surfaces[which]);
    expect_cells(points, members);
    for (const PointId i : points.all)
      if (points.ledger.window[i].surface != 0 && random() % 2 == 0) points.ledger.requeue(i);
    expect_cells(points, members);
  }
}

TEST(Cells, AreNoWiderThanTwoThirdsOfTheNarrowestSurface) {
  const auto level = [](double resolution, double width) {
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    parameters.surfaces.min_surface_width = width;
    return test::PendingPoints({}, parameters).ledger.cells.map().level;
  };
  EXPECT_EQ(level(0.02, 0.03), 0);
  EXPECT_EQ(level(0.01, 0.03), 1);
  EXPECT_EQ(level(0.005, 0.03), 2);
  EXPECT_EQ(level(0.01, 0.02), 0);
  EXPECT_EQ(level(0.01, 0), 0) << "any width";
  EXPECT_EQ(level(0.005, 0.5), 2) << "a quarter of h";
}

using ::testing::ElementsAre;

const geometry::CylinderShape upright_pole{{1, 2, 0}, {0, 0, 1}, 0.1};

Inlier inlier(std::uint16_t z, double angle = 0) {
  return {{0, 0, z},
          1,
          Eigen::Vector3d(1 + 0.1 * std::cos(angle), 2 + 0.1 * std::sin(angle), 0.02 * z).cast<float>()};
}

TEST(CylinderStore, AVoxelSupportsOneCylinder) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  CylinderModel& b = store.create(upright_pole);
  store.add(a, inlier(1));
  store.add(a, inlier(2));
  store.add(b, inlier(2));
  EXPECT_EQ(store.owner(inlier(1).key), a.id);
  EXPECT_EQ(store.owner(inlier(2).key), b.id);
  EXPECT_EQ(store.owner(inlier(3).key), 0U);
  EXPECT_EQ(a.inliers.size(), 1U);
  store.release(inlier(2).key);
  store.release(inlier(3).key);
  EXPECT_EQ(store.owner(inlier(2).key), 0U);
  EXPECT_TRUE(b.inliers.empty());
  const CylinderId first = a.id;
  store.erase(first);
  EXPECT_EQ(store.find(first), nullptr);
  EXPECT_EQ(store.owner(inlier(1).key), 0U) << "free for others";
  EXPECT_EQ(store.create(upright_pole).id, first + 2) << "ids are never reused";
}

TEST(CylinderStore, PublishesAnewWhatWasTouched) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  CylinderModel& b = store.create(upright_pole);
  for (std::uint16_t z = 0; z < 10; ++z) {
    store.add(a, inlier(z, 0.1 * z));
    store.add(b, inlier(static_cast<std::uint16_t>(z + 20), 0.1 * z));
  }
  EXPECT_THAT(store.touched(), ElementsAre(a.id, b.id));
  const auto first = store.publish(7);
  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(first[0]->revision, 7U);
  EXPECT_EQ(first[0]->inliers, 10U);
  EXPECT_NEAR(first[0]->length_m, 0.18, 1e-6);
  EXPECT_NEAR(first[0]->axis_point.z(), 0.09, 1e-6) << "in the middle";
  EXPECT_NEAR(first[0]->span_rad, 0.9, 1e-6);
  EXPECT_NEAR(first[0]->start.x(), 1, 1e-6);
  EXPECT_LT(first[0]->rms_m, 1e-6);
  EXPECT_TRUE(store.touched().empty());
  EXPECT_EQ(store.publish(8), first) << "nothing has changed";
  store.release(inlier(9).key);
  const auto third = store.publish(9);
  EXPECT_EQ(third[1], first[1]);
  EXPECT_EQ(third[0]->inliers, 9U);
  EXPECT_EQ(third[0]->revision, 9U);
  EXPECT_NEAR(third[0]->length_m, 0.16, 1e-6);
  EXPECT_EQ(first[0]->inliers, 10U) << "what was published never changes";
}

TEST(CylinderStore, ACloserViewMovesAPoint) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  store.add(a, inlier(1));
  store.publish(1);
  Inlier closer = inlier(1);
  closer.position.z() += 0.005F;
  store.move(closer);
  store.move(inlier(2));
  EXPECT_EQ(a.inliers.size(), 1U);
  EXPECT_EQ(a.inliers.begin()->second.position, closer.position);
  EXPECT_THAT(store.touched(), ElementsAre(a.id));
}

// Double layers of sheets whose overlap and distance follow from the drawing.

using test::double_layers;

/// A level sheet about `middle`.
SurfaceId add(SurfaceStore& store, const Eigen::Vector3d& middle, double width, double height) {
  SurfaceModel& surface = store.create({Eigen::Vector3d::UnitZ(), middle.z()}, middle);
  test::VoxelMeans voxels(d);
  for (double u = -width / 2 + d / 4; u < width / 2; u += d / 2)
    for (double v = -height / 2 + d / 4; v < height / 2; v += d / 2)
      voxels.add(middle + Eigen::Vector3d(u, v, 0));
  for (const Inlier& inlier : voxels.inliers()) store.add(surface, inlier);
  return surface.id();
}

TEST(DoubleLayers, TwoSheetsOfOneFloor) {
  SurfaceStore store(d);
  const SurfaceId sheet = add(store, {2, 0, 0.03}, 1, 1);
  const SurfaceId floor = add(store, {0, 0, 0}, 4, 3);  // under half of it
  const auto layers = double_layers(store);
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_EQ(layers[0].smaller, sheet);
  EXPECT_EQ(layers[0].larger, floor);
  EXPECT_NEAR(static_cast<double>(layers[0].inliers), 0.5 * 50 * 50, 50) << "a row of voxels";
  EXPECT_NEAR(layers[0].distance_m, 0.03, 1e-6);
}

}  // namespace
}  // namespace octosurf::surfaces
