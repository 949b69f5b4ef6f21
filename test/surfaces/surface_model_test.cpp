// The working form of a surface against what its inliers say when asked one by one.
#include "surfaces/surface_model.hpp"

#include "surfaces/blobs.hpp"
#include "surfaces/published.hpp"
#include "surfaces/shared_readings.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;
using test::h;
using test::model_of;

TEST(SurfaceModel, PolygonsAreTheAlphaShapeOfAllInliers) {
  std::mt19937_64 rng = test::rng();
  std::size_t points = 0, used = 0;
  const auto compare = [&](double hole_size, double size, double hole, bool along_voxels, int round) {
    SCOPED_TRACE(std::to_string(hole_size) + " m, round " + std::to_string(round));
    Eigen::Isometry3d pose = test::random_pose(rng);
    if (along_voxels) pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round % 3));  // dense
    SurfaceModel model =
        model_of(test::voxels_of(test::random_blob(rng, size, hole), pose, d, size, 0.006, rng), pose);
    model.derive(hole_size);
    const std::vector<Polygon> slow = test::slow_polygons(model, hole_size);
    EXPECT_EQ(test::ring_sets(model.polygons()), test::ring_sets(slow));
    EXPECT_LT(test::difference(model.polygons(), slow), 1e-9);
    if (!along_voxels) return;
    points += model.size();
    used += model.outline_sites();
  };
  for (int round = 0; round < 30 && !HasFailure(); ++round)
    compare(h, 0.8, std::array{0.03, 0.08, 0.2}[static_cast<std::size_t>(round % 3)], round % 2 == 0,
            round / 2);
  EXPECT_LT(used, points * 9 / 10) << "nothing was left out: the test tests nothing";
  for (const double small : {1.5 * d, 2.5 * d, 3.9 * d})
    compare(small, 0.4, 0.1, false, 0);  // use every point
  // The larger the holes that are closed, the fewer sites stand in for what lies deep inside.
  for (int round = 0; round < 12 && !HasFailure(); ++round)
    compare(std::array{5 * d, 8 * d, 10 * d, 17 * d}[static_cast<std::size_t>(round % 4)], 1.5,
            round % 2 == 0 ? 0.1 : 0.3, true, round);
}

/// Derived polygons are those of a model that never saw anything else, and the alpha shape of all
/// inliers and boundary points, whatever came, went and tilted, and whatever the noise became; also after the
/// model was saved and loaded.
TEST(SurfaceModel, PolygonsDoNotDependOnHistory) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  const std::array noises{test::noise_of(0.001), test::noise_of(0.003), test::noise_of(0.02)};
  for (int round = 0; round < 6 && !HasFailure(); ++round) {
    Eigen::Isometry3d pose = test::random_pose(rng);
    if (round % 2 == 0) pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round / 2));
    const std::vector<Inlier> all =
        test::voxels_of(test::random_blob(rng, 0.7, 0.1), pose, d, 0.7, 0.006, rng);
    std::vector<bool> in(all.size(), true);
    SurfaceModel model = model_of(all, pose);
    const sensing::NoiseModel* noise = nullptr;
    for (int step = 0; step < 40 && !HasFailure(); ++step) {
      // All near one place, so that cells fill and empty.
      const Eigen::Vector3f centre = all[rng() % all.size()].position;
      const bool out = rng() % 2 == 0;
      const float reach = rng() % 4 == 0 ? 0.03F : 0.15F;
      for (std::size_t i = 0; i < all.size(); ++i) {
        if ((all[i].position - centre).norm() > reach || in[i] != out) continue;
        if (out)
          ASSERT_TRUE(model.remove(all[i].key, all[i].position));
        else
          model.add(all[i]);
        in[i] = !out;
      }
      Plane plane = model.plane();
      plane.normal =
          (plane.normal + 0.006 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))).normalized();
      plane.offset = plane.normal.dot(pose.translation()) + 0.003 * uniform(rng);
      model.set_plane(plane);
      model.rehash_if_tilted();
      if (step % 5 == 4) noise = &noises[rng() % noises.size()];
      model.derive(h, noise);
      SurfaceModel back(model.state(), d);
      back.derive(h, noise);
      ASSERT_TRUE(test::identical(model.polygons(), back.polygons()))
          << "round " << round << " step " << step;
      ASSERT_EQ(test::ring_sets(model.polygons()), test::ring_sets(test::slow_polygons(model, h)));
    }
  }
}

/// Guarantee 2 of derive(): boundary points are inliers on the plane, up to what the hash frame's tilt
/// makes of their distance from it.
TEST(SurfaceModel, BoundaryPointsAreProjectedInliers) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all = test::voxels_of(test::random_blob(rng, 0.7, 0.1), pose, d, 0.7, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  Plane plane = model.plane();
  plane.normal = Eigen::AngleAxisd(0.017, pose.linear().col(0)) * plane.normal;  // 0.97°
  plane.offset = plane.normal.dot(pose.translation());
  model.set_plane(plane);
  model.rehash_if_tilted();
  model.derive(h);
  const SurfacePtr surface = model.publish(1);
  for (const Eigen::Vector3d& p : surface->boundary) {
    bool found = false;
    for (const Inlier& inlier : all) {
      const Eigen::Vector3d q = inlier.position.cast<double>();
      const double off = plane.signed_distance(q);
      found = found || (q - off * plane.normal - p).norm() <= std::fabs(off) * std::sin(0.0175) + 4e-6;
    }
    EXPECT_TRUE(found) << p.transpose();
  }
}

/// Guarantee 3: fresh polygons are still right after whatever came and went without making them stale.
TEST(SurfaceModel, PolygonsThatAreNotStaleAreRight) {
  std::mt19937_64 rng = test::rng();
  std::size_t fresh = 0, wrong = 0;
  double worst = 0;
  for (int round = 0; round < 4 && !HasFailure(); ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const std::vector<Inlier> all =
        test::voxels_of(test::random_blob(rng, 1.2, 0.05), pose, d, 1.2, 0.008, rng);
    SurfaceModel model =
        model_of({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() * 99 / 100)}, pose);
    std::vector<bool> in(all.size(), false);
    for (std::size_t i = 0; i < all.size() * 99 / 100; ++i) in[i] = true;
    model.derive(h);
    for (int step = 0; step < 150 && !HasFailure(); ++step) {
      const std::size_t i = rng() % all.size();
      if (in[i])
        ASSERT_TRUE(model.remove(all[i].key, all[i].position));
      else
        model.add(all[i]);
      in[i] = !in[i];
      if (model.polygons_stale()) {
        model.derive(h);
        continue;
      }
      ++fresh;
      const double off = test::difference(model.polygons(), test::slow_polygons(model, h));
      worst = std::max(worst, off);
      if (off < 1e-9) continue;
      ++wrong;
      model.derive(h);
    }
  }
  EXPECT_EQ(wrong, 0U) << "of " << fresh << ", by up to " << worst << " m²";
  EXPECT_GT(fresh, 50U);
}

TEST(SurfaceModel, MomentsSurviveChurn) {
  std::mt19937_64 rng = test::rng();
  Eigen::Isometry3d pose = test::random_pose(rng);
  pose.translation() += Eigen::Vector3d(120, -80, 3);  // digits are lost far from the origin, if anywhere
  const std::vector<Inlier> all = test::voxels_of(test::random_blob(rng, 0.6, 0.1), pose, d, 0.6, 0.006, rng);
  SurfaceModel model(1, test::plane_of(pose), pose.translation(), d);
  std::set<std::size_t> in;
  for (int step = 0; step < 60000; ++step) {
    const std::size_t i = rng() % all.size();
    if (in.erase(i) > 0) {
      ASSERT_TRUE(model.remove(all[i].key, all[i].position));
    } else {
      model.add(all[i]);
      in.insert(i);
    }
  }
  geometry::Moments plain, weighted;
  Parameters noisy;
  noisy.surfaces.range_noise = 0.002;
  const sensing::NoiseModel noise(noisy);
  double squares = 0;
  for (const std::size_t i : in) {
    const Eigen::Vector3d p = all[i].position.cast<double>() - model.reference();
    const double w = std::pow(noise.sigma(1) / noise.sigma(all[i].range_class), 2);
    plain.add(p);
    weighted.add(p, w);
    squares += std::pow(model.distance(all[i].position), 2);
  }
  EXPECT_EQ(model.size(), in.size());
  for (const auto& [sums, moments] :
       {std::pair{plain, model.moments(nullptr)}, {weighted, model.moments(&noise)}}) {
    EXPECT_NEAR(moments.count, sums.count, 1e-6 * sums.count);
    EXPECT_LT((moments.sum - sums.sum).norm(), 1e-7 * sums.count);
    EXPECT_LT((moments.outer - sums.outer).norm(), 1e-7 * sums.count);
  }
  EXPECT_NEAR(model.rms(), std::sqrt(squares / static_cast<double>(in.size())), 1e-6);
}

/// Also after it has tilted.
TEST(SurfaceModel, CellsHoldExactlyTheInliers) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all =
      test::voxels_of(test::random_blob(rng, 0.3, 0.06), pose, d, 0.3, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  for (const double tilt : {0.0, 0.1}) {
    Plane plane = model.plane();
    plane.normal = Eigen::AngleAxisd(tilt, pose.linear().col(0)) * plane.normal;
    plane.offset = plane.normal.dot(pose.translation());
    model.set_plane(plane);
    model.rehash_if_tilted();
    std::map<std::uint64_t, int> cells;
    for (const Inlier& inlier : all) {
      const geometry::PlaneCell cell = model.cell_of(inlier.position);
      ++cells[cell.packed()];
      const geometry::PlaneCell back = geometry::PlaneCell::unpack(cell.packed());
      EXPECT_TRUE(back.u == cell.u && back.v == cell.v);
      // The edge of a cell is d: its place in the plane says which one it is.
      const Eigen::Vector2d uv =
          (model.pose().inverse() * Eigen::Vector3d(inlier.position.cast<double>())).head<2>() / d;
      EXPECT_NEAR(uv.x(), cell.u + 0.5, 0.5 + 1e-3);
      EXPECT_NEAR(uv.y(), cell.v + 0.5, 0.5 + 1e-3);
    }
    const auto holds = [&](int u, int v) { return cells.contains(geometry::PlaneCell{u, v}.packed()); };
    for (int v = -20; v <= 20; ++v)
      for (int u = -20; u <= 20; ++u) {
        EXPECT_EQ(model.occupied({u, v}), holds(u, v));
        int neighbours = 0;
        for (int y = -1; y <= 1; ++y)
          for (int x = -1; x <= 1; ++x) neighbours += (x != 0 || y != 0) && holds(u + x, v + y);
        EXPECT_EQ(model.covers({u, v}), holds(u, v) || neighbours >= 5);
        for (const int reach : {0, 1, 2, 4}) {
          bool any = false;
          for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) any |= holds(u + x, v + y);
          EXPECT_EQ(model.nearest({u, v}, reach).has_value(), any);
        }
      }
  }
  EXPECT_EQ(model.size(), all.size());
  for (const Inlier& inlier : all) {
    EXPECT_TRUE(model.remove(inlier.key, inlier.position)) << "an inlier is in a cell where nobody looks";
    EXPECT_FALSE(model.remove(inlier.key, inlier.position));
  }
  EXPECT_EQ(model.size(), 0U);
}

TEST(SurfaceModel, WhatComesAndGoesAgainDoesNotChangeItsSize) {
  std::mt19937_64 rng(test::seed());
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> inliers =
      test::voxels_of(test::random_blob(rng, 0.8, 0.1), pose, d, 0.8, 0.006, rng);
  const std::size_t half = inliers.size() / 2;
  SurfaceModel model = model_of({inliers.begin(), inliers.begin() + static_cast<std::ptrdiff_t>(half)}, pose);
  EXPECT_TRUE(model.size_has_changed());  // it was never looked at
  model.set_checked();
  for (int round = 0; round < 20; ++round) {
    for (std::size_t i = 0; i < half / 4; ++i) ASSERT_TRUE(model.remove(inliers[i].key, inliers[i].position));
    for (std::size_t i = 0; i < half / 4; ++i) model.add(inliers[i]);
    EXPECT_FALSE(model.size_has_changed());
  }
  for (std::size_t i = half; i < 2 * half; ++i) {
    EXPECT_FALSE(model.size_has_changed());
    model.add(inliers[i]);
  }
  EXPECT_TRUE(model.size_has_changed());
  model.set_checked();
  for (std::size_t i = 0; 3 * i < 2 * half; ++i) {
    EXPECT_FALSE(model.size_has_changed());
    ASSERT_TRUE(model.remove(inliers[i].key, inliers[i].position));
  }
  EXPECT_TRUE(model.size_has_changed());
}

TEST(SurfaceModel, PoseMovesAsLittleAsPossible) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 200; ++round) {
    SurfaceModel model(1, test::plane_of(test::random_pose(rng)), {1, 2, 3}, d);
    for (int step = 0; step < 5; ++step) {
      const Eigen::Isometry3d before = model.pose();
      const Plane was = model.plane();
      Plane plane;
      plane.normal =
          (was.normal + 0.1 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))).normalized();
      plane.offset = plane.normal.dot(before.translation()) + 0.05 * uniform(rng);
      model.set_plane(plane);
      const Eigen::Isometry3d after = model.pose();
      EXPECT_LT((after.linear().transpose() * after.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_GT(after.linear().determinant(), 0);
      EXPECT_LT((after.linear().col(2) - plane.normal).norm(), 1e-12);
      EXPECT_NEAR(plane.signed_distance(after.translation()), 0, 1e-12);
      // The rotation is the one between the normals and the origin has moved along the normal.
      const double turned = Eigen::AngleAxisd(after.linear() * before.linear().transpose()).angle();
      EXPECT_NEAR(turned, std::acos(std::min(1.0, was.normal.dot(plane.normal))), 1e-7);
      EXPECT_NEAR((after.translation() - before.translation()).norm(),
                  std::fabs(plane.signed_distance(before.translation())), 1e-12);
    }
  }
}

TEST(PlaneAxes, AreAFrameWhoseXIsHorizontal) {
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> gauss;
  std::vector<Eigen::Vector3d> normals;
  for (int a = 0; a < 3; ++a) {
    normals.push_back(Eigen::Vector3d::Unit(a));
    normals.push_back(-Eigen::Vector3d::Unit(a));
  }
  normals.push_back(Eigen::Vector3d(1, 1, 0).normalized());
  normals.push_back(Eigen::Vector3d(1, 1, 1).normalized());
  for (int i = 0; i < 500; ++i)
    normals.push_back(Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng)).normalized());
  for (const Eigen::Vector3d& n : normals) {
    const Eigen::Matrix3d axes = geometry::plane_axes(n);
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-12) << n.transpose();
    EXPECT_NEAR(axes.determinant(), 1, 1e-12);
    EXPECT_LT((axes.col(2) - n).norm(), 1e-12);
    EXPECT_NEAR(axes(2, 0), 0, 1e-12) << "x is not horizontal for the normal " << n.transpose();
  }
}

TEST(Colour, FirstSixtyFourAreDistinct) {
  std::vector<Eigen::Vector3f> colours;
  for (SurfaceId id = 1; id <= 64; ++id) {
    const auto c = color_of(id);
    colours.emplace_back(c[0], c[1], c[2]);
    EXPECT_GE(colours.back().minCoeff(), 0);
    EXPECT_LE(colours.back().maxCoeff(), 1);
  }
  for (std::size_t a = 0; a < colours.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT((colours[a] - colours[b]).cwiseAbs().maxCoeff(), 4.0F / 255) << a + 1 << " and " << b + 1;
}

// What readers see while the mapper's thread goes on.

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

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

TEST(SharedReadings, MostIsTheLowerIdOnATieAndReadingsOfNoSurfaceCount) {
  SharedReadings shared;
  shared.add(5, 7, 2);
  shared.add(5, 3, 2);
  shared.add(5, 0, 10);
  shared.add(0, 3, 4);
  shared.add(6, 0);
  const SharedReadings::Shares& five = shared.before().at(5);
  EXPECT_EQ(five.all, 14);
  EXPECT_EQ(five.most(), 3U);
  EXPECT_EQ(five.shared(7), 2);
  EXPECT_EQ(five.shared(8), 0);
  EXPECT_EQ(shared.before().at(6).most(), 0U);
  EXPECT_FALSE(shared.before().contains(0));
  EXPECT_EQ(shared.after(3), 6);
  EXPECT_EQ(shared.after(0), 0);
}

TEST(SharedReadings, AnIdGoesWhereMostOfItsReadingsAreUnlessAnotherHasMoreThere) {
  SharedReadings shared;
  shared.add(1, 11, 6);  // split: 11 continues it, 12 does not
  shared.add(1, 12, 5);
  shared.add(2, 11, 5);  // merges into 11
  shared.add(3, 13, 4);
  shared.add(3, 0, 5);
  shared.add(0, 13, 5);
  shared.add(4, 14, 3);
  shared.add(5, 14, 9);
  EXPECT_THAT(shared.keepers(), ElementsAre(Pair(11, 1), Pair(13, 3), Pair(14, 5)));
  EXPECT_THAT(shared.keepers({5}), ElementsAre(Pair(11, 1), Pair(13, 3), Pair(14, 4))) << "5 is unpublished";
  EXPECT_THAT(shared.origins(), ElementsAre(Pair(11, 1), Pair(12, 1), Pair(14, 5))) << "more than half";
}

TEST(SharedReadings, TiesGoToLowerIds) {
  SharedReadings shared;
  for (const SharedReadings::Id before : {2, 1})
    for (const SharedReadings::Id after : {12, 11}) shared.add(before, after);
  EXPECT_THAT(shared.keepers(), ElementsAre(Pair(11, 1)));
  EXPECT_THAT(shared.origins(), IsEmpty());
  EXPECT_THAT(SharedReadings().keepers(), IsEmpty());
}

}  // namespace
}  // namespace octosurf::surfaces
