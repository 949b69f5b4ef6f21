// How a map came about, in few moments: what they hold, and that they stay few.
#include "support/seed.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <random>

#include <octosurf/history.hpp>

namespace octosurf::surfaces {
namespace {

constexpr double voxel = 0.02;

/// A map that a test moves on by hand: surfaces with wavy outlines come, change and go.
class MadeUpMap {
 public:
  explicit MadeUpMap(std::mt19937_64 random) : random_(random) {}

  /// One more scan. Some change nothing.
  const Snapshot& next() {
    ++snapshot_.revision;
    const auto chance = random_() % 10;
    if (chance < 3 || snapshot_.surfaces.empty()) add();
    if (chance >= 3 && chance < 7) change();
    if (chance == 7) remove();
    if (chance == 8) {
      for (const CylinderPtr& gone : snapshot_.cylinders) note_departure(Departure::Of::cylinder, *gone);
      auto cylinder = std::make_shared<Cylinder>();
      cylinder->id = ++cylinders_;
      cylinder->born = cylinder->revision = snapshot_.revision;
      snapshot_.cylinders = {cylinder};
    }
    return snapshot_;
  }

 private:
  Ring2 ring() {
    std::uniform_real_distribution<double> phase(0, 6);
    const double turn = phase(random_);
    Ring2 ring;
    for (int k = 0; k < 200; ++k) {
      const double angle = 2 * 3.14159265358979 * k / 200, radius = 1 + 0.1 * std::cos(7 * angle + turn);
      ring.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    return ring;
  }
  void add() {
    Surface surface;
    surface.id = ++ids_;
    surface.resolution = voxel;
    surface.born = surface.revision = snapshot_.revision;
    surface.polygons = {{ring(), {{{0, 0}, {0, 0.1}, {0.1, 0}}}}};
    snapshot_.surfaces.push_back(std::make_shared<const Surface>(surface));
  }
  void change() {
    SurfacePtr& one = snapshot_.surfaces[random_() % snapshot_.surfaces.size()];
    Surface surface = *one;
    surface.revision = snapshot_.revision;
    surface.polygons.front().outer = ring();
    one = std::make_shared<const Surface>(surface);
  }
  void remove() {
    const auto at =
        snapshot_.surfaces.begin() + static_cast<std::ptrdiff_t>(random_() % snapshot_.surfaces.size());
    note_departure(Departure::Of::surface, **at);
    snapshot_.surfaces.erase(at);
  }

  template <typename Gone>
  void note_departure(Departure::Of of, const Gone& gone) {
    snapshot_.departures = snapshot_.departures.with({{of, gone.id, 0, gone.born, snapshot_.revision, {}}});
  }

  std::mt19937_64 random_;
  Snapshot snapshot_;
  SurfaceId ids_ = 0;
  CylinderId cylinders_ = 0;
};

double distance(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0;
  return (p - a - t * along).norm();
}

/// Of the vertex of `ring` that lies farthest from the outline `kept`.
double farthest(const Ring2& ring, const Ring2& kept) {
  double most = 0;
  for (const Eigen::Vector2d& p : ring) {
    double nearest = 1e9;
    for (std::size_t i = 0; i < kept.size(); ++i)
      nearest = std::min(nearest, distance(p, kept[i], kept[(i + 1) % kept.size()]));
    most = std::max(most, nearest);
  }
  return most;
}

void expect_as_in(const Moment& moment, const Snapshot& snapshot) {
  ASSERT_EQ(moment.revision, snapshot.revision);
  ASSERT_EQ(moment.surfaces.size(), snapshot.surfaces.size());
  for (std::size_t i = 0; i < moment.surfaces.size(); ++i) {
    const PastSurface& past = *moment.surfaces[i];
    const Surface& surface = *snapshot.surfaces[i];
    ASSERT_EQ(past.id, surface.id);
    ASSERT_EQ(past.revision, surface.revision);
    ASSERT_EQ(past.polygons.size(), 1U);
    ASSERT_EQ(past.polygons[0].holes.size(), 1U);
    ASSERT_LT(past.polygons[0].outer.size(), 120U);
    // Half a voxel, and what a coordinate is rounded by.
    if (i % 16 == 0) {
      ASSERT_LE(farthest(surface.polygons[0].outer, past.polygons[0].outer), voxel / 2 + 1e-4);
    }
  }
  ASSERT_EQ(moment.cylinders, snapshot.cylinders);
}

TEST(History, HoldsWhatTheMapWasAtFewMomentsOfALongRun) {
  MadeUpMap map(test::rng());
  History history;
  std::map<std::uint64_t, Snapshot> all;
  std::size_t most = 0;
  for (int scan = 0; scan < 3000; ++scan) {
    const Snapshot& snapshot = map.next();
    all[snapshot.revision] = snapshot;
    history.add(snapshot, 0.1 * scan);
    most = std::max(most, history.moments().size());
  }
  EXPECT_EQ(most, History::most_moments);
  EXPECT_GT(history.moments().size(), History::most_moments / 3) << "as many as allowed, or half of them";
  std::uint64_t last = 0;
  for (const Moment& moment : history.moments()) {
    ASSERT_GE(moment.revision, last + (last == 0 ? 1 : history.stride()));
    last = moment.revision;
    ASSERT_NO_FATAL_FAILURE(expect_as_in(moment, all.at(moment.revision)));
  }
  EXPECT_GT(last, 2900U) << "to the end of the run";
}

TEST(History, ChangesLeadFromMomentToMoment) {
  MadeUpMap map(test::rng());
  History history;
  for (int scan = 0; scan < 200; ++scan) history.add(map.next(), 0);
  std::map<SurfaceId, PastSurfacePtr> known;
  const Moment* before = nullptr;
  for (const Moment& moment : history.moments()) {
    const MomentChanges changes = changes_of(before, moment);
    for (const PastSurfacePtr& surface : changes.surfaces) known[surface->id] = surface;
    for (const SurfaceId id : changes.gone) ASSERT_EQ(known.erase(id), 1U);
    ASSERT_EQ(known.size(), moment.surfaces.size());
    for (const PastSurfacePtr& surface : moment.surfaces) ASSERT_EQ(known.at(surface->id), surface);
    before = &moment;
  }
}

TEST(History, OfAMapThatStandsStillHasOneMoment) {
  MadeUpMap map(test::rng());
  History history;
  Snapshot snapshot = map.next();
  for (int scan = 0; scan < 100; ++scan) {
    ++snapshot.revision;
    history.add(snapshot, scan);
  }
  EXPECT_EQ(history.moments().size(), 1U);
}

TEST(History, BelongsToItsMapAndItsHeirs) {
  MadeUpMap map(test::rng()), other(std::mt19937_64(test::seed() + 1));
  History history, of_other;
  Snapshot early;
  for (int scan = 0; scan < 100; ++scan) {
    const Snapshot& snapshot = map.next();
    if (scan == 50) early = snapshot;
    history.add(snapshot, scan);
    of_other.add(other.next(), scan);
  }
  EXPECT_TRUE(history.belongs_to(map.next()));
  EXPECT_FALSE(of_other.belongs_to(map.next()));
  EXPECT_TRUE(history.belongs_to(early)) << "what came later does not speak against it";
  history.forget_after(early.revision);
  EXPECT_LE(history.moments().back().revision, early.revision);
}

}  // namespace
}  // namespace octosurf::surfaces
