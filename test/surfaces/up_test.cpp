#include "geometry/directions.hpp"
#include "support/testing.hpp"

#include <octosurf/up.hpp>

namespace octosurf::surfaces {
namespace {

constexpr double deg = std::numbers::pi / 180;
using Eigen::Vector3d;

double angle(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Planes with areas, which is all that an estimate reads.
struct Planes {
  Snapshot snapshot;
  Planes& add(const Vector3d& normal, double area_m2) {
    Surface surface;
    surface.id = static_cast<SurfaceId>(snapshot.surfaces.size() + 1);
    surface.plane.normal = normal.normalized();
    surface.area_m2 = area_m2;
    snapshot.surfaces.push_back(std::make_shared<const Surface>(std::move(surface)));
    return *this;
  }
  Snapshot turned(const Eigen::Matrix3d& R) const {
    Planes result;
    for (const SurfacePtr& surface : snapshot.surfaces)
      result.add(R * surface->plane.normal, surface->area_m2);
    return result.snapshot;
  }
};

/// Seen from inside; tables stand on the floor, and their undersides are not seen.
Planes room(double length, double width, double height, double tables_m2) {
  Planes planes;
  planes.add({0, 0, 1}, length * width - tables_m2 / 2).add({0, 0, -1}, length * width);
  planes.add({1, 0, 0}, width * height).add({-1, 0, 0}, width * height);
  planes.add({0, 1, 0}, length * height).add({0, -1, 0}, length * height);
  return planes.add({0, 0, 1}, tables_m2);
}

Eigen::Matrix3d any_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  return Eigen::Quaterniond(gauss(random), gauss(random), gauss(random), gauss(random))
      .normalized()
      .toRotationMatrix();
}

TEST(EstimateUp, TurnsWithTheMapWhateverItsSurfacesAre) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> area(0.1, 5), share(0, 1);
  for (int world = 0; world < 300; ++world) {
    Planes planes;
    for (int i = 0; i < 12; ++i) planes.add({gauss(random), gauss(random), gauss(random)}, area(random));
    const Vector3d sensors =
        share(random) * Vector3d(gauss(random), gauss(random), gauss(random)).normalized();
    const Eigen::Matrix3d R = any_rotation(random);
    const Up before = estimate_up(planes.snapshot, sensors),
             after = estimate_up(planes.turned(R), R * sensors);
    EXPECT_LT(angle(R * before.direction, after.direction), 1e-7);
  }
}

TEST(EstimateUp, ACorridorsWallsDoNotCountWhereSensorsWereHeldUpright) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> tilt(-40 * deg, 40 * deg), roll(-10 * deg, 10 * deg);
  const Planes planes = room(20, 1.5, 3, 0.5);
  for (int world = 0; world < 200; ++world) {
    const Eigen::Matrix3d R = any_rotation(random);
    const Eigen::AngleAxisd pitch(tilt(random), Vector3d::UnitY()), about(roll(random), Vector3d::UnitX());
    const Up up = estimate_up(planes.turned(R), R * (0.9 * (pitch * about * Vector3d::UnitZ())));
    EXPECT_LT(angle(up.direction, R.col(2)), 1e-7);
  }
  const Up alone = estimate_up(planes.snapshot);
  EXPECT_GT(angle(alone.direction, Vector3d::UnitZ()), 80 * deg) << "the walls have more area";
}

TEST(EstimateUp, IsZWhereAFewPlanesSaySo) {
  const auto leaning = [](double angle_deg) -> Vector3d {
    return {std::sin(angle_deg * deg), 0, std::cos(angle_deg * deg)};
  };
  struct Case {
    const char* what;
    std::vector<std::pair<Vector3d, double>> planes;  // normals and areas
    Vector3d sensors;
    double within_rad = 1e-7;
  };
  for (const Case& c :
       {Case{"floors that lean are averaged by area",
             {{leaning(2), 3}, {leaning(-1), 6}},
             {0, 0, 0},
             0.01 * deg},
        Case{"a ramp is no floor", {{leaning(0), 6}, {leaning(8), 5}}, {0, 0, 0}},
        Case{"a ceiling alone is above", {{leaning(180), 5}, {leaning(90), 3}}, {0, 0.3, 0.8}},
        Case{"a camera that looks straight down does not deny the floor",
             {{leaning(0), 5}, {leaning(-90), 0.8}},
             {1, 0, 0}},
        Case{"another direction is near", {{leaning(0), 5}, {leaning(90), 4}}, {0, 0, 0}},
        Case{"at right angles to the sensors", {{leaning(0), 5}, {leaning(90), 4}}, {0, 0, 0.5}}}) {
    Planes planes;
    for (const auto& [normal, area_m2] : c.planes) planes.add(normal, area_m2);
    const Up up = estimate_up(planes.snapshot, c.sensors);
    EXPECT_LT(angle(up.direction, Vector3d::UnitZ()), c.within_rad) << c.what;
  }
}

TEST(EstimateUp, NothingToTellIsSaid) {
  EXPECT_EQ(estimate_up({}).source, Up::Source::assumed);
  EXPECT_EQ(estimate_up({}).direction, Vector3d::UnitZ());
  Parameters parameters;
  parameters.up.reset();
  EXPECT_EQ(up_of(Map(parameters)).source, Up::Source::assumed);
  parameters.up = -Vector3d::UnitY();
  EXPECT_EQ(up_of(Map(parameters)).source, Up::Source::given);
  EXPECT_EQ(up_of(Map(parameters)).direction, -Vector3d::UnitY());
}

TEST(Slope, IsTheAngleToUpInEveryFrame) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> any(0, std::numbers::pi), length(0.1, 10);
  for (int i = 0; i < 300; ++i) {
    const double slope = i == 0 ? 0 : i == 1 ? std::numbers::pi : any(random);
    const Eigen::Matrix3d R = any_rotation(random);
    Surface surface;
    surface.plane.normal = R * Vector3d(std::sin(slope), 0, std::cos(slope));
    EXPECT_NEAR(slope_rad(surface, length(random) * R.col(2)), slope, 1e-9);
  }
}

TEST(Upright, BringsUpToZByTheShortestWay) {
  std::mt19937_64 random(test::seed());
  std::vector<Vector3d> ups{{0, 0, 1}, {0, 0, -1}, {1e-9, 0, 1}, {0, 1e-9, -1}};
  for (int i = 0; i < 300; ++i) ups.push_back(any_rotation(random).col(0) * (1 + i));
  for (const Vector3d& up : ups) {
    const Eigen::Quaterniond turn = upright(up);
    EXPECT_LT(angle(turn * up, Vector3d::UnitZ()), 1e-8) << up.transpose();
    EXPECT_NEAR(turn.angularDistance(Eigen::Quaterniond::Identity()), angle(up, Vector3d::UnitZ()), 1e-7);
    EXPECT_NEAR(turn.norm(), 1, 1e-12);
  }
  EXPECT_EQ(upright({0, 0, 3}).w(), 1);
}

TEST(RequireDirection, RefusesWhatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NO_THROW(geometry::require_direction({0, -2, 0}, "up"));
  EXPECT_THROW(geometry::require_direction({0, 0, 0}, "up"), Error);
  EXPECT_THROW(geometry::require_direction({0, nan, 1}, "up"), Error);
  EXPECT_THROW(geometry::require_direction({HUGE_VAL, 0, 1}, "up"), Error);
}

}  // namespace
}  // namespace octosurf::surfaces
