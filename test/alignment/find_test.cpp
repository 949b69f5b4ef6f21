// Places of runs of scans in a map, without a guess.
#include "alignment/place_search.hpp"
#include "alignment/pose_fit.hpp"
#include "alignment/run_places.hpp"
#include "alignment/scan_aligner.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "support/painted_octree.hpp"
#include "support/scene.hpp"

#include <octosurf/alignment.hpp>
#include <octosurf/judgement.hpp>
#include <octosurf/map_alignment.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

enum class Eye { lidar, camera };

/// A room with blocks along its walls and in it, in a corner of the map.
struct Furnished {
  Eigen::Vector2d corner, size;
  unsigned blocks;  ///< which: equal numbers, equal blocks
};

Scene scene_of(const std::vector<Furnished>& rooms) {
  Scene scene;
  constexpr double floor = 0.013;  // not on a face of voxels
  for (const Furnished& room : rooms) {
    const Eigen::Vector3d low(room.corner.x(), room.corner.y(), floor);
    scene.box(low, low + Eigen::Vector3d(room.size.x(), room.size.y(), 2.4));
    std::mt19937_64 rng(room.blocks);
    std::uniform_real_distribution<double> share(0, 1);
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d edge(0.4 + 0.8 * share(rng), 0.4 + 0.5 * share(rng), 0.4 + 0.9 * share(rng));
      // Around the middle, where the sensor is.
      const double angle = 2 * std::numbers::pi * (i + 0.6 * share(rng)) / 5;
      const Eigen::Vector3d middle = low + Eigen::Vector3d(room.size.x() * (0.5 + 0.36 * std::cos(angle)),
                                                           room.size.y() * (0.5 + 0.36 * std::sin(angle)), 0);
      const Eigen::Vector3d half(edge.x() / 2, edge.y() / 2, 0);
      scene.box(middle - half, middle + half + Eigen::Vector3d(0, 0, edge.z()));
    }
  }
  return scene;
}

/// In the middle third of a room, turned anyhow.
Eigen::Isometry3d anywhere_in(const Furnished& room, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> share(-0.12, 0.12), turn(-std::numbers::pi, std::numbers::pi);
  return Eigen::Translation3d(room.corner.x() + room.size.x() * (0.5 + share(rng)),
                              room.corner.y() + room.size.y() * (0.5 + share(rng)), 1.5 + share(rng)) *
         Eigen::Isometry3d(Eigen::AngleAxisd(turn(rng), Eigen::Vector3d::UnitZ()));
}

/// Scans from a pose on: a lidar that moves on by 10 cm, a camera that turns by 20°, each.
std::vector<Scan> run_from(const Scene& scene, const Eigen::Isometry3d& start, Eye sensor, int count,
                           std::mt19937_64& rng) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const double turn = i * 20 * degree;
    const Eigen::Vector3d ahead(std::cos(turn), std::sin(turn), -0.3);
    if (sensor == Eye::lidar)
      scans.push_back(spinning_scan(scene, start * Eigen::Translation3d(0.1 * i, 0, 0), rng,
                                    rings(-0.6, 0.035, 32), 360, 0.008));
    else
      scans.push_back(camera_scan(scene, look_at(start.translation(), start * ahead), rng,
                                  {.width = 160, .height = 120, .focal = 120, .noise = 0.003}));
  }
  return scans;
}

Map mapped(const std::vector<Furnished>& rooms, std::mt19937_64& rng) {
  const Scene scene = scene_of(rooms);
  Mapper mapper(of_voxels(0.05));
  for (const Furnished& room : rooms)
    for (int i = 0; i < 6; ++i)
      for (const Scan& scan : run_from(scene, anywhere_in(room, rng), Eye::lidar, 1, rng))
        mapper.insert(scan);
  return std::move(mapper).release();
}

/// Of a session: turned about the vertical and shifted.
const Eigen::Isometry3d session =
    Eigen::Translation3d(7, -11, 0.6) * Eigen::Isometry3d(Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitZ()));

std::vector<Scan> in_session(std::vector<Scan> scans, const Eigen::Isometry3d& T_session_map = session) {
  for (Scan& scan : scans) scan.T_map_sensor = T_session_map * scan.T_map_sensor;
  return scans;
}

bool is_at(const Eigen::Isometry3d& found, const Eigen::Isometry3d& truth) {
  const Twist off = alignment::twist_between(truth, found);
  return off.tail<3>().norm() < 0.1 && off.head<3>().norm() < 2 * degree;
}

const std::vector<Furnished> flat{{{0, 0}, {5, 4.2}, 1}, {{6, 0}, {4.4, 5}, 2}, {{0, 6}, {6, 4}, 3}};

class Find : public testing::TestWithParam<Eye> {};

TEST_P(Find, ARunAnywhereInAMap) {
  auto rng = test::rng();
  const Map map = mapped(flat, rng);
  const Scene scene = scene_of(flat);
  Localizer localizer(map);
  int found = 0;
  constexpr int starts = 9;
  for (std::size_t i = 0; i < starts; ++i) {
    const std::vector<Scan> scans =
        run_from(scene, anywhere_in(flat[i % 3], rng), GetParam(), GetParam() == Eye::lidar ? 3 : 10, rng);
    const Whereabouts there = localizer.find(in_session(scans));
    if (there.finding != Finding::found) continue;
    ++found;
    EXPECT_TRUE(is_at(there.places.at(0).T_map_sensor, scans.back().T_map_sensor)) << i;
    EXPECT_TRUE(is_at(there.T_map_scans * session, Eigen::Isometry3d::Identity())) << i;
  }
  EXPECT_GE(found, starts - 1);
}

TEST_P(Find, RefusesARunOfARoomThatTheMapDoesNotHave) {
  auto rng = test::rng();
  const Map map = mapped(flat, rng);
  Localizer localizer(map);
  const std::vector<Furnished> elsewhere{{{0, 0}, {5, 4.2}, 11}, {{6, 0}, {4.7, 4.7}, 12}};
  const Scene scene = scene_of(elsewhere);
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Isometry3d start = anywhere_in(elsewhere[i % 2], rng);
    const Whereabouts there = localizer.find(in_session(run_from(scene, start, GetParam(), 10, rng)));
    EXPECT_NE(there.finding, Finding::found) << i;
  }
}

TEST_P(Find, NamesBothOfTwoEqualRooms) {
  auto rng = test::rng();
  std::vector<Furnished> equal = flat;
  equal.push_back({{9, 7}, {5, 4.2}, 1});  // as the first
  const Map map = mapped(equal, rng);
  const Scene scene = scene_of(equal);
  Localizer localizer(map);
  const Eigen::Isometry3d there(Eigen::Translation3d(9, 7, 0));
  for (int i = 0; i < 4; ++i) {
    const std::vector<Scan> scans = run_from(scene, anywhere_in(equal[0], rng), GetParam(), 10, rng);
    const Whereabouts found = localizer.find(in_session(scans));
    ASSERT_EQ(found.finding, Finding::several_places) << i;
    EXPECT_LT(found.margin, 0.1);
    const Eigen::Isometry3d& truth = scans.back().T_map_sensor;
    for (const Eigen::Isometry3d& place : {truth, Eigen::Isometry3d(there * truth)})
      EXPECT_TRUE(std::ranges::any_of(found.places,
                                      [&](const Alignment& a) { return is_at(a.T_map_sensor, place); }));
    const Eigen::AlignedBox3d first(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5, 4.2, 2.4));
    EXPECT_EQ(localizer.find(in_session(scans), first).finding, Finding::found) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Sensors, Find, testing::Values(Eye::lidar, Eye::camera));

TEST(FindPlace, OneImageOfACameraDoesNotDecide) {
  auto rng = test::rng();
  const Map map = mapped(flat, rng);
  Localizer localizer(map);
  for (std::size_t i = 0; i < 9; ++i) {
    const Whereabouts there = localizer.find(
        in_session(run_from(scene_of(flat), anywhere_in(flat[i % 3], rng), Eye::camera, 1, rng)));
    EXPECT_NE(there.finding, Finding::found);
  }
}

TEST(FindPlace, NeedsNoVerticalIfAPlaneIsLevel) {
  auto rng = test::rng();
  const Map map = mapped(flat, rng);
  Localizer localizer(map);
  const Eigen::Isometry3d tilted =
      session * Eigen::Isometry3d(Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.6, -0.8, 0)));
  const std::vector<Scan> scans = run_from(scene_of(flat), anywhere_in(flat[1], rng), Eye::lidar, 2, rng);
  EXPECT_NE(localizer.find(in_session(scans, tilted)).finding, Finding::found);
  const Whereabouts there = localizer.find(in_session(scans, tilted), {}, false);
  ASSERT_EQ(there.finding, Finding::found);
  EXPECT_TRUE(is_at(there.places.at(0).T_map_sensor, scans.back().T_map_sensor));
}

TEST(FindPlace, SaysNothingOfNothing) {
  auto rng = test::rng();
  Localizer empty{Map(of_voxels(0.05))};
  const std::vector<Scan> scans = run_from(scene_of(flat), anywhere_in(flat[0], rng), Eye::lidar, 1, rng);
  EXPECT_EQ(empty.find(scans).finding, Finding::not_here);
  EXPECT_THROW(empty.find({}), Error);
  EXPECT_EQ(Localizer(mapped({flat[0]}, rng)).find(std::vector<Scan>(2)).finding, Finding::undecided);
  // A cluttered kitchen: its cells looked like the run, but too little of it was planes to fit.
  EXPECT_EQ(alignment::judge({{}, true, 4}, {}).finding, Finding::undecided);
  EXPECT_EQ(alignment::judge({{}, true, 0}, {}).finding, Finding::not_here);
}

/// All ways to a pose are given runs at right and at wrong poses, here and in another room of the same size.
/// What a way accepts must be right, and a right pose must be accepted. They do not agree yet: the counts may
/// only fall.
TEST(OneAlign, AWayAcceptsRightPosesAndNoWrongOne) {
  auto rng = test::rng();
  const Scene scene = scene_of(flat), elsewhere = scene_of({{{0, 0}, {5, 4.2}, 11}});
  std::vector<Scan> seen;
  for (const Furnished& room : flat)
    for (int i = 0; i < 6; ++i)
      seen.push_back(run_from(scene, anywhere_in(room, rng), Eye::lidar, 1, rng).front());
  Mapper mapper(of_voxels(0.05));
  for (const Scan& scan : seen) mapper.insert(scan);
  mapper.share_octree();
  Localizer localizer(mapper.snapshot());
  using Run = std::vector<Scan>;
  using Accepted = std::optional<Eigen::Isometry3d>;  // pose of the last scan
  const auto accepted = [](const Alignment& found, const Eigen::Isometry3d& pose) {
    const bool fits =
        found.outcome == AlignmentOutcome::agrees || found.outcome == AlignmentOutcome::corrected;
    return fits ? Accepted(pose) : std::nullopt;
  };
  const auto by_map = [&](const Run& run) {
    const Alignment found =
        alignment::ScanAligner()(surfaces::state_of(mapper.map()), run.back(), {0.1, 30}).alignment;
    return accepted(found, found.T_map_sensor);
  };
  const auto by_localize = [&](const Run& run) {
    const Alignment found = localizer(run.back());
    return accepted(found, found.T_map_sensor);
  };
  const auto by_find = [&](const Run& run) -> Accepted {
    const Eigen::AlignedBox3d about(run.back().T_map_sensor.translation());
    const Whereabouts there = localizer.find(run, {about.min().array() - 0.3, about.max().array() + 0.3});
    return there.finding == Finding::found ? Accepted(there.places.at(0).T_map_sensor) : std::nullopt;
  };
  const auto by_merge = [&](const Run& run) {
    Mapper other(of_voxels(0.05));
    for (const Scan& scan : run) other.insert(scan);
    const MapAlignment found = align_maps(mapper.snapshot(), other.map());
    return accepted(found.scan, found.T_map_other * run.back().T_map_sensor);
  };
  const auto by_check = [&](const Run& run) {
    RecordingJudge judge(of_voxels(0.05));
    for (const Run& scans : {seen, run})
      for (const Scan& scan : scans) judge.add(scan, scan.T_map_sensor);
    return judge.judge().contradicts() ? std::nullopt : Accepted(run.back().T_map_sensor);
  };
  const auto turned = [](double angle) {
    const Eigen::Translation3d middle(2.5, 2.1, 0);
    return middle * Eigen::AngleAxisd(angle * degree, Eigen::Vector3d::UnitZ()) * middle.inverse();
  };
  const auto shifted = [](double x, double y, double z) {
    return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
  };
  const std::vector<Eigen::Isometry3d> right{shifted(0, 0, 0), shifted(0.03, 0.03, 0.02)},
      wrong{shifted(0, 0, -0.5), shifted(0.5, 0, 0), turned(90), turned(180)};
  struct Way {
    std::string name;
    std::function<Accepted(const Run&)> align;
    int most_accepted;  ///< wrong ones of 20
    int most_refused;   ///< right ones of 4
  };
  for (const Way& way :
       {Way{"map", by_map, 15, 0}, Way{"localize", by_localize, 9, 0}, Way{"find", by_find, 0, 0},
        Way{"merge", by_merge, 9, 0}, Way{"check", by_check, 15, 2}}) {
    int accepted_wrong = 0, refused_right = 0;
    for (const Eye eye : {Eye::lidar, Eye::camera})
      for (const bool here : {true, false}) {
        const Run run = run_from(here ? scene : elsewhere, anywhere_in(flat[0], rng), eye, 10, rng);
        const auto align_at = [&](const Eigen::Isometry3d& error, bool is_right) {
          const Accepted pose = way.align(in_session(run, error));
          refused_right += is_right && !pose;
          accepted_wrong += pose && !(here && is_at(*pose, run.back().T_map_sensor));
        };
        for (const Eigen::Isometry3d& error : right) align_at(error, here);
        for (const Eigen::Isometry3d& error : wrong) align_at(error, false);
      }
    EXPECT_LE(accepted_wrong, way.most_accepted) << way.name;
    EXPECT_LE(refused_right, way.most_refused) << way.name;
    std::cout << way.name << " accepts " << accepted_wrong << " wrong, refuses " << refused_right << "\n";
  }
}

/// Against the definition, voxel by voxel.
TEST(CellPyramid, KnowsForEachWindowWhetherItMayHaveMatter) {
  auto rng = test::rng();
  const Map map = mapped({flat[0]}, rng);
  const alignment::CellPyramid cells(map.octree(), 0.12);
  EXPECT_DOUBLE_EQ(cells.edge(), 0.2);
  std::set<std::array<int, 3>> matter;  // cells beside or around a voxel's half cell
  map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    const Eigen::Array3d half = ((voxel.center - cells.low()).array() / 0.1).floor();
    for (const double x : {-1, 1})
      for (const double y : {-1, 1})
        for (const double z : {-1, 1}) {
          const Eigen::Array3i at = ((half + Eigen::Array3d(x, y, z)) / 2).floor().cast<int>();
          matter.insert({at.x(), at.y(), at.z()});
        }
  });
  std::size_t some = 0, none = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto any = [&](int size) { return std::uniform_int_distribution<int>(-20, size + 3)(rng); };
    const int x = any(cells.size().x()), y = any(cells.size().y()), z = any(cells.size().z()), level = i % 6;
    const bool has = std::ranges::any_of(matter, [&](const auto& at) {
      const auto inside = [&](int from, int cell) { return cell >= from && cell < from + (1 << level); };
      return inside(x, at[0]) && inside(y, at[1]) && inside(z, at[2]);
    });
    ++(has ? some : none);
    if (has || (x >= 0 && y >= 0 && z >= 0)) {
      ASSERT_EQ(cells.any(x, y, z, level), has) << x << " " << y << " " << z;
    }
  }
  EXPECT_GT(some, 100);
  EXPECT_GT(none, 100);
}

}  // namespace
}  // namespace octosurf::test
