// One face, one surface: small steps, thin things and holes, seen by a depth camera from several sides.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/polygons.hpp"
#include "support/scene.hpp"

namespace octosurf::mapper {
namespace {

using test::CheckedMapper;
using test::Scene;

const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);

bool over(const Surface& surface, const Eigen::Vector3d& p) {
  return test::Region(surface.polygons).covers((surface.T_map_surface.inverse() * p).head<2>());
}

/// What a room looks like after cameras at `eyes` have looked at `targets`, 2 mm of noise.
struct Seen {
  Seen(const Scene& scene, double resolution, const std::vector<Eigen::Vector3d>& eyes,
       const std::vector<Eigen::Vector3d>& targets, std::uint64_t seed = test::seed())
      : mapper(test::of_voxels(resolution)) {
    std::mt19937_64 rng(seed);
    const test::Camera camera{320, 240, 272, 0.002};
    for (std::size_t i = 0; i < eyes.size(); ++i)
      mapper.insert(
          test::camera_scan(scene, test::look_at(eyes[i], targets[i % targets.size()]), rng, camera));
    test::expect_guarantees(mapper.mapper.map());
  }
  /// Surfaces of this face: over `point`, at most 8 mm and 3° off.
  std::vector<SurfacePtr> at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    std::vector<SurfacePtr> found;
    for (const SurfacePtr& s : mapper.surfaces())
      if (std::fabs(s->plane.signed_distance(point)) < 0.008 && s->plane.normal.dot(normal) > 0.99863 &&
          over(*s, point))
        found.push_back(s);
    return found;
  }
  /// The one surface of a face; fails unless there is exactly one.
  SurfacePtr face(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    const auto found = at(point, normal);
    EXPECT_EQ(found.size(), 1U) << "at " << point.transpose() << ", normal " << normal.transpose();
    return found.size() == 1 ? found.front() : nullptr;
  }

  CheckedMapper mapper;
};

std::vector<Eigen::Vector3d> circle(const Eigen::Vector3d& centre, double radius, int count) {
  std::vector<Eigen::Vector3d> eyes;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count + 0.3;
    eyes.emplace_back(centre + radius * Eigen::Vector3d(std::cos(a), std::sin(a), 0));
  }
  return eyes;
}

class Faces : public ::testing::TestWithParam<double> {};

std::string name_of(const ::testing::TestParamInfo<double>& info) {
  return std::to_string(std::lround(info.param * 1000)) + "mm";
}
INSTANTIATE_TEST_SUITE_P(Voxels, Faces, ::testing::Values(0.02, 0.01), name_of);

TEST_P(Faces, LowThingsStayOutOfTheFloor) {
  Scene scene;
  scene.rectangle({-1.2, -1.2, 0.011}, 2.4 * x, 2.4 * y);
  scene.box({-0.5, -0.15, 0.011}, {0.5, 0.15, 0.051});   // a board of 4 cm
  scene.box({-0.15, 0.45, 0.011}, {0.15, 0.65, 0.071});  // a box of 6 cm
  const Seen seen(scene, GetParam(), circle({0, 0.1, 1.3}, 0.9, 10), {{0, 0.1, 0}, {0.3, -0.2, 0}});
  const auto board = seen.face({0, 0, 0.051}, z), box = seen.face({0, 0.55, 0.071}, z),
             floor = seen.face({0.6, -0.6, 0.011}, z);
  ASSERT_TRUE(board && box && floor);
  EXPECT_NE(board->id, floor->id);
  EXPECT_NE(box->id, floor->id);
  EXPECT_NE(box->id, board->id);
  EXPECT_NEAR(board->area_m2, 0.3, 0.045);
  EXPECT_NEAR(box->area_m2, 0.06, 0.015);
  for (const Eigen::Vector3d& p :
       std::vector<Eigen::Vector3d>{{0, 0, 0.011}, {0.4, 0, 0.011}, {-0.4, 0, 0.011}, {0, 0.55, 0.011}})
    EXPECT_FALSE(over(*floor, p)) << "the floor under " << p.transpose();
  EXPECT_EQ(seen.face({-0.6, 0.6, 0.011}, z), floor) << "the floor is one";
}

/// A tread of an open stair, 4 cm thick, wherever its sides lie between layers of voxels: of 2 cm, there are
/// two such layers, or three with one of readings of either side.
TEST_P(Faces, AThinBoardSeenFromAboveAndBelowHasTwoSides) {
  constexpr double thickness = 0.04;
  bool from_below_first = true;
  for (const double lean : {0.0, 10 * test::degree}) {
    from_below_first = !from_below_first;  // each height in the other order than level
    for (const double height : {0.701, 0.705, 0.71, 0.715}) {
      from_below_first = !from_below_first;
      SCOPED_TRACE(std::to_string(lean) + " rad, at " + std::to_string(height) +
                   (from_below_first ? ", from below first" : ""));
      const Eigen::Vector3d along(std::cos(lean), 0, std::sin(lean)),
          up = along.cross(y), middle(0, 0, height), corner = middle - 0.5 * along - 0.15 * y,
          down = -thickness * up;
      Scene scene;
      scene.rectangle(corner, along, 0.3 * y).rectangle(corner + down, along, 0.3 * y);
      scene.rectangle(corner, along, down).rectangle(corner + 0.3 * y, along, down);
      scene.rectangle(corner, 0.3 * y, down).rectangle(corner + along, 0.3 * y, down);
      std::vector<Eigen::Vector3d> eyes = circle(middle + 0.7 * z, 0.9, 6);
      const std::vector<Eigen::Vector3d> below = circle(middle - 0.7 * z, 0.9, 6);
      eyes.insert(from_below_first ? eyes.begin() : eyes.end(), below.begin(), below.end());
      const Seen seen(scene, GetParam(), eyes, {middle});
      const auto top = seen.face(middle, up), underside = seen.face(middle + down, -up);
      if (!top || !underside) continue;
      EXPECT_NEAR(top->area_m2, 0.3, 0.045);
      EXPECT_NEAR(underside->area_m2, 0.3, 0.045);
      EXPECT_NEAR(top->plane.signed_distance(middle + down), -thickness, 0.003);
      EXPECT_EQ(std::ranges::count_if(
                    seen.mapper.surfaces(),
                    [&](const SurfacePtr& f) { return std::fabs(f->plane.normal.dot(up)) > 0.9; }),
                2)
          << "none between";
    }
  }
}

/// Three degrees are near the least that is told apart: in 3 of 33 such pairs of tops the two became one.
TEST(CoarserFaces, TopsThatLeanThreeDegreesAreTwoAsARule) {
  const double lean = 3 * test::degree, c = std::cos(lean), s = std::sin(lean);
  struct Top {
    const char* how;
    Eigen::Vector3d along, across;
  };
  int pairs = 0, apart = 0;
  for (const Top& top : {Top{"rising", {c, 0, s}, y}, {"falling", {c, 0, -s}, y}, {"twisted", x, {0, c, s}}})
    for (const std::uint64_t seed : test::seeds(2)) {
      SCOPED_TRACE(top.how + (", seed " + std::to_string(seed)));
      Scene scene;  // two boxes, 3 cm apart
      scene.rectangle({-1, -1, 0.011}, 2.4 * x, 2 * y);
      scene.box({-0.4, -0.2, 0.011}, {0, 0.2, 0.311});
      const Eigen::Vector3d corner = Eigen::Vector3d(0.03, 0, 0.311) - 0.2 * top.across, down(0, 0, -0.25);
      const Eigen::Vector3d length = 0.4 * top.along, width = 0.4 * top.across;
      scene.rectangle(corner, length, width).rectangle(corner, length, down).rectangle(corner, width, down);
      scene.rectangle(corner + width, length, down).rectangle(corner + length, width, down);
      const Seen seen(scene, 0.02, circle({0, 0, 1.4}, 0.8, 10), {{0, 0, 0.3}}, seed);
      const auto level = seen.face({-0.2, 0, 0.311}, z),
                 leaning = seen.face(corner + length / 2 + width / 2, top.along.cross(top.across));
      ASSERT_TRUE(level && leaning);
      ++pairs;
      if (level->id == leaning->id) continue;
      ++apart;
      // Six standard deviations of what both say of themselves, and 0.2° for readings of the other top in the
      // voxels of the gap, of which they do not know.
      const double bound_rad =
          0.2 * test::degree + 6 * std::hypot(level->normal_std_rad(), leaning->normal_std_rad());
      EXPECT_NEAR(std::acos(level->plane.normal.dot(leaning->plane.normal)), lean, bound_rad);
      EXPECT_NEAR(level->area_m2, 0.16, 0.02);
      EXPECT_NEAR(leaning->area_m2, 0.16, 0.02);
      EXPECT_EQ(std::ranges::count_if(
                    seen.mapper.surfaces(),
                    [](const SurfacePtr& f) { return f->plane.normal.z() > 0.95 && f->plane.offset > 0.2; }),
                2);
    }
  EXPECT_GE(apart,
            pairs / 2);  // of 6; fewer by chance in one of 1,000 worlds if one pair in ten becomes one
}

TEST_P(Faces, RisersAndTreadsAreOneEach) {
  constexpr int steps = 4;
  constexpr double rise = 0.17, going = 0.29;
  Scene scene;
  scene.rectangle({-1.2, -0.5, 0.011}, 1.2 * x, y);
  for (int k = 0; k < steps; ++k)
    scene.rectangle({k * going, -0.5, 0.011 + k * rise}, rise * z, y)
        .rectangle({k * going, -0.5, 0.011 + (k + 1) * rise}, going * x, y);
  std::vector<Eigen::Vector3d> eyes;
  for (int i = 0; i < 10; ++i) eyes.emplace_back(-1 + 0.12 * i, -0.3 + 0.15 * (i % 5), 1.3 + 0.06 * i);
  const Seen seen(scene, GetParam(), eyes, {{0.3, 0, 0.3}, {0.8, 0, 0.5}});
  std::set<SurfaceId> ids;
  for (int k = 0; k < steps; ++k) {
    SCOPED_TRACE("step " + std::to_string(k + 1));
    const auto riser = seen.face({k * going, 0, 0.011 + (k + 0.5) * rise}, -x);
    const auto tread = seen.face({(k + 0.5) * going, 0, 0.011 + (k + 1) * rise}, z);
    if (!riser || !tread) continue;
    ids.insert({riser->id, tread->id});
    EXPECT_NEAR(riser->area_m2, rise, 0.2 * rise);
    EXPECT_NEAR(tread->area_m2, going, 0.15 * going);
  }
  EXPECT_EQ(ids.size(), 2U * steps);
  EXPECT_EQ(seen.mapper.surfaces().size(), 2U * steps + 1) << "and the floor";
}

TEST_P(Faces, ABeamOfTenCentimetres) {
  Scene scene;
  scene.rectangle({-1, -1, 0.011}, 2 * x, 2 * y);
  scene.box({-0.6, -0.05, 0.011}, {0.6, 0.05, 0.111});
  const Seen seen(scene, GetParam(), circle({0, 0, 1}, 0.9, 10), {{-0.25, 0, 0.1}, {0.25, 0, 0.1}});
  const auto top = seen.face({0, 0, 0.111}, z), left = seen.face({0, 0.05, 0.061}, y),
             right = seen.face({0, -0.05, 0.061}, -y), floor = seen.face({0, 0.5, 0.011}, z);
  ASSERT_TRUE(top && left && right && floor);
  EXPECT_NEAR(top->area_m2, 0.12, 0.03);
  EXPECT_EQ((std::set<SurfaceId>{top->id, left->id, right->id, floor->id}.size()), 4U);
  EXPECT_FALSE(over(*floor, {0, 0, 0.011}));
  EXPECT_EQ(seen.face({0, -0.5, 0.011}, z), floor);
}

/// Height of a stair at x: treads of 30 cm, risers of 16 cm, foot and nosing rounded.
double rounded_stair(double at, double radius) {
  constexpr double riser = 0.16, tread = 0.3;
  const double step = std::round(at / tread), off = at - step * tread;  // from the nearest edge
  const double rounded = std::fabs(off) < radius
                             ? radius - std::sqrt(radius * radius - std::pow(radius - std::fabs(off), 2))
                             : 0;
  return off < 0 ? (step - 1) * riser + rounded : step * riser - rounded;
}

TEST(RoundedFaces, TreadsBesideRoundedFeetKeepTheirSlope) {
  // The corners of a mesh's triangles, as clouds composed of many scans come: 2 cm apart, 2 mm of noise.
  for (const double radius : {0.01, 0.02, 0.04}) {
    SCOPED_TRACE(std::to_string(radius) + " m");
    std::mt19937_64 rng = test::rng();
    std::normal_distribution<double> noise(0, 0.002);
    constexpr int across = 50, along = 106;  // from the middle of a landing to that of another
    std::vector<Eigen::Vector3d> corners;
    for (int u = 0; u < along; ++u)
      for (int v = 0; v < across; ++v) {
        const double at = 0.02 * u - 0.303;
        corners.emplace_back(at, 0.02 * v, rounded_stair(at, radius) + noise(rng));
      }
    Scan scan;
    scan.T_map_sensor.translation() << -1.5, 0.5, 2.5;
    for (int u = 0; u + 1 < along; ++u)
      for (int v = 0; v + 1 < across; ++v)
        for (const auto& [du, dv] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 0}, {1, 1}, {0, 1}}) {
          const auto corner = static_cast<std::size_t>((u + du) * across + v + dv);
          scan.points.push_back((corners[corner] - scan.T_map_sensor.translation()).cast<float>());
        }
    CheckedMapper mapper(test::of_voxels(0.02));
    mapper.insert(scan);
    for (int tread = 0; tread < 5; ++tread) {
      const Eigen::Vector3d middle(0.3 * tread + 0.15, 0.5, 0.16 * tread);
      const auto found = mapper.on_plane(z, middle);
      ASSERT_EQ(found.size(), 1U) << "tread " << tread;
      EXPECT_GT(found.front()->plane.normal.z(), std::cos(1.5 * std::numbers::pi / 180)) << "tread " << tread;
      EXPECT_NEAR(found.front()->plane.signed_distance(middle), 0, 0.0025) << "tread " << tread;
    }
  }
}

// Voxels of 1 cm, and planes found on cells of 2 cm: what is about as small as these.

TEST(FinerFaces, AStepAsThickAsABook) {
  for (const double thickness : {0.025, 0.02})
    for (const double height : {0.011, 0.018}) {  // beside layers of cells, and across them
      SCOPED_TRACE(std::to_string(thickness) + " m, from " + std::to_string(height));
      Scene scene;
      scene.rectangle({-0.8, -0.8, height}, 1.6 * x, 1.6 * y);
      scene.box({-0.3, -0.2, height}, {0.3, 0.2, height + thickness});
      const Seen seen(scene, 0.01, circle({0, 0, 1}, 0.6, 10), {{0, 0, 0}});
      const auto book = seen.face({0, 0, height + thickness}, z), floor = seen.face({0.5, 0, height}, z);
      ASSERT_TRUE(book && floor);
      EXPECT_NE(book->id, floor->id);
      EXPECT_NEAR(book->plane.signed_distance({0, 0, height + thickness}), 0, 0.0015);
      EXPECT_NEAR(floor->plane.signed_distance({0.5, 0, height}), 0, 0.0015);
      EXPECT_NEAR(book->area_m2, 0.24, 0.03);
      EXPECT_FALSE(over(*floor, {0, 0, height}));
      EXPECT_EQ(seen.face({-0.5, 0, height}, z), floor);
    }
}

TEST(FinerFaces, APlateThinnerThanACellHasTwoSides) {
  constexpr double thickness = 0.015;
  for (const double height : {0.701, 0.708, 0.716}) {
    SCOPED_TRACE("at " + std::to_string(height));
    const Eigen::Vector3d middle(0, 0, height), corner = middle - 0.4 * x - 0.2 * y, down = -thickness * z;
    Scene scene;
    scene.rectangle(corner, 0.8 * x, 0.4 * y).rectangle(corner + down, 0.8 * x, 0.4 * y);
    std::vector<Eigen::Vector3d> eyes = circle(middle + 0.7 * z, 0.7, 6);
    for (const Eigen::Vector3d& eye : circle(middle - 0.7 * z, 0.7, 6)) eyes.push_back(eye);
    const Seen seen(scene, 0.01, eyes, {middle});
    const auto top = seen.face(middle, z), underside = seen.face(middle + down, -z);
    if (!top || !underside) continue;
    EXPECT_NEAR(top->area_m2, 0.32, 0.04);
    EXPECT_NEAR(underside->area_m2, 0.32, 0.04);
  }
}

TEST(FinerFaces, ARailOfThreeCentimetres) {
  Scene scene;
  scene.rectangle({-1, -1, 0.011}, 2 * x, 2 * y);
  scene.box({-0.4, -0.017, 0.011}, {0.4, 0.017, 0.211});
  const Seen seen(scene, 0.01, circle({0, 0, 1}, 0.7, 10), {{0, 0, 0.2}});
  const auto top = seen.face({0, 0, 0.211}, z), side = seen.face({0, 0.017, 0.111}, y);
  ASSERT_TRUE(top && side);
  EXPECT_NE(top->id, side->id);
  EXPECT_NEAR(top->area_m2, 0.8 * 0.034, 0.012);
}

}  // namespace
}  // namespace octosurf::mapper
