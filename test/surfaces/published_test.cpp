// What readers see while the mapper's thread goes on.
#include "surfaces/published.hpp"

#include "support/polygons.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;
using test::h;

/// A surface that grows, and its twin whose polygons are made at once.
struct Grown {
  explicit Grown(std::mt19937_64& random) : rng(random) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const Plane plane{pose.linear().col(2), pose.linear().col(2).dot(pose.translation())};
    model = std::make_unique<SurfaceModel>(1, plane, pose.translation(), d);
    twin = std::make_unique<SurfaceModel>(1, plane, pose.translation(), d);
    waiting = test::voxels_of(test::random_blob(rng, 0.8, 0.1), pose, d, 0.8, 0.006, rng);
    std::shuffle(waiting.begin(), waiting.end(), rng);
  }

  /// Adds some inliers and takes back a few.
  void change() {
    for (int i = 0; i < 60 && !waiting.empty(); ++i) {
      model->add(waiting.back());
      twin->add(waiting.back());
      there.push_back(waiting.back());
      waiting.pop_back();
    }
    for (int i = 0; i < 5; ++i) {
      const std::size_t at = rng() % there.size();
      EXPECT_TRUE(model->remove(there[at].key, there[at].position));
      EXPECT_TRUE(twin->remove(there[at].key, there[at].position));
      waiting.insert(waiting.begin(), there[at]);
      there.erase(there.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }
  /// As update::derive() does.
  std::shared_ptr<const Published::State> next(const Published& published, std::uint64_t revision) {
    model->update_raster(h, nullptr);
    std::vector<OutlineChange> changes;
    changes.push_back(model->take_outline_change(h, nullptr));
    auto snapshot = std::make_shared<Snapshot>(Snapshot{revision, d, {model->publish(revision)}});
    return published.next(std::move(snapshot), std::move(changes));
  }

  std::mt19937_64& rng;
  std::unique_ptr<SurfaceModel> model, twin;
  std::vector<Inlier> waiting, there;
};

std::shared_ptr<const Snapshot> empty_snapshot() { return std::make_shared<Snapshot>(Snapshot{0, d, {}}); }

/// However many changes a read finds, also more than are kept apart.
TEST(Published, PolygonsDoNotDependOnWhenTheyAreRead) {
  for (const std::uint64_t gap : {1U, 2U, 7U, 40U}) {
    std::mt19937_64 rng = test::rng();
    Grown grown(rng);
    Published published(empty_snapshot());
    for (std::uint64_t revision = 1; revision <= 80; ++revision) {
      grown.change();
      published.store(grown.next(published, revision));
      EXPECT_TRUE(published.latest()->surfaces[0]->polygons.empty());
      if (revision % gap != 0) continue;
      grown.twin->derive(h);
      const std::shared_ptr<const Snapshot> read = published.read();
      ASSERT_EQ(read->revision, revision);
      ASSERT_TRUE(test::identical(read->surfaces[0]->polygons, grown.twin->polygons())) << "every " << gap;
      const SurfacePtr whole = grown.twin->publish(revision);
      EXPECT_EQ(read->surfaces[0]->area_m2, whole->area_m2);
      EXPECT_EQ(read->surfaces[0]->boundary, whole->boundary);
      EXPECT_EQ(published.read(), read);
    }
  }
}

/// A state that is not stored, as of a scan that fails, leaves nothing behind.
TEST(Published, WhatIsTakenBackIsNotSeen) {
  std::mt19937_64 rng = test::rng();
  Grown grown(rng);
  Published published(empty_snapshot());
  grown.change();
  published.store(grown.next(published, 1));
  const auto before = grown.model->state(published.read().get());
  grown.change();
  grown.next(published, 2);
  grown.model = std::make_unique<SurfaceModel>(before, d);  // as the store restores it
  grown.twin = std::make_unique<SurfaceModel>(before, d);
  EXPECT_EQ(published.read()->revision, 1U);
  published.store(grown.next(published, 2));
  grown.twin->derive(h);
  EXPECT_TRUE(test::identical(published.read()->surfaces[0]->polygons, grown.twin->polygons()));
}

/// As after an update for which memory did not suffice.
TEST(Published, ABrokenOutlineIsMadeAnew) {
  std::mt19937_64 rng = test::rng();
  Grown grown(rng);
  Published published(empty_snapshot());
  for (std::uint64_t revision = 1; revision <= 2; ++revision) {
    grown.change();
    published.store(grown.next(published, revision));
    grown.model->take_outline_change(h, nullptr).outline->broken = true;
    grown.twin->derive(h);
    EXPECT_TRUE(test::identical(published.read()->surfaces[0]->polygons, grown.twin->polygons()));
  }
}

}  // namespace
}  // namespace octosurf::surfaces
