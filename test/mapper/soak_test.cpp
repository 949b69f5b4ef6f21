// Long runs: a place that stays as it is costs no more on its hundredth day than on its second, and one whose
// furniture moves is what it is today.
#include "support/invariants.hpp"
#include "support/room_tour.hpp"
#include "surfaces/map_state.hpp"

#include <malloc.h>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {
namespace {

const Parameters coarse = test::of_voxels(0.05);  // so that thousands of scans take seconds
constexpr test::Camera small{40, 30, 34};

std::size_t heap_bytes() { return ::mallinfo2().uordblks; }

std::vector<Scan> scans_of(const test::Scene& scene, int count, std::mt19937_64& rng,
                           const test::Camera& camera = small) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count;
    const Eigen::Vector3d eye(-0.6 + 0.1 * std::cos(a), 0.1 * std::sin(a), 1.4);
    scans.push_back(camera_scan(
        scene, test::look_at(eye, eye + Eigen::Vector3d(std::cos(a), std::sin(a), -0.6)), rng, camera));
  }
  return scans;
}

/// How long a soak is: OCTOSURF_SOAK times as long as in the suite; 5 gives 10,000 scans and 100 days.
int times_as_long() {
  const char* given = std::getenv("OCTOSURF_SOAK");
  return given != nullptr ? std::stoi(given) : 1;
}

TEST(Soak, APlaceThatStaysCostsNoMoreAndKeepsItsSurfaces) {
  std::mt19937_64 rng = test::rng();
  constexpr int of_a_round = 100;
  const std::vector<Scan> seen = scans_of(test::room_with_a_box(), of_a_round, rng);
  Mapper mapper(coarse);
  const int rounds = 20 * times_as_long();
  struct Round {
    std::size_t heap = 0, octree = 0, appeared = 0, changed = 0;
  };
  std::vector<Round> all;
  std::vector<SurfaceId> ids, ids_before;
  for (int r = 0; r < rounds; ++r) {
    Round round;
    for (const Scan& scan : seen) {
      const ScanReport report = mapper.insert(scan);
      round.appeared += report.appeared;
      round.changed += report.grown.size() + report.shrunk.size();
    }
    round.heap = heap_bytes();
    round.octree = mapper.map().size().bytes;
    ids_before = std::exchange(ids, {});
    for (const SurfacePtr& surface : mapper.snapshot()->surfaces) ids.push_back(surface->id);
    if (r == rounds / 4) all.clear();
    all.push_back(round);
    if (r > rounds / 4) {
      EXPECT_EQ(ids, ids_before) << "round " << r;
    }
  }
  // The first quarter is learning: noise has filled the voxels that it reaches.
  EXPECT_LE(static_cast<double>(all.back().heap), 1.01 * static_cast<double>(all.front().heap));
  EXPECT_LE(static_cast<double>(all.back().octree), 1.01 * static_cast<double>(all.front().octree));
  EXPECT_LE(all.back().appeared, all.front().appeared + of_a_round);
  EXPECT_LE(all.back().changed, all.front().changed + of_a_round);
  EXPECT_EQ(test::check_invariants(mapper.map()), std::vector<std::string>{});
}

/// The room with a table of 0.6 m by 0.6 m, a place for each day.
test::Scene room_of_day(int day) {
  test::Scene scene;
  const double x = -0.9 + 0.6 * (day % 4), y = day % 2 == 0 ? 0.5 : -1.1;
  scene.box({-1.5, -1.2, 0.01}, {1.5, 1.2, 2.0}).box({x, y, 0.01}, {x + 0.6, y + 0.6, 0.52});
  return scene;
}

/// Of all surfaces, or of what is level between floor and ceiling: table tops.
double area_of(const Mapper& mapper, bool tops) {
  double area = 0;
  for (const SurfacePtr& s : mapper.snapshot()->surfaces)
    if (!tops || (s->plane.normal.z() > 0.95 && s->plane.offset > 0.2 && s->plane.offset < 1.5))
      area += s->area_m2;
  return area;
}

TEST(Soak, FurnitureThatMovesEveryDayIsWhereItIsToday) {
  std::mt19937_64 rng = test::rng();
  constexpr int of_a_day = 80, places = 4;
  const int days = 20 * times_as_long();
  // In each voxel of a top as many readings as bring it from free to occupied by OctoMap's odds, and in each
  // voxel of a former one as many rays as clear it.
  constexpr test::Camera fine{80, 80, 50};
  const auto live = [&](Mapper& mapper, int day) {
    for (const Scan& scan : scans_of(room_of_day(day), of_a_day, rng, fine)) mapper.insert(scan);
    mapper.drain();
  };
  std::vector<double> alone;
  for (int place = 0; place < places; ++place) {
    Mapper mapper(coarse);
    live(mapper, place);
    alone.push_back(area_of(mapper, true));
    ASSERT_GT(alone.back(), 0.25) << "of 0.36 m²";
  }
  std::vector<double> settled(places);  // all area, once the table has stood at each place
  Mapper mapper(coarse);
  for (int day = 0; day < days; ++day) {
    live(mapper, day);
    EXPECT_NEAR(area_of(mapper, true), alone[day % places], 0.1 * alone[day % places]) << "day " << day;
    // With what the tables of other days do not hide, and nothing that gathers from day to day.
    if (day >= 2 * places) {
      EXPECT_NEAR(area_of(mapper, false), settled[day % places], 0.02 * settled[day % places])
          << "day " << day;
    } else if (day >= places) {
      settled[day % places] = area_of(mapper, false);
    }
  }
  EXPECT_EQ(test::check_invariants(mapper.map()), std::vector<std::string>{});
}

}  // namespace
}  // namespace octosurf::mapper
