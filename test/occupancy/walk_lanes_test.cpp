// Rays walked side by side set the bits that each sets alone.
#include "occupancy/walk_lanes.hpp"

#include "geometry/voxel_grid.hpp"
#include "occupancy/block_bits.hpp"
#include "support/testing.hpp"

namespace octosurf::occupancy {
namespace {

/// The bits that LaneWalker sets for the rays, `width` of them side by side.
template <std::size_t width>
std::vector<std::uint64_t> walked(const GridOrigin& from, std::span<const GridRay> rays, bool paged) {
  BlockAddress address;
  KeyBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] = from.key[a] - 60;
    box.high[a] = from.key[a] + 60;
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
  std::uniform_int_distribution<int> voxels(-55, 55);
  const geometry::VoxelGrid grid(0.02);
  const GridOrigin from{{0.313F, -0.207F, 1.011F}, {32783, 32757, 32818}, 0.02};
  for (const std::size_t n : {0U, 1U, 5U, 8U, 300U}) {
    std::vector<GridRay> rays(n);
    for (GridRay& ray : rays)
      for (std::size_t a = 0; a < 3; ++a) {
        ray.key[a] = static_cast<std::uint16_t>(from.key[a] + voxels(rng));
        ray.end[a] = grid.centre_of(ray.key[a]);
      }
    for (const bool paged : {false, true}) {
      const std::vector<std::uint64_t> alone = walked<1>(from, rays, paged);
      EXPECT_TRUE(walked<4>(from, rays, paged) == alone);
      EXPECT_TRUE(!LaneWalker::supports(8) || walked<8>(from, rays, paged) == alone);
    }
  }
}

}  // namespace
}  // namespace octosurf::occupancy
