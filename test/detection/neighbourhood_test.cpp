// What of the map is labelled anew around a change, and what only stands beside it.
#include "detection/neighbourhood.hpp"

#include "detection/constants.hpp"
#include "detection/junctions.hpp"
#include "detection/label_blocks.hpp"
#include "detection/readings_of_all.hpp"
#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"
#include "detection/voxel_blocks.hpp"
#include "sensing/reading_code.hpp"
#include "support/pending_points.hpp"
#include "support/round_scene.hpp"

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

/// A floor that is a surface but for a tenth of its points, and a board that stands on it and is pending.
class FloorAndBoard {
 public:
  FloorAndBoard() : rng_(test::rng()), points_({scan(rng_)}) {
    surfaces::SurfaceModel& floor = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {1, 1, 0});
    id_ = floor.id();
    for (const PointId i : points_.all) {
      if (on_board(i))
        board_.push_back(i);
      else if (rng_() % 10 != 0)
        points_.ledger.give(i, floor);
    }
  }

  static Scan scan(std::mt19937_64& rng) {
    test::Scene scene;
    scene.rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
    scene.rectangle({0.5, 0.5, 0}, {0.4, 0, 0}, {0, 0, 0.3});
    return test::camera_scan(scene, test::look_at({1.2, 1.2, 1.8}, {0.8, 0.8, 0}), rng);
  }
  bool on_board(PointId i) const { return points_.position(i).z() > 0.03; }

  Neighbourhood around() const { return neighbourhood_of(points_.ledger, board_); }
  Readings readings_of(const Neighbourhood& around) const { return {points_.ledger, around}; }

  std::mt19937_64 rng_;
  test::PendingPoints points_;
  SurfaceId id_ = 0;
  std::vector<PointId> board_;
};

TEST(Neighbourhood, ContextAreTheInliersAround) {
  const FloorAndBoard scene;
  const Neighbourhood around = scene.around();
  EXPECT_FALSE(around.context.empty());
  const std::set<PointId> looked_at(around.points.begin(), around.points.end());
  std::set<PointId> beside;
  for (const PointId i : around.context) {
    EXPECT_EQ(scene.points_.ledger.window[i].surface, scene.id_);
    beside.insert(i);
  }
  EXPECT_EQ(looked_at.size() + beside.size(), around.points.size() + around.context.size());
  for (const PointId i : scene.board_) EXPECT_TRUE(looked_at.contains(i));
  for (const PointId i : beside) EXPECT_FALSE(looked_at.contains(i));
}

TEST(Neighbourhood, WhatWasPendingAroundJoinsAndSeedsNoPlane) {
  const FloorAndBoard scene;
  const surfaces::Ledger& ledger = scene.points_.ledger;
  const auto is_pending = [&](PointId i) { return ledger.window[i].surface == 0; };
  Neighbourhood around = scene.around();
  EXPECT_FALSE(around.may_join.empty());
  EXPECT_TRUE(std::all_of(around.may_join.begin(), around.may_join.end(), is_pending));
  // Were the board's points there only to join, nothing would seed it; the floor takes in what is its own.
  const auto planes_of = [&](const Neighbourhood& looked_at) {
    const Readings readings = scene.readings_of(looked_at);
    return segment(readings, limits_of(ledger.parameters),
                   with_seed_patches(readings, known_about(readings, ledger.surfaces, {})))
        .patches.size();
  };
  const std::size_t planes = planes_of(around);
  const auto first_pending = std::stable_partition(around.points.begin(), around.points.end(),
                                                   [&](PointId i) { return !is_pending(i); });
  around.may_join.insert(around.may_join.end(), first_pending, around.points.end());
  around.points.erase(first_pending, around.points.end());
  EXPECT_EQ(planes_of(around) + 1, planes);
}

TEST(Neighbourhood, WhatIsKnownOfASurfaceIsAllOfIt) {
  const FloorAndBoard scene;
  const Readings readings = scene.readings_of(scene.around());
  const Segmentation known = known_about(readings, scene.points_.ledger.surfaces, {});
  const surfaces::SurfaceModel& floor = *scene.points_.ledger.surfaces.find(scene.id_);
  ASSERT_EQ(known.outside.size(), 1U);
  std::size_t inside = 0;
  for (Index i = 0; i < readings.size(); ++i) inside += readings[i].surface == scene.id_;
  EXPECT_EQ(static_cast<double>(inside) + known.outside.front().sums.readings,
            static_cast<double>(floor.size()));
  const auto sums_of = [&](const Readings& some, Patch sums) {
    for (Index i = 0; i < some.size(); ++i)
      if (some[i].surface == scene.id_) some.add_to(sums, i);
    return sums;
  };
  Patch nothing;
  nothing.plane = floor.plane();
  const Patch whole = sums_of(readings, known.outside.front().sums);
  const Patch expected = sums_of(test::readings_of_all(scene.points_.ledger), nothing);
  // What is not among the readings weighs as those of its class of distance do, on the mean.
  EXPECT_NEAR(whole.moments.count / expected.moments.count, 1, 0.05);
  const Eigen::Vector3d off = whole.centroid() - expected.centroid();
  EXPECT_NEAR(off.z(), 0, 1e-3);
  EXPECT_LT(off.norm(), 0.1);  // a twentieth of the floor's edge
}

/// Readings of the plane x = 0 at y from `from` to `to` and z within a metre, with `sigma` of noise along the
/// rays.
Scan wall_scan(const Eigen::Vector3d& eye, double from, double to, double sigma, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, sigma);
  Scan scan;
  scan.T_map_sensor.translation() = eye;
  for (double y = from; y < to; y += 0.018)
    for (double z = -1; z < 1; z += 0.018) {
      const Eigen::Vector3d ray = Eigen::Vector3d(0, y, z) - eye;
      scan.points.push_back((ray * (1 + gauss(rng) / ray.norm())).cast<float>());
    }
  return scan;
}

// A wall seen head-on from 4 m, and its end along the wall: the noise of all the wall was taken to be as
// small as that of its end, off the plane, and the wall for none.
TEST(Neighbourhood, WhatIsKnownElsewhereMayHaveBeenSeenMoreHeadOn) {
  std::mt19937_64 rng = test::rng();
  constexpr double sigma = 0.015;
  Parameters parameters;
  parameters.surfaces.sensor_noise = 0.003;
  parameters.surfaces.range_noise = (sigma - 0.003) / 16;
  test::PendingPoints points(
      {wall_scan({4, 0, 0}, -1, 1, sigma, rng), wall_scan({0.25, 5, 0}, 1.02, 1.5, sigma, rng)}, parameters);
  surfaces::Ledger& ledger = points.ledger;
  surfaces::SurfaceModel& wall = ledger.create({Eigen::Vector3d::UnitX(), 0}, {0, 0, 0});
  for (const PointId i : points.all) ledger.give(i, wall);
  std::vector<PointId> end;
  for (const PointId i : points.all)
    if (points.position(i).y() > 1.3) end.push_back(i);
  const Readings readings(ledger, neighbourhood_of(ledger, end));
  const Segmentation known = known_about(readings, ledger.surfaces, {});
  ASSERT_EQ(known.outside.size(), 1U);
  const Patch& elsewhere = known.outside.front().sums;
  EXPECT_GT(elsewhere.readings, 0.75 * static_cast<double>(wall.size()));
  // Each explains the logarithm of its density over clutter's, less the mean of half a squared deviation.
  const double head_on = readings.model().log_peak(sensing::range_class_of(4), 1) - 0.5;
  EXPECT_NEAR(elsewhere.explained_by(wall.plane()) / elsewhere.readings, head_on, 0.5);
}

TEST(Neighbourhood, ContextKeepsItsLabelAndIsThereToBeMet) {
  const FloorAndBoard scene;
  const Neighbourhood around = scene.around();
  const Readings readings = scene.readings_of(around);
  ASSERT_LT(readings.size(), readings.size_with_context());
  const Segmentation found =
      segment(readings, limits_of(scene.points_.ledger.parameters),
              with_seed_patches(readings, known_about(readings, scene.points_.ledger.surfaces, {})));
  ASSERT_EQ(found.labels.size(), readings.size_with_context());
  ASSERT_EQ(found.outside.size(), 1U);
  const Label floor = found.outside.front().label;
  ASSERT_NE(floor, clutter);
  std::set<Label> of_board;
  std::size_t were_pending = 0;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const Eigen::Vector3f& at = readings[i].position;
    if (readings.is_context(i)) {
      EXPECT_EQ(found.labels[i], floor);
    } else if (at.z() > 0.1F) {
      of_board.insert(found.labels[i]);
    } else if (!readings.at_border(i) && std::fabs(at.y() - 0.5F) > 0.04F) {  // nor along the edge of the two
      EXPECT_EQ(found.labels[i], floor) << at.transpose();
      were_pending += readings[i].surface == 0;
    }
  }
  EXPECT_GT(were_pending, 0U);
  of_board.erase(clutter);  // rays that its edge parted
  EXPECT_EQ(of_board.size(), 1U);
  EXPECT_FALSE(of_board.contains(floor));
}

// What is looked up by block, beside the same looked up voxel by voxel.

int distance(geometry::VoxelKey a, geometry::VoxelKey b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

Scan corner(std::mt19937_64& rng) {
  test::Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  return test::camera_scan(scene, test::look_at({0.7, 0.8, 0.9}, {0.3, 0.2, 0.2}), rng);
}

TEST(LabelBlocks, FindWhatAWalkOverAllFinds) {
  std::mt19937_64 rng = test::rng();
  const test::PendingPoints points({corner(rng)}, Parameters{});
  std::vector<PointId> labelled, context;
  for (const PointId i : points.all) (rng() % 3 == 0 ? context : labelled).push_back(i);
  const Readings readings(points.ledger, {.points = labelled, .may_join = {}, .context = context});
  const auto size = static_cast<Index>(readings.size());
  ASSERT_EQ(size, labelled.size());
  std::vector<Label> labels(readings.size_with_context());
  std::vector<bool> wanted(size);
  for (Index i = 0; i < size; ++i) {
    labels[i] = static_cast<Label>(rng() % 3);
    wanted[i] = rng() % 2 == 0;
  }
  for (const int reach : {1, 4, 11}) {
    std::vector<std::set<std::pair<Index, Label>>> near(size);  // who, and whose group is met
    const auto looks_around = [](const auto& group) { return group.label != 2; };
    const auto look = [&](const LabelBlocks::Group& group,
                          const std::vector<const LabelBlocks::Block*>& blocks) {
      for (const Index i : group.members) {
        EXPECT_FALSE(readings.is_context(i));
        for (const LabelBlocks::Block* block : blocks)
          for (const LabelBlocks::Group& other : block->groups) {
            const occupancy::BlockPart part = block->within(readings[i].key, reach);
            const std::size_t before = near[i].size();
            LabelBlocks::for_each_of(other, part, [&](Index j) { near[i].emplace(j, other.label); });
            EXPECT_EQ(LabelBlocks::any_of(other, part), near[i].size() > before);
          }
      }
    };
    LabelBlocks(readings, labels, wanted).for_each_group(reach, looks_around, look);
    for (int trial = 0; trial < 100; ++trial) {
      const auto i = static_cast<Index>(rng() % size);
      std::set<std::pair<Index, Label>> expected;
      for (Index j = 0; j < size; ++j)
        if (wanted[i] && labels[i] != 2 && wanted[j] && distance(readings[i].key, readings[j].key) <= reach)
          expected.emplace(j, labels[j]);
      EXPECT_EQ(near[i], expected) << reach;
    }
  }
}

TEST(VoxelBlocks, WidenedAreThoseWithinReach) {
  std::mt19937_64 rng = test::rng();
  const int edge = 4, voxels = 5, reach = 2;
  const VoxelBlocks blocks(edge);
  std::vector<VoxelBlocks::Place> places;
  std::set<VoxelBlocks::Place> expected;
  const auto key_at = [](int x, int y, int z) {
    return geometry::VoxelKey{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                              static_cast<std::uint16_t>(z)};
  };
  for (int k = 0; k < 20; ++k) {  // near the corner where keys end
    const int x = static_cast<int>(rng() % 40), y = 65535 - static_cast<int>(rng() % 40), z = 70;
    places.push_back(blocks.of(key_at(x, y, z)));
    for (int dz = -reach; dz <= reach; ++dz)
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          const int bx = x + dx * edge, by = y + dy * edge;
          if (bx >= 0 && by <= 65535) expected.insert(blocks.of(key_at(bx, by, z + dz * edge)));
        }
  }
  const std::vector<VoxelBlocks::Place> found = blocks.widened(places, voxels);
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  EXPECT_EQ(std::set(found.begin(), found.end()), expected);
  EXPECT_EQ(found.size(), expected.size());
}

TEST(VoxelBlocks, HoldEachPointOnceUpToTheOctreesEnd) {
  std::mt19937_64 rng = test::rng();
  const double d = Parameters{}.occupancy.resolution;
  // One corner of the cloud at the last voxels of the octree, which an edge of seven does not divide.
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d::Constant((32768 - 60) * d);
  for (int k = 0; k < 400; ++k) {
    const auto part = [&] { return static_cast<float>((20.5 + static_cast<double>(rng() % 39)) * d); };
    scan.points.emplace_back(part(), part(), part());
  }
  scan.points.emplace_back(Eigen::Vector3f::Constant(static_cast<float>(59.5 * d)));
  const test::PendingPoints points({scan}, Parameters{});
  std::multiset<std::uint64_t> all, met;
  std::set<VoxelBlocks::Place> places;
  const VoxelBlocks blocks(7);
  points.state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    all.insert(p.key.packed());
    places.insert(blocks.of(p.key));
  });
  ASSERT_EQ(*all.rbegin(), (geometry::VoxelKey{65535, 65535, 65535}.packed()));
  for (const VoxelBlocks::Place place : places)
    blocks.for_each_point(points.ledger.window, place,
                          [&](PointId i) { met.insert(points.ledger.window[i].key.packed()); });
  EXPECT_EQ(met, all);
}

// Which readings may be of two planes, and which neighbours a third plane parts: beside the definition, asked
// anew for every pair.

/// A wall, and a board of 3 cm that stands out of its lower half, turned by some angle; of the board one side
/// is seen, of the wall what is beside both. Each reading has the label of the face that it is nearest to.
class WallAndBoard {
 public:
  static constexpr Label wall = 1;
  static constexpr double half_thickness = 0.015, board_top = 0.7;

  explicit WallAndBoard(std::mt19937_64& rng)
      : turn_(std::uniform_real_distribution(0.0, 6.28)(rng), Eigen::Vector3d::UnitZ()),
        points_(look(rng)),
        readings_(test::readings_of_all(points_.ledger)) {
    for (const Eigen::Vector4d& face : faces()) {
      Patch patch;
      patch.plane = {turn_ * face.head<3>(), face.w()};
      patches_.push_back(patch);
    }
    for (Index i = 0; i < readings_.size(); ++i) labels_.push_back(nearest_face(i));
  }

  /// In the frame in which the wall is x = 0 and the board y = 0.
  Eigen::Vector3d at(Index i) const { return turn_.inverse() * readings_[i].position.cast<double>(); }
  const Readings& readings() const { return readings_; }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Patch>& patches() const { return patches_; }
  Junctions junctions() const { return {readings_, labels_, patches_}; }

 private:
  /// Normals and offsets; first of clutter.
  static std::vector<Eigen::Vector4d> faces() {
    return {Eigen::Vector4d::Zero(), {1, 0, 0, 0}, {0, -1, 0, half_thickness}, {0, 1, 0, half_thickness}};
  }

  std::vector<Scan> look(std::mt19937_64& rng) const {
    test::Scene scene;
    const auto rectangle = [&](Eigen::Vector3d from, Eigen::Vector3d a, Eigen::Vector3d b) {
      scene.rectangle(turn_ * from, turn_ * a, turn_ * b);
    };
    rectangle({0, -1, 0}, {0, 2, 0}, {0, 0, 1.4});
    for (const double side : {-half_thickness, half_thickness})
      rectangle({0, side, 0}, {0.3, 0, 0}, {0, 0, board_top});
    rectangle({0.3, -half_thickness, 0}, {0, 2 * half_thickness, 0}, {0, 0, board_top});
    std::vector<Scan> scans;
    for (const double y : {0.0, 0.7})
      scans.push_back(test::camera_scan(
          scene, test::look_at(turn_ * Eigen::Vector3d(1.3, y, 0.7), turn_ * Eigen::Vector3d(0, 0, 0.7)),
          rng));
    return scans;
  }

  Label nearest_face(Index i) const {
    const Eigen::Vector3d p = at(i);
    Label nearest = clutter;
    double least = 0.01;
    for (Label label = 1; label < patches_.size(); ++label) {
      if (label != wall && p.z() > board_top) continue;
      const double distance = std::fabs(readings_[i].distance(patches_[label].plane));
      if (distance >= least) continue;
      least = distance;
      nearest = label;
    }
    return nearest;
  }

  Eigen::AngleAxisd turn_;
  test::PendingPoints points_;
  Readings readings_;
  std::vector<Patch> patches_;
  std::vector<Label> labels_;
};

TEST(Junctions, AreWhatTheyAreDefinedAs) {
  std::mt19937_64 rng = test::rng();
  const WallAndBoard scene(rng);
  const Readings& readings = scene.readings();
  const std::vector<Label>& labels = scene.labels();
  const Junctions junctions = scene.junctions();
  const auto plane_of = [&](Index k) -> const Plane& { return scene.patches()[labels[k]].plane; };
  const auto at_angle = [&](Index i, Index k) {
    return labels[i] != clutter && labels[k] != clutter &&
           std::fabs(plane_of(i).normal.dot(plane_of(k).normal)) < Constants::cos_nearly_parallel;
  };
  std::size_t ambiguous = 0, parted = 0;
  for (Index i = 0; i < readings.size(); ++i) {
    const auto near = readings.near(i);
    EXPECT_EQ(junctions.ambiguous(i), std::any_of(near.begin(), near.end(), [&](Index k) {
                return labels[i] != clutter && labels[k] != clutter && labels[k] != labels[i] &&
                       plane_of(i).normal.dot(plane_of(k).normal) < Constants::cos_nearly_parallel &&
                       readings.gain(i, plane_of(k)) > 0;
              }));
    ambiguous += junctions.ambiguous(i);
    for (const Index j : near) {
      const auto passes = [&](Index beside) {
        const auto around = readings.near(beside);
        return std::any_of(around.begin(), around.end(), [&](Index k) {
          return at_angle(beside, k) &&
                 readings[i].distance(plane_of(k)) * readings[j].distance(plane_of(k)) < 0;
        });
      };
      ASSERT_EQ(junctions.separated_by_plane(i, j), passes(i) || passes(j));
      parted += junctions.separated_by_plane(i, j);
    }
  }
  EXPECT_GT(ambiguous, 0U);
  EXPECT_GT(parted, 0U);
}

TEST(Junctions, RenewedAreThoseOfTheNewLabels) {
  std::mt19937_64 rng = test::rng();
  const WallAndBoard scene(rng);
  // One side of the board is given up, the other renamed, and the planes move a little.
  std::vector<Label> labels = scene.labels();
  const std::vector<Label> into{clutter, 2, clutter, 1};
  for (Label& label : labels) label = into[label];
  std::vector<Patch> patches{scene.patches()[0], scene.patches()[3], scene.patches()[1]};
  std::normal_distribution<double> by(0, 0.003);
  for (Patch& patch : patches) patch.plane.offset += by(rng);
  Junctions renewed = scene.junctions();
  renewed.renew(labels, patches);
  const Junctions anew(scene.readings(), labels, patches);
  for (Index i = 0; i < scene.readings().size(); ++i) {
    EXPECT_EQ(renewed.ambiguous(i), anew.ambiguous(i));
    for (const Index j : scene.readings().near(i))
      EXPECT_EQ(renewed.separated_by_plane(i, j), anew.separated_by_plane(i, j));
  }
  EXPECT_TRUE(std::includes(renewed.contacts().begin(), renewed.contacts().end(), anew.contacts().begin(),
                            anew.contacts().end()));
  EXPECT_FALSE(anew.contacts().empty());
}

}  // namespace
}  // namespace octosurf::detection
