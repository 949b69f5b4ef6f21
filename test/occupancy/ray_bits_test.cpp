// The rays' bits against a walk that is OctoMap's own, for every kind of ray.
#include "occupancy/ray_bits.hpp"

#include "geometry/morton.hpp"
#include "occupancy/walk_lanes.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <random>
#include <set>

namespace octosurf::occupancy {
namespace {

using KeySet = std::set<std::array<std::uint16_t, 3>>;

struct Touched {
  KeySet misses, hits;
};

std::array<std::uint16_t, 3> array_of(const octomap::OcTreeKey& k) { return {k[0], k[1], k[2]}; }

/// Rays to the centres of `ends`, those beyond max_range cut there as OctoMap's insertion does.
std::vector<GridRay> rays_to(const octomap::OcTree& tree, const octomap::point3d& origin,
                             const std::vector<octomap::point3d>& ends, double max_range) {
  std::vector<GridRay> rays;
  for (const octomap::point3d& point : ends) {
    octomap::OcTreeKey key;
    if (!tree.coordToKeyChecked(point, key)) continue;
    octomap::point3d end = tree.keyToCoord(key);
    const bool hit = (end - origin).norm() <= max_range;
    if (!hit) {
      end = origin + (end - origin).normalized() * static_cast<float>(max_range);
      if (!tree.coordToKeyChecked(end, key)) continue;
    }
    rays.push_back({{end.x(), end.y(), end.z()}, array_of(key), hit, hit});
  }
  return rays;
}

Touched slowly(const octomap::OcTree& tree, const octomap::point3d& origin,
               const std::vector<GridRay>& rays) {
  Touched touched;
  for (const GridRay& ray : rays) {
    octomap::KeyRay keys;
    EXPECT_TRUE(tree.computeRayKeys(origin, {ray.end[0], ray.end[1], ray.end[2]}, keys));
    for (const octomap::OcTreeKey& key : keys) touched.misses.insert(array_of(key));
    if (ray.hit) touched.hits.insert(ray.key);
  }
  for (const auto& key : touched.hits) touched.misses.erase(key);
  return touched;
}

Touched read(std::span<const TouchedBlock> blocks) {
  Touched touched;
  for (const TouchedBlock& block : blocks) {
    bool hit = false;
    for (unsigned i = 0; i < 512; ++i) {
      const std::uint64_t m = block.morton << 9 | i;
      const std::array<std::uint16_t, 3> key{static_cast<std::uint16_t>(geometry::compact_bits(m)),
                                             static_cast<std::uint16_t>(geometry::compact_bits(m >> 1)),
                                             static_cast<std::uint16_t>(geometry::compact_bits(m >> 2))};
      if (block.misses[i / 64] >> (i % 64) & 1) touched.misses.insert(key);
      if (block.hits[i / 64] >> (i % 64) & 1) touched.hits.insert(key);
      hit |= (block.hits[i / 64] >> (i % 64) & 1) != 0;
    }
    EXPECT_EQ(block.hit, hit);
  }
  const auto ascending = [](const TouchedBlock& a, const TouchedBlock& b) { return a.morton < b.morton; };
  EXPECT_TRUE(std::is_sorted(blocks.begin(), blocks.end(), ascending));
  return touched;
}

std::vector<octomap::point3d> points_around(std::mt19937_64& rng, const octomap::point3d& origin,
                                            std::size_t n, double near, double far) {
  std::uniform_real_distribution<double> uniform(-1, 1), length(near, far);
  std::vector<octomap::point3d> points;
  while (points.size() < n) {
    octomap::point3d direction(static_cast<float>(uniform(rng)), static_cast<float>(uniform(rng)),
                               static_cast<float>(uniform(rng)));
    // Along an axis or a diagonal now and then: ties and zero components.
    if (rng() % 8 == 0) direction.y() = 0;
    if (rng() % 8 == 0) direction.z() = direction.x();
    if (direction.norm() < 0.1) continue;
    points.push_back(origin + direction.normalized() * static_cast<float>(length(rng)));
  }
  return points;
}

void compare(RayBits& bits, double resolution, const octomap::point3d& origin,
             const std::vector<octomap::point3d>& ends, double max_range) {
  const octomap::OcTree tree(resolution);
  const std::vector<GridRay> rays = rays_to(tree, origin, ends, max_range);
  const GridOrigin from{{origin.x(), origin.y(), origin.z()}, array_of(tree.coordToKey(origin)), resolution};
  const Touched expected = slowly(tree, origin, rays);
  for (const int threads : {1, 2, 3}) {
    const Touched found = read(bits.trace(from, rays, threads));
    EXPECT_EQ(found.misses, expected.misses) << threads << " threads";
    EXPECT_EQ(found.hits, expected.hits) << threads << " threads";
  }
}

TEST(RayBits, AreOctomapsVoxels) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<float> anywhere(-20, 20);
  RayBits bits;  // one for all: nothing may be left over from the scan before
  for (int round = 0; round < 12; ++round) {
    const octomap::point3d origin(anywhere(rng), anywhere(rng), anywhere(rng));
    compare(bits, 0.02 + 0.01 * (round % 4), origin, points_around(rng, origin, 1200, 0.01, 1.5), 100);
  }
}

TEST(RayBits, OfCutRaysAreOctomapsVoxels) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<float> anywhere(-3, 3);
  RayBits bits;
  for (const double max_range : {0.03, 0.5, 1.3}) {
    const octomap::point3d origin(anywhere(rng), anywhere(rng), anywhere(rng));
    compare(bits, 0.05, origin, points_around(rng, origin, 500, 0.01, 3), max_range);
    // On the grid, where every comparison is a tie.
    compare(bits, 0.05, octomap::point3d(0.025F, 0.025F, 0.025F), points_around(rng, {}, 200, 0.1, 3),
            max_range);
  }
}

TEST(RayBits, OfFarRaysAreOctomapsVoxels) {
  std::mt19937_64 rng(test::seed());
  RayBits bits;
  const octomap::point3d origin(1.01F, -2.02F, 0.53F), elsewhere(-7.3F, 4.4F, 12.2F);
  std::vector<octomap::point3d> ends = points_around(rng, origin, 300, 0.1, 3);
  for (const octomap::point3d& stray : points_around(rng, origin, 12, 250, 640)) ends.push_back(stray);
  compare(bits, 0.02, origin, ends, 1e9);
  // A box too large to pass over.
  compare(bits, 0.02, elsewhere, points_around(rng, elsewhere, 400, 0.5, 11), 1e9);
}

/// The bits that LaneWalker sets for the rays, `width` of them side by side.
template <std::size_t width>
std::vector<std::uint64_t> walked(const GridOrigin& from, std::span<const GridRay> rays, bool paged) {
  BlockAddress address;
  RayBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.min[a] = from.key[a] - 60;
    box.max[a] = from.key[a] + 60;
  }
  address.fit(box);
  std::vector<std::uint64_t> bits(std::size_t{1} << (address.size_bits - 6));
  std::vector<std::uint8_t> pages(std::size_t{1} << (address.size_bits - 15));
  LaneWalker walker({bits.data(), paged ? pages.data() : nullptr, address.mask},
                    address.of(from.key[0], from.key[1], from.key[2]));
  std::size_t i = 0;
  walker.run_abreast<width>([&](GridWalk& out) {
    if (i == rays.size()) return false;
    out = GridWalk(rays[i++], from);
    return true;
  });
  for (std::size_t page = 0; paged && page < pages.size(); ++page) {
    const auto first = bits.begin() + static_cast<std::ptrdiff_t>(512 * page);
    EXPECT_EQ(pages[page] != 0, std::any_of(first, first + 512, [](std::uint64_t w) { return w != 0; }));
  }
  return bits;
}

TEST(LaneWalker, SetsTheSameBitsWhateverTheWidth) {
  if (!LaneWalker::supports(4)) GTEST_SKIP() << "this processor walks one ray at a time";
  std::mt19937_64 rng(test::seed());
  const octomap::OcTree tree(0.02);
  const octomap::point3d origin(0.313F, -0.207F, 1.011F);
  const GridOrigin from{{origin.x(), origin.y(), origin.z()}, array_of(tree.coordToKey(origin)), 0.02};
  for (const std::size_t n : {0U, 1U, 5U, 8U, 300U}) {
    const std::vector<GridRay> rays = rays_to(tree, origin, points_around(rng, origin, n, 0.05, 1.1), 9);
    for (const bool paged : {false, true}) {
      const std::vector<std::uint64_t> alone = walked<1>(from, rays, paged);
      EXPECT_TRUE(walked<4>(from, rays, paged) == alone);
      EXPECT_TRUE(!LaneWalker::supports(8) || walked<8>(from, rays, paged) == alone);
    }
  }
}

TEST(RayBits, OfNoRaysAreNone) {
  RayBits bits;
  const GridOrigin from{{0.1F, 0.1F, 0.1F}, {32770, 32770, 32770}, 0.05};
  EXPECT_TRUE(bits.trace(from, {}, 1).empty());
  const std::vector<GridRay> own_voxel{{{0.125F, 0.125F, 0.125F}, {32770, 32770, 32770}, true, true}};
  const Touched touched = read(bits.trace(from, own_voxel, 2));
  EXPECT_TRUE(touched.misses.empty());
  EXPECT_EQ(touched.hits, KeySet{own_voxel.front().key});
}

}  // namespace
}  // namespace octosurf::occupancy
