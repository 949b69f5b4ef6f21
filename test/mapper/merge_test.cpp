// Two maps into one: against the map of all scans, in both orders, in another frame.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "support/unshared_area.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::test {
namespace {

/// A room with a table in its middle.
Scene room() {
  Scene scene;
  scene.rectangle({-2, -1.5, 0}, {4, 0, 0}, {0, 3, 0});
  scene.rectangle({-2, -1.5, 0}, {4, 0, 0}, {0, 0, 1.8}).rectangle({-2, 1.5, 0}, {4, 0, 0}, {0, 0, 1.8});
  scene.rectangle({-2, -1.5, 0}, {0, 3, 0}, {0, 0, 1.8}).rectangle({2, -1.5, 0}, {0, 3, 0}, {0, 0, 1.8});
  scene.box({-0.5, -0.4, 0}, {0.5, 0.4, 0.5});
  return scene;
}

/// From the middle of the room over one half of it, to both sides.
std::vector<Scan> scans_of_half(std::mt19937_64& rng, double side, int count = 6) {
  const Scene scene = room();
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const double y = 1.2 * std::sin(1.3 * i);
    scans.push_back(camera_scan(scene, look_at({-0.4 * side, -0.6 * y, 1.4}, {1.3 * side, y, 0.3}), rng));
  }
  return scans;
}

void expect_sound(const Mapper& mapper) {
  EXPECT_THAT(check_invariants(mapper.map()), ::testing::IsEmpty());
  expect_guarantees(mapper.map());
}

std::size_t large(const Snapshot& snapshot) {
  return static_cast<std::size_t>(std::count_if(snapshot.surfaces.begin(), snapshot.surfaces.end(),
                                                [](const SurfacePtr& s) { return s->area_m2 > 0.25; }));
}

/// Surfaces of the same places, to `share` of their area.
void expect_same_surfaces(const Snapshot& a, const Snapshot& b, double share) {
  EXPECT_LT(unshared_area(a, b), share * area_of(a));
  EXPECT_LT(unshared_area(b, a), share * area_of(b));
  EXPECT_EQ(large(a), large(b));
}

std::vector<SurfacePtr> floors_of(const Snapshot& snapshot) {
  std::vector<SurfacePtr> floors;
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (surface->plane.normal.z() > 0.99 && std::fabs(surface->plane.offset) < 0.05)
      floors.push_back(surface);
  return floors;
}

/// Share of the other map's inliers that are in voxels of a surface.
double still_on_surfaces(const Map& merged, const Map& other,
                         const Eigen::Isometry3d& T_map_other = Eigen::Isometry3d::Identity()) {
  double inliers = 0, still = 0;
  other.for_each_point([&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface == 0) return;
    ++inliers;
    still += merged.at(T_map_other * voxel.point).surface != 0;
  });
  return still / inliers;
}

TEST(MergedMaps, HalvesOfARoomMakeTheRoomInEitherOrder) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> left = scans_of_half(rng, -1), right = scans_of_half(rng, 1);
  std::vector<Scan> both = left;
  both.insert(both.end(), right.begin(), right.end());
  const Mapper all = mapped(both), other = mapped(right);
  Mapper mapper = mapped(left);
  const auto before = mapper.snapshot();
  const ScanReport report = mapper.merge(other.map());
  expect_sound(mapper);
  const auto after = mapper.snapshot();
  const Snapshot& merged = *after;
  expect_same_surfaces(merged, *all.snapshot(), 0.03);
  EXPECT_EQ(mapper.map().size().scans, both.size());
  EXPECT_EQ(merged.revision, before->revision + 1);

  // Those that were there keep their ids.
  for (const SurfacePtr& surface : before->surfaces) {
    const std::vector<SurfaceId>& taken_in = report.merged;
    EXPECT_TRUE(merged.find(surface->id) != nullptr ||
                std::find(taken_in.begin(), taken_in.end(), surface->id) != taken_in.end())
        << surface->id;
  }
  // Nothing that the other one knew is lost.
  EXPECT_GT(still_on_surfaces(mapper.map(), other.map()), 0.97);

  // The floors of both halves become one, as exact as that of all scans: noise of 2 mm a reading, over a
  // thousand readings and some metres.
  const std::vector<SurfacePtr> of_left = floors_of(*before), floors = floors_of(merged),
                                of_all = floors_of(*all.snapshot());
  ASSERT_THAT((std::array{of_left.size(), floors.size(), of_all.size()}), ::testing::Each(1U));
  EXPECT_EQ(floors[0]->id, of_left[0]->id);
  EXPECT_NEAR(floors[0]->area_m2, of_all[0]->area_m2, 0.02 * of_all[0]->area_m2);
  EXPECT_LT(std::acos(std::min(1.0, floors[0]->plane.normal.z())), 0.001);
  EXPECT_LT(std::fabs(floors[0]->plane.offset), 0.001);

  // In the other order, too.
  Mapper reversed = mapped(right);
  reversed.merge(mapped(left).map());
  EXPECT_TRUE(leaves_of(mapper.map()) == leaves_of(reversed.map()));
  expect_sound(reversed);
  expect_same_surfaces(merged, *reversed.snapshot(), 0.03);
}

TEST(MergedMaps, AnEmptyOneChangesNothingAndBecomesTheOther) {
  std::mt19937_64 rng = test::rng();
  Mapper other = mapped(scans_of_half(rng, 1));
  const std::string before = digest(other.map());
  other.merge(Map());
  EXPECT_EQ(digest(other.map()), before);
  Mapper mapper;
  mapper.merge(other.map());
  expect_sound(mapper);
  EXPECT_TRUE(leaves_of(mapper.map()) == leaves_of(other.map()));
  expect_same_surfaces(*mapper.snapshot(), *other.snapshot(), 0.03);
}

/// A table that the other map has seen to be gone.
TEST(MergedMaps, SurfacesGoWhereTheSumSaysFree) {
  std::mt19937_64 rng = test::rng();
  Scene full, empty;
  empty.rectangle({-1.5, -1.5, 0}, {3, 0, 0}, {0, 3, 0});
  full = empty;
  full.box({-0.4, -0.3, 0}, {0.4, 0.3, 0.4});
  const auto scans = [&](const Scene& scene, int count) {
    std::vector<Scan> all;
    for (int i = 0; i < count; ++i)
      all.push_back(camera_scan(
          scene, look_at({1.6 * std::cos(0.7 * i), 1.6 * std::sin(0.7 * i), 1.4}, {0, 0, 0.1}), rng));
    return all;
  };
  const auto tops = [](const Snapshot& snapshot) {
    return std::count_if(snapshot.surfaces.begin(), snapshot.surfaces.end(), [](const SurfacePtr& s) {
      return s->plane.normal.z() > 0.99 && std::fabs(s->plane.offset - 0.4) < 0.03;
    });
  };
  Mapper mapper = mapped(scans(full, 2));  // twice 0.85: less than the six rays through it, 2.0 at most
  ASSERT_EQ(tops(*mapper.snapshot()), 1);
  const ScanReport report = mapper.merge(mapped(scans(empty, 12)).map());
  EXPECT_GT(report.vanished, 100u);
  EXPECT_EQ(tops(*mapper.snapshot()), 0);
  expect_sound(mapper);
}

/// The other map was made in a frame of its own, whose voxels are no voxels here.
TEST(MergedMaps, LieWhereThePoseSays) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  const std::vector<Scan> left = scans_of_half(rng, -1), right = scans_of_half(rng, 1);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
  T.rotate(Eigen::AngleAxisd(3 * uniform(rng), Eigen::Vector3d(uniform(rng), uniform(rng), 2).normalized()));
  std::vector<Scan> elsewhere = right, both = left;
  for (Scan& scan : elsewhere) scan = moved(scan, T.inverse());
  both.insert(both.end(), right.begin(), right.end());
  Mapper mapper = mapped(left);
  const Mapper other = mapped(elsewhere);
  const ScanReport report = mapper.merge(other.map(), T);
  expect_sound(mapper);
  const Mapper all = mapped(both);
  expect_same_surfaces(*mapper.snapshot(), *all.snapshot(), 0.05);
  EXPECT_EQ(report.points_out_of_map, 0u);
  EXPECT_GT(still_on_surfaces(mapper.map(), other.map(), T), 0.95);
}

TEST(MergedMaps, AreRefusedBeforeAnythingIsTouched) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = scans_of_half(rng, 1, 2);
  Mapper mapper = mapped(scans);
  const std::string before = digest(mapper.map());
  const auto refusal = [&](const Map& other, const Eigen::Isometry3d& T = Eigen::Isometry3d::Identity()) {
    try {
      mapper.merge(other, T);
    } catch (const Error& error) {
      EXPECT_FALSE(error.hint().empty());
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  const auto with = [&](const char* name, const char* value) {
    Parameters parameters;
    set_parameter(parameters, name, value);
    return mapped(scans, parameters);
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal(with("resolution", "0.05").map()), HasSubstr("resolution is 0.05"));
  EXPECT_THAT(refusal(with("clamp_max", "0.9").map()), HasSubstr("clamp_max"));
  EXPECT_THAT(refusal(with("clamp_min", "0.2").map()), HasSubstr("clamp_min"));
  EXPECT_THAT(refusal(with("occupied", "0.6").map()), HasSubstr("occupied"));
  EXPECT_THAT(refusal(mapper.map()), HasSubstr("itself"));
  Eigen::Isometry3d stretched = Eigen::Isometry3d::Identity();
  stretched.linear() *= 1.1;
  EXPECT_THAT(refusal(with("hit", "0.8").map(), stretched), HasSubstr("T_map_other"));
  EXPECT_EQ(digest(mapper.map()), before);
  EXPECT_EQ(refusal(with("hit", "0.8").map()), "nothing") << "what a hit weighs is in the log-odds";
}

}  // namespace
}  // namespace octosurf::test
