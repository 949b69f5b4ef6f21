// What happened since: by hand, and against the snapshots of a map that is made and unmade.
#include "support/scene.hpp"

#include <octosurf/changes.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::planning {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using Successor = MapChanges::Successor;

SurfacePtr living(SurfaceId id, std::uint64_t born, std::uint64_t revision,
                  std::vector<SurfaceId> parents = {}) {
  Surface surface;
  surface.id = id;
  surface.born = born;
  surface.revision = revision;
  surface.parents = std::move(parents);
  return std::make_shared<const Surface>(std::move(surface));
}
Removal gone(SurfaceId id, std::uint64_t born, std::uint64_t revision, SurfaceId into = 0,
             std::vector<SurfaceId> parents = {}) {
  return {Removal::Of::surface, id, into, born, revision, std::move(parents)};
}

TEST(Changes, SplitsAndMergersAreFollowedThroughWhatCameAndWent) {
  // At 10 there were 1, 2, 3, 4. Then 5 was split from 1 (11), 5 merged into 2 (12), 3 merged into 6, which
  // had come at 11 (12), and 6 into 2 (13); 4 went (13); 7 came (14) and went (15); 2 has 5 and 6.
  Snapshot snapshot;
  snapshot.revision = 15;
  snapshot.surfaces = {living(1, 1, 11), living(2, 2, 13, {5, 6})};
  snapshot.removals = RemovalLog().with(
      {gone(5, 11, 12, 2, {1}), gone(3, 3, 12, 6), gone(6, 11, 13, 2, {3}), gone(4, 4, 13), gone(7, 14, 15)});
  const MapChanges changes = changes_since(snapshot, 10);
  EXPECT_THAT(changes.appeared, IsEmpty());
  EXPECT_THAT(changes.changed, ElementsAre(1, 2));
  EXPECT_THAT(changes.gone, ElementsAre(4));
  EXPECT_THAT(changes.merged, ElementsAre(Successor{3, 2}));
  EXPECT_THAT(changes.split, ElementsAre(Successor{1, 2}));
  const MapChanges later = changes_since(snapshot, 12);
  EXPECT_THAT(later.changed, ElementsAre(2));
  EXPECT_THAT(later.merged, ElementsAre(Successor{6, 2}));
  EXPECT_THAT(later.split, IsEmpty()) << "1 was split before";
  EXPECT_THAT(changes_since(snapshot, 15).changed, IsEmpty());
  EXPECT_THROW(changes_since(snapshot, 16), Error);
}

TEST(Changes, WhatWasTakenInBySomethingThatWentIsGone) {
  Snapshot snapshot;
  snapshot.revision = 9;
  snapshot.removals = RemovalLog().with({gone(1, 1, 8, 2), gone(2, 2, 9)});
  const MapChanges changes = changes_since(snapshot, 5);
  EXPECT_THAT(changes.gone, ElementsAre(1, 2));
  EXPECT_THAT(changes.merged, IsEmpty());
}

TEST(Changes, OldOnesAreRefusedOnceTheirRemovalsAreNotKept) {
  Snapshot snapshot;
  snapshot.revision = 150'000;
  for (SurfaceId id = 1; id <= snapshot.revision; id += 1000) {
    std::vector<Removal> more;
    for (SurfaceId k = id; k < id + 1000; ++k) more.push_back(gone(k, 1, k));
    snapshot.removals = snapshot.removals.with(more);
  }
  const std::uint64_t since = snapshot.removals.complete_since();
  EXPECT_GE(snapshot.removals.size(), 100'000U);
  EXPECT_LE(snapshot.removals.size(), 101'000U);
  EXPECT_EQ(since, snapshot.revision - snapshot.removals.size());
  EXPECT_THAT(changes_since(snapshot, since).gone, SizeIs(snapshot.removals.size()));
  EXPECT_THROW(changes_since(snapshot, since - 1), Error);
  EXPECT_THAT(changes_since(snapshot, 0).gone, IsEmpty());
}

TEST(Changes, CylindersToo) {
  Snapshot snapshot;
  snapshot.revision = 9;
  const auto cylinder = [](CylinderId id, std::uint64_t born, std::uint64_t revision) {
    Cylinder c;
    c.id = id;
    c.born = born;
    c.revision = revision;
    return std::make_shared<const Cylinder>(c);
  };
  snapshot.cylinders = {cylinder(1, 1, 9), cylinder(4, 8, 8)};
  snapshot.removals =
      RemovalLog().with({{Removal::Of::cylinder, 2, 1, 2, 7, {}}, {Removal::Of::cylinder, 3, 0, 2, 8, {}}});
  const MapChanges changes = changes_since(snapshot, 5);
  EXPECT_THAT(changes.cylinders_appeared, ElementsAre(4));
  EXPECT_THAT(changes.cylinders_changed, ElementsAre(1));
  EXPECT_THAT(changes.cylinders_gone, ElementsAre(3));
  EXPECT_THAT(changes.cylinders_merged, ElementsAre(Successor{2, 1}));
}

TEST(Changes, ALogKeepsItsOrderOverItsChunks) {
  RemovalLog log;
  std::vector<Removal> all;
  for (SurfaceId id = 1; id <= 1000;) {
    std::vector<Removal> more;
    for (SurfaceId last = std::min<SurfaceId>(1000, id + id % 7); id <= last; ++id)
      more.push_back(gone(id, 0, 10 + id / 10));
    const RemovalLog before = log;
    log = log.with(more);
    EXPECT_EQ(before.size(), all.size()) << "the old one stays";
    all.insert(all.end(), more.begin(), more.end());
  }
  for (const std::uint64_t since : {0, 9, 10, 11, 35, 60, 109, 110, 200}) {
    std::vector<Removal> expected, told;
    for (const Removal& removal : all)
      if (removal.revision > since) expected.push_back(removal);
    log.for_each_since(since, [&](const Removal& removal) { told.push_back(removal); });
    EXPECT_EQ(told, expected) << "since " << since;
  }
}

/// A table that is moved about on a floor: surfaces grow together, are parted, go.
std::vector<std::shared_ptr<const Snapshot>> map_moving_table() {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> place(-0.8, 0.8);
  Mapper mapper(test::of_voxels(0.04));
  std::vector<std::shared_ptr<const Snapshot>> snapshots{mapper.snapshot()};
  Eigen::Vector2d table(place(rng), place(rng));
  for (int i = 0; i < 40; ++i) {
    if (i % 8 == 7) table = {place(rng), place(rng)};
    test::Scene scene;
    scene.rectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0});
    scene.box({table.x() - 0.4, table.y() - 0.6, 0.3}, {table.x() + 0.4, table.y() + 0.6, 0.35});
    const double a = 0.9 * i;
    const Eigen::Vector3d eye(1.8 * std::cos(a), 1.8 * std::sin(a), 1.5);
    mapper.insert(test::camera_scan(scene, test::look_at(eye, {0.2 * place(rng), 0.2 * place(rng), 0}), rng));
    snapshots.push_back(mapper.snapshot());
  }
  return snapshots;
}

/// The same for all tests of a seed.
const std::vector<std::shared_ptr<const Snapshot>>& moving_table() {
  static std::map<std::uint64_t, std::vector<std::shared_ptr<const Snapshot>>> all;
  auto& snapshots = all[test::seed()];
  if (snapshots.empty()) snapshots = map_moving_table();
  return snapshots;
}

using Successors = std::map<SurfaceId, std::set<SurfaceId>>;

/// Of every surface of `before`, itself included where it still is.
Successors successors(const Snapshot& before, const Snapshot& after) {
  const MapChanges changes = changes_since(after, before.revision);
  Successors all;
  for (const SurfacePtr& s : before.surfaces) {
    all[s->id];
    if (after.find(s->id) != nullptr) all[s->id].insert(s->id);
  }
  for (const Successor& successor : changes.merged) all[successor.before].insert(successor.now);
  for (const Successor& successor : changes.split) all[successor.before].insert(successor.now);
  return all;
}

TEST(Changes, WhoFollowsThemHasWhatTheSnapshotHas) {
  const auto& snapshots = moving_table();
  std::size_t gone = 0, merged = 0;
  for (std::size_t i = 0; i < snapshots.size(); ++i)
    for (std::size_t j = i; j < snapshots.size(); j += 1 + j % 5) {
      const Snapshot &before = *snapshots[i], &after = *snapshots[j];
      const MapChanges changes = changes_since(after, before.revision);
      std::set<SurfaceId> ids;
      for (const SurfacePtr& s : before.surfaces) ids.insert(s->id);
      for (const SurfaceId id : changes.gone) EXPECT_EQ(ids.erase(id), 1U) << id;
      for (const Successor& successor : changes.merged) ids.erase(successor.before);
      for (const SurfaceId id : changes.changed) EXPECT_TRUE(ids.contains(id));
      for (const SurfaceId id : changes.appeared) EXPECT_TRUE(ids.insert(id).second) << id;
      std::set<SurfaceId> expected;
      for (const SurfacePtr& s : after.surfaces) {
        expected.insert(s->id);
        const bool told = std::binary_search(changes.changed.begin(), changes.changed.end(), s->id) ||
                          std::binary_search(changes.appeared.begin(), changes.appeared.end(), s->id);
        const Surface* was = before.find(s->id);
        EXPECT_EQ(told, was != s.get()) << "surface " << s->id;
      }
      EXPECT_EQ(ids, expected);
      gone += changes.gone.size();
      merged += changes.merged.size();
    }
  EXPECT_GT(gone + merged, 0U);
}

TEST(Changes, LineageOverManyScansIsThatOverEachOfThem) {
  const auto& snapshots = moving_table();
  for (std::size_t i = 0; i + 1 < snapshots.size(); i += 3) {
    Successors step_by_step;
    for (const SurfacePtr& s : snapshots[i]->surfaces) step_by_step[s->id] = {s->id};
    for (std::size_t j = i + 1; j < snapshots.size(); ++j) {
      const Successors step = successors(*snapshots[j - 1], *snapshots[j]);
      for (auto& [id, now] : step_by_step) {
        std::set<SurfaceId> next;
        for (const SurfaceId holder : now) next.insert(step.at(holder).begin(), step.at(holder).end());
        now = next;
      }
      ASSERT_EQ(successors(*snapshots[i], *snapshots[j]), step_by_step) << "from " << i << " to " << j;
    }
  }
}

}  // namespace
}  // namespace octosurf::planning
