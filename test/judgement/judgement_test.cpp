// Recordings that are right, and others made wrong of them: what the judge says.
#include "alignment/surfaces_by_hand.hpp"
#include "judgement/walks.hpp"

#include <octosurf/judgement.hpp>

namespace octosurf::test {
namespace {

/// By a laser that nods: 40 lines of 200 readings from each place, each with its pose.
Scans nodding_walk(std::mt19937_64& rng) {
  Scans scans;
  for (int i = 0; i < scans_of_walk; i += 2)
    for (int k = 0; k < 80; ++k)
      scans.push_back(
          line(place(i) * Eigen::AngleAxisd(0.2 * i, Eigen::Vector3d::UnitZ()), 0.035 * (k - 40), rng));
  return numbered(scans);
}

Judgement judged(const Scans& scans) {
  Parameters parameters;
  parameters.occupancy.resolution = scans.front().sensor == SensorKind::lidar ? 0.05 : 0.02;
  RecordingJudge judge(parameters);
  for (const Scan& scan : scans) judge.add(scan, scan.T_map_sensor);
  return judge.judge();
}

struct Fault {
  const char* name;
  Change make;
};

const Fault faults[] = {
    {"inverse", each([](Scan& scan) { scan.T_map_sensor = scan.T_map_sensor.inverse(); })},
    {"mirrored", scaled({1, -1, 1})},
    {"too short", scaled(Eigen::Vector3f::Constant(0.8F))},
    {"too long", scaled(Eigen::Vector3f::Constant(1.25F))},
    {"shuffled", [](Scans& scans) {
       for (std::size_t i = 0; i < scans.size() / 2; ++i)  // with one far away, as 7 and 48 have no factor
         std::swap(scans[i].T_map_sensor, scans[7 * i % scans.size()].T_map_sensor);
     }},
    {"mount turned", mounted(Eigen::Isometry3d(Eigen::AngleAxisd(5 * degree, Eigen::Vector3d::UnitX())))},
    {"mount shifted", mounted(Eigen::Isometry3d(Eigen::Translation3d(0.2, 0, 0)))},
    {"poses scaled", each([](Scan& scan) { scan.T_map_sensor.translation() *= 0.37; })},
    {"poses in mm", each([](Scan& scan) { scan.T_map_sensor.translation() *= 1000; })},
    {"no poses", each([](Scan& scan) { scan.T_map_sensor.setIdentity(); })},
    {"frozen", [](Scans& scans) {
       for (std::size_t i = 20; i < 28; ++i) scans[i].points = scans[20].points;
     }},
    {"late", late(3)},
    {"jump", [](Scans& scans) {
       for (std::size_t i = 24; i < scans.size(); ++i)
         scans[i].T_map_sensor.pretranslate(Eigen::Vector3d(0.24, 0.18, 0));
     }}};

/// expect(judgement, name) for each change of a walk of each sensor.
template <class Expect>
void judge_each(std::span<const Fault> changes, const Expect& expect) {
  for (const auto& walk : {camera_walk, lidar_walk}) {
    auto random = rng();
    const Scans as_it_is = walk(random);
    for (const auto& [name, change] : changes) {
      Scans scans = as_it_is;
      change(scans);
      expect(judged(scans), name);
    }
  }
}

TEST(RecordingJudge, IsSilentOnRightRecordings) {
  const Fault right[] = {
      {"as it is", [](Scans&) {}},
      {"every second scan",
       [](Scans& scans) {
         for (std::size_t i = 0; 2 * i < scans.size(); ++i) scans[i] = scans[2 * i];
         scans.resize(scans.size() / 2);
       }},
      {"noise", each([rng = rng()](Scan& scan) mutable {
         std::normal_distribution<float> noise(1, 0.005F);
         for (Eigen::Vector3f& point : scan.points) point *= noise(rng);
       })},
      {"jitter", each([rng = rng()](Scan& scan) mutable {
         scan.T_map_sensor.translate(0.006 * any_direction(rng));
         scan.T_map_sensor.rotate(Eigen::AngleAxisd(0.2 * degree, any_direction(rng)));
       })},
      {"somebody walks before the sensor", each([](Scan& scan) {
         for (Eigen::Vector3f& point : scan.points)
           if (point.norm() > 1.2F && std::fabs(std::atan2(point.y(), point.x())) < 0.2F)
             point *= 1.2F / point.norm();
       })},
      {"an image is sent twice", [](Scans& scans) { scans[11].points = scans[10].points; }},
      {"it stands still", [](Scans& scans) {
         for (int k = 0; k < 10; ++k) scans.insert(scans.begin() + 12, scans[12]);
       }}};
  judge_each(right, [](const Judgement& judgement, const auto& name) {
    EXPECT_GT(judgement.pairs, 50U) << name;
    EXPECT_EQ(judgement.describe(), "") << name;
  });
}

TEST(RecordingJudge, NoticesFaultsOfEveryKind) {
  judge_each(faults, [](const Judgement& judgement, const auto& name) {
    EXPECT_TRUE(judgement.contradicts()) << name;
    EXPECT_NE(judgement.describe(), "") << name;
  });
}

/// Three quarters of a room face other ways, and agree. (Of z, which moves by 0.2 m, no fifth is missed.)
TEST(RecordingJudge, NoticesWhatIsWrongAlongOneAxis) {
  using Position = double (*)(const Scans&, std::size_t i, int axis);
  const std::pair<const char*, Position> errors[] = {
      {"reversed", [](const Scans& s, std::size_t i, int k) { return -s[i].T_map_sensor.translation()[k]; }},
      {"lost", [](const Scans&, std::size_t, int) { return 0.0; }},
      {"late", [](const Scans& s, std::size_t i,
                  int k) { return s[i - std::min<std::size_t>(i, 6)].T_map_sensor.translation()[k]; }},
      {"times 1.2", [](const Scans& s, std::size_t i,
                       int k) { return (k == 2 ? 1.6 : 1.2) * s[i].T_map_sensor.translation()[k]; }},
      {"sinks", [](const Scans& s, std::size_t i, int k) {
         return s[i].T_map_sensor.translation()[k] - static_cast<double>(i) / scans_of_walk;
       }}};
  std::vector<std::string> missed;
  for (const auto& walk : {camera_walk, lidar_walk}) {
    auto random = rng();
    const Scans right = walk(random);
    for (int axis = 0; axis < 3; ++axis)
      for (const auto& [name, position] : errors) {
        Scans wrong = right;
        for (std::size_t i = 0; i < wrong.size(); ++i)
          wrong[i].T_map_sensor.translation()[axis] = position(right, i, axis);
        if (!judged(wrong).contradicts()) missed.push_back("xyz"[axis] + std::string(" ") + name);
      }
  }
  EXPECT_THAT(missed, ::testing::IsEmpty());
}

/// Few readings are no reason to be alone.
TEST(RecordingJudge, ComparesSparseViews) {
  auto random = rng();
  const Scans dense = lidar_walk(random);
  for (const std::size_t every : {5, 20, 40}) {
    Scans sparse = dense;
    for (Scan& scan : sparse) {
      std::ranges::shuffle(scan.points, random);
      scan.points.resize(scan.points.size() / every);
    }
    const Judgement right = judged(sparse);
    EXPECT_EQ(right.alone, 0U) << every;
    EXPECT_EQ(right.describe(), "") << every;
    mounted(Eigen::Translation3d(0.3, 0, 0) *
            Eigen::AngleAxisd(10 * degree, Eigen::Vector3d::UnitX()))(sparse);
    EXPECT_TRUE(judged(sparse).contradicts()) << every;
  }
  Scans hardly = dense;
  for (Scan& scan : hardly) {
    std::ranges::shuffle(scan.points, random);
    scan.points.resize(10);
  }
  EXPECT_GT(judged(hardly).sparse, 0U);
}

TEST(RecordingJudge, JoinsTheLinesOfALaserThatNods) {
  auto random = rng();
  Scans scans = nodding_walk(random);
  const Judgement right = judged(scans);
  EXPECT_GT(right.pairs, 50U);
  EXPECT_EQ(right.describe(), "");
  for (Scan& scan : scans)  // of the whole sensor, which nods about x
    scan.T_map_sensor = scan.T_map_sensor * Eigen::Translation3d(0.2, 0, 0);
  EXPECT_TRUE(judged(scans).contradicts());
}

/// Of hundreds of scans as many views are compared as of a hundred, and from all over the run.
TEST(RecordingJudge, KeepsViewsOfTheWholeRun) {
  auto random = rng();
  const Scans once = camera_walk(random);
  Scans scans;
  for (int lap = 0; lap < 12; ++lap) scans.insert(scans.end(), once.begin(), once.end() - 1);
  const Judgement right = judged(numbered(scans));
  EXPECT_EQ(right.views, 36U);
  EXPECT_FALSE(right.contradicts());
  for (std::size_t i = scans.size() / 2; i < scans.size(); ++i)
    scans[i].T_map_sensor.pretranslate(Eigen::Vector3d(0.06, 0.05, 0.04));
  EXPECT_TRUE(judged(numbered(scans)).many_pairs());
}

/// What is outvoted is named, and what stands out by itself.
TEST(RecordingJudge, NamesWhere) {
  auto random = rng();
  const Scans right = camera_walk(random);
  Scans scans = right;
  for (const std::size_t i : {15, 16, 17, 18, 19, 20})
    scans[i].T_map_sensor.translate(Eigen::Vector3d(0, 0, 0.5));
  const Judgement outvoted = judged(scans);
  EXPECT_TRUE(outvoted.many_outvoted());
  EXPECT_THAT(outvoted.outvoted, ::testing::Each(::testing::MatchesRegex("scan (15|16|17|18|19|20)")));
  EXPECT_THAT(outvoted.worst, ::testing::Contains(::testing::MatchesRegex("scan (15|16|17|18|19|20)")));

  const auto oddities_of = [&](const Change& change) {
    scans = right;
    change(scans);
    return ::testing::PrintToString(judged(scans).oddities);
  };
  EXPECT_THAT(oddities_of([](Scans& s) {
                for (std::size_t i = 20; i < 28; ++i) s[i].points = s[20].points;
              }),
              ::testing::HasSubstr("readings are those of the scan before at scan 21"));
  EXPECT_THAT(oddities_of([](Scans& s) {
                for (const std::size_t i : {9, 19, 29, 39}) s[i].T_map_sensor.setIdentity();
              }),
              ::testing::HasSubstr("the pose is the identity again at scan 9"));
  EXPECT_THAT(oddities_of([](Scans& s) {
                for (std::size_t i = 20; i < 28; ++i) s[i].T_map_sensor = s[20].T_map_sensor;
              }),
              ::testing::HasSubstr("the pose is that of the scan before at scan 21"));
  EXPECT_THAT(oddities_of([](Scans& s) {  // turned in the middle of the room
                for (std::size_t i = 24; i < s.size(); ++i)
                  s[i].T_map_sensor = Eigen::Translation3d(middle_of_room) *
                                      Eigen::AngleAxisd(150 * degree, Eigen::Vector3d::UnitZ()) *
                                      Eigen::Translation3d(-middle_of_room) * s[i].T_map_sensor;
              }),
              ::testing::HasSubstr("poses step at scan 24"));
}

/// Two rooms, of which neither is seen from the other: nothing is compared, and nothing is said to agree.
TEST(RecordingJudge, SaysHowManyViewsStandAlone) {
  auto random = rng();
  Scans scans;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Isometry3d T(Eigen::Translation3d(100 * i, 0, 0));
    scans.push_back(moved(camera_walk(random)[0], T));
  }
  const Judgement judgement = judged(numbered(scans));
  EXPECT_EQ(judgement.alone, 3U);
  EXPECT_EQ(judgement.pairs, 0U);
  EXPECT_FALSE(judgement.contradicts());
}

TEST(RecordingJudge, HasNothingToSayOfNothing) {
  const Judgement nothing = RecordingJudge().judge();
  EXPECT_EQ(nothing.views, 0U);
  EXPECT_FALSE(nothing.contradicts());
  Scan empty, unread;
  unread.points.assign(5000, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  RecordingJudge judge;
  for (const Scan& scan : {empty, unread, unread, empty}) judge.add(scan, scan.T_map_sensor);
  EXPECT_EQ(judge.judge().pairs, 0U);
}

}  // namespace
}  // namespace octosurf::test
