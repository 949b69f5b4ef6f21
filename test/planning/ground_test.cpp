// Ground as planners get it, on hand-made scenes: nothing that a foot must not trust, whatever else is lost.
#include "planning/rings.hpp"
#include "support/scene.hpp"

#include <octosurf/ground.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/queries.hpp>

namespace octosurf {
namespace {

constexpr double edge = 0.02;  // m, of a voxel
const SlopeLimit walkable{Eigen::Vector3d::UnitZ(), 0.5};

// Two floors with a slot between them, too narrow for a hole of the outline, that runs in any direction: most
// of it lies in voxels that the floors or its own walls occupy.
TEST(GroundView, SlotsAreNoGroundWhicheverWayTheyRun) {
  std::mt19937_64 rng(test::seed());
  const auto uniform = [&rng](double from, double to) {
    return std::uniform_real_distribution(from, to)(rng);
  };
  for (int round = 0; round < 6; ++round) {
    const double width = uniform(2, 4.5) * edge, depth = uniform(0.1, 1);
    Eigen::Isometry3d T_map_slot(Eigen::AngleAxisd(uniform(0, std::numbers::pi), Eigen::Vector3d::UnitZ()));
    T_map_slot.translation() = Eigen::Vector3d(uniform(0, edge), uniform(0, edge), uniform(0, edge));
    SCOPED_TRACE(testing::Message() << "round " << round << ": " << width << " m wide, " << depth
                                    << " m deep");
    test::Scene scene;
    const auto add = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
      scene.rectangle(T_map_slot * corner, T_map_slot.linear() * u, T_map_slot.linear() * v);
    };
    const double half = width / 2, length = 0.8;
    add({-half, -length / 2, -depth}, {width, 0, 0}, {0, length, 0});
    for (const double side : {-1.0, 1.0}) {
      add({side * half, -length / 2, 0}, {side * 0.5, 0, 0}, {0, length, 0});
      add({side * half, -length / 2, -depth}, {0, length, 0}, {0, 0, depth});
    }
    Mapper mapper(test::of_voxels(edge, false));
    for (int k = 0; k < 8; ++k) {
      const double turn = k * std::numbers::pi / 4 + uniform(-0.3, 0.3);
      const Eigen::Vector3d eye(std::cos(turn), std::sin(turn), uniform(0.8, 1.4));
      mapper.insert(test::camera_scan(scene, test::look_at(eye, {0, 0, 0}), rng, {400, 300, 340}));
    }
    mapper.drain();
    const SurfaceIndex ground(GroundView(mapper.snapshot(), mapper.map().octree()).supported());
    const auto stands_at = [&](double x, double y) {
      const std::optional<Nearest> met = ground.below(T_map_slot * Eigen::Vector3d(x, y, 0.1), walkable);
      return met && std::abs((T_map_slot.inverse() * met->point).z()) < 0.03;
    };
    int beside = 0, stood = 0;
    for (double y = -0.3; y < 0.3; y += 0.01) {
      for (double x = -half; x <= half; x += width / 8) EXPECT_FALSE(stands_at(x, y)) << x << ' ' << y;
      for (double x = half + 3 * edge; x < 0.4; x += 0.03, beside += 2)
        stood += stands_at(x, y) + stands_at(-x, y);
    }
    EXPECT_GT(stood, 0.99 * beside);
  }
}

/// A floor of 2 × 2 m with a pole of 4 cm in the middle, a board of 30 × 60 cm over it, 25 cm high, and a
/// wall.
class Place : public testing::Test {
 protected:
  Place() {
    test::Scene scene;
    scene.rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    scene.rectangle({-1, 1, 0}, {2, 0, 0}, {0, 0, 2});
    scene.box({-0.02, -0.02, 0}, {0.02, 0.02, 1});
    scene.box({0.4, -0.3, 0.25}, {0.7, 0.3, 0.3});
    std::mt19937_64 rng(test::seed());
    Mapper mapper(test::of_voxels(edge, false));
    for (int k = 0; k < 8; ++k) {
      const double turn = k * std::numbers::pi / 4;
      mapper.insert(test::camera_scan(
          scene, test::look_at({1.2 * std::cos(turn), 0.9 * std::sin(turn), 1.2}, {0, 0, 0.1}), rng,
          {400, 300, 340}));
    }
    mapper.drain();
    snapshot = mapper.snapshot();
    octree = mapper.map().octree();
  }
  bool accepted(const GroundView& ground, const Eigen::Vector3d& at) const {
    return ground.foothold(SurfaceIndex(snapshot).nearest(at)->id, at, 0.3).accepted;
  }
  bool stands(const SurfaceIndex& on, double x, double y) const {
    const auto met = on.below({x, y, 0.1}, walkable);
    return met && std::abs(met->point.z()) < 0.02;
  }
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
};

TEST_F(Place, NoFootIsPutIntoAPoleUnderABoardOrOnAWall) {
  const GroundView ground(snapshot, octree, GroundRules::of(Biped{}, edge));
  EXPECT_TRUE(accepted(ground, {-0.5, -0.4, 0}));
  EXPECT_FALSE(accepted(ground, {0, 0, 0}));
  EXPECT_FALSE(accepted(ground, {0.1, 0, 0}));
  EXPECT_FALSE(accepted(ground, {0.55, 0, 0}));
  EXPECT_FALSE(accepted(ground, {0, 1, 1}));
  const SurfaceIndex supported(ground.supported());
  for (double x = -0.02; x <= 0.7; x += 0.01) {
    const bool covered = std::abs(x) < 0.021 || x > 0.4;  // by pole or board
    EXPECT_FALSE(covered && stands(supported, x, 0.01)) << x;
  }
  EXPECT_TRUE(stands(supported, -0.5, -0.4));
  EXPECT_TRUE(stands(supported, 0.2, 0.1));
}

TEST_F(Place, OutlinesAsMappedTakeAWord) {
  GroundRules rules;
  rules.as_mapped = true;
  rules.limits = {};
  const GroundView ground(snapshot, octree, rules);
  EXPECT_TRUE(accepted(ground, {0, 0, 0}));
  for (const SurfacePtr& surface : snapshot->surfaces) EXPECT_EQ(ground.solid(surface->id), surface);
}

// What is read about a place is what is read of all.
TEST_F(Place, AboutAPlaceAsOfAll) {
  std::mt19937_64 rng(test::seed());
  const auto uniform = [&rng](double from, double to) {
    return std::uniform_real_distribution(from, to)(rng);
  };
  const GroundView ground(snapshot, octree);
  const Surface* floor = snapshot->find(SurfaceIndex(snapshot).nearest({-0.5, -0.4, 0})->id);
  const SurfacePtr solid = ground.solid(floor->id);
  int accepted = 0;
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d at(uniform(-1.1, 1.1), uniform(-1.1, 1.1), 0);
    const double yaw = uniform(-3, 3);
    const Foothold is = ground.foothold(floor->id, at, yaw),
                   expected = foothold(*solid, ground.rules().foot, at, yaw, ground.rules().limits, &octree,
                                       snapshot.get());
    EXPECT_EQ(is.accepted, expected.accepted) << at.transpose();
    EXPECT_EQ(is.refused, expected.refused) << at.transpose();
    EXPECT_NEAR(is.supported, expected.supported, 1e-3);
    EXPECT_NEAR(is.margin_m, std::min(expected.margin_m, Foothold::farthest_margin_m), 1e-5);
    accepted += is.accepted;
  }
  EXPECT_GT(accepted, 50);
  EXPECT_LT(accepted, 250);

  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d about(uniform(-1, 1), uniform(-1, 1), 0);
    const double reach = uniform(0.2, 0.6);
    const std::optional<double> yaw = k % 2 == 0 ? std::optional(uniform(-3, 3)) : std::nullopt;
    const ContactRegion part = ground.region_about(floor->id, about, reach, yaw),
                        all = ground.region(floor->id, yaw);
    const Eigen::Vector2d middle = (floor->T_map_surface.inverse() * about).head<2>();
    const auto holds = [](const ContactRegion& region, const Eigen::Vector2d& uv) {
      return std::any_of(region.polygons.begin(), region.polygons.end(),
                         [&](const Polygon& polygon) { return planning::contains(polygon, uv); });
    };
    for (double u = -reach + 1e-4; u < reach; u += 0.011)
      for (double v = -reach + 1e-4; v < reach; v += 0.011) {
        // Rings are simplified from another corner on: up to a cell off.
        const Eigen::Vector2d uv = middle + Eigen::Vector2d(u, v), x(edge / 4, 0), y(0, edge / 4);
        const bool inside = holds(all, uv);
        if (inside == holds(all, uv + x) && inside == holds(all, uv - x) && inside == holds(all, uv + y) &&
            inside == holds(all, uv - y)) {
          EXPECT_EQ(holds(part, uv), inside) << uv.transpose();
        }
      }
    EXPECT_FALSE(holds(part, middle + Eigen::Vector2d(reach + 1e-4, 0)));
  }
}

// A view by other rules answers as one made anew, and shares what does not depend on them.
TEST_F(Place, ByOtherRules) {
  const GroundView ground(snapshot, octree);
  const SurfaceId id = SurfaceIndex(snapshot).nearest({-0.5, -0.4, 0})->id;
  GroundRules wide;
  wide.limits.edge_margin_m = 0.1;
  const GroundView other = ground.by(wide), anew(snapshot, octree, wide);
  EXPECT_EQ(other.solid(id), ground.solid(id));
  EXPECT_EQ(other.supported(id)->area_m2, anew.supported(id)->area_m2);
  EXPECT_LT(other.supported(id)->area_m2, ground.supported(id)->area_m2);
  wide.widest_unseen_m = 0;
  EXPECT_NE(&ground.by(wide).gaps(id), &ground.gaps(id));
}

void expect_equal(const GroundView& kept, const GroundView& anew) {
  ASSERT_EQ(kept.mapped().surfaces, anew.mapped().surfaces);
  EXPECT_EQ(kept.stairs().single_steps, anew.stairs().single_steps);
  EXPECT_EQ(kept.stairs().stairs.size(), anew.stairs().stairs.size());
  for (const SurfacePtr& mapped : anew.mapped().surfaces) {
    const SurfacePtr is = kept.solid(mapped->id), expected = anew.solid(mapped->id);
    ASSERT_EQ(is->polygons.size(), expected->polygons.size()) << mapped->id;
    for (std::size_t i = 0; i < is->polygons.size(); ++i) {
      EXPECT_EQ(is->polygons[i].outer, expected->polygons[i].outer) << mapped->id;
      EXPECT_EQ(is->polygons[i].holes, expected->polygons[i].holes) << mapped->id;
    }
    const std::vector<Gap>&gaps = kept.gaps(mapped->id), &expected_gaps = anew.gaps(mapped->id);
    ASSERT_EQ(gaps.size(), expected_gaps.size()) << mapped->id;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      EXPECT_EQ(gaps[i].outline.outer, expected_gaps[i].outline.outer);
      EXPECT_EQ(gaps[i].width_m, expected_gaps[i].width_m);
      EXPECT_EQ(gaps[i].bridged, expected_gaps[i].bridged);
    }
    const auto near = [&](const GroundView& view) {  // by its squares
      return view.region_about(mapped->id, mapped->to_map(mapped->polygons.at(0).outer[0]), 0.5, 0.3);
    };
    EXPECT_EQ(near(kept).area_m2, near(anew).area_m2);
  }
}

// A slotted floor, a ramp, and a crate that comes and goes; some of the ground is read between scans.
TEST(GroundView, KeptUpEqualsOneMadeFromNothing) {
  std::mt19937_64 rng(test::seed());
  const auto uniform = [&rng](double from, double to) {
    return std::uniform_real_distribution(from, to)(rng);
  };
  for (const double widest_unseen : {0.03, 0.2}) {  // by tiles, and all at once
    test::Scene empty;
    const double slot = uniform(0.05, 0.1);
    empty.rectangle({-2, -2, 0}, {4, 0, 0}, {0, 2, 0});
    empty.rectangle({-2, slot, 0}, {4, 0, 0}, {0, 2, 0});
    empty.rectangle({-2, 0, -0.3}, {4, 0, 0}, {0, slot, 0});
    empty.rectangle({0.8, -1.5, 0}, {1, 0, 0.3}, {0, 1, 0});
    test::Scene crate = empty;
    crate.box({-0.9, -0.8, 0}, {-0.5, -0.4, 0.3});
    Mapper mapper(test::of_voxels(edge, false));
    mapper.share_octree();
    GroundRules rules;
    rules.widest_unseen_m = widest_unseen;
    std::optional<GroundView> kept;
    for (int k = 0; k < 12; ++k) {
      const double turn = uniform(0, 6.3);
      const Eigen::Vector3d eye(1.4 * std::cos(turn), 1.4 * std::sin(turn), uniform(0.8, 1.4));
      mapper.insert(test::camera_scan(k % 6 < 3 ? crate : empty,
                                      test::look_at(eye, {uniform(-1, 1), uniform(-1, 1), 0}), rng,
                                      {200, 150, 170}));
      const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
      kept = kept ? kept->next(snapshot, snapshot->octree) : GroundView(snapshot, snapshot->octree, rules);
      if (k % 3 != 1) expect_equal(*kept, GroundView(snapshot, snapshot->octree, rules));
    }
  }
}

TEST_F(Place, WhatIsNotThereIsRefused) {
  EXPECT_THROW(GroundView(snapshot, {}), Error);
  EXPECT_THROW(GroundView(snapshot, octree).solid(99999), Error);
}

}  // namespace
}  // namespace octosurf
