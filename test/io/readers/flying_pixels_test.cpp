#include "io/readers/depth_image.hpp"

#include <gtest/gtest.h>
#include <tuple>

namespace octosurf::io {
namespace {

constexpr std::size_t width = 40, height = 32;

/// depth(u, v): m.
template <class Depth>
std::vector<float> image(const Depth& depth) {
  std::vector<float> pixels;
  for (std::size_t v = 0; v < height; ++v)
    for (std::size_t u = 0; u < width; ++u) pixels.push_back(static_cast<float>(depth(u, v)));
  return pixels;
}

std::vector<float> cleaned(std::vector<float> depth) {
  erase_flying_pixels(depth, width);
  return depth;
}

/// A front at 1.5 m and a back at 2.3 m, with these depths between them.
std::vector<float> edge(const std::vector<double>& ramp, bool upright) {
  return image([&](std::size_t u, std::size_t v) {
    const std::size_t along = upright ? u : v, begin = 15;
    if (along < begin) return 1.5;
    return along < begin + ramp.size() ? ramp[along - begin] : 2.3;
  });
}

class FlyingPixels : public ::testing::TestWithParam<std::tuple<std::vector<double>, bool>> {};

TEST_P(FlyingPixels, OfARampAreErasedAndItsSurfacesStay) {
  const auto& [ramp, upright] = GetParam();
  const std::vector<float> depth = edge(ramp, upright), clean = cleaned(depth);
  std::size_t missing = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const bool flies = depth[i] != 1.5F && depth[i] != 2.3F;
    EXPECT_EQ(clean[i], flies ? 0 : depth[i]) << "column " << i % width << ", row " << i / width;
    missing += clean[i] == 0;
  }
  EXPECT_EQ(missing, ramp.size() * (upright ? height : width));
}
INSTANTIATE_TEST_SUITE_P(, FlyingPixels,
                         ::testing::Combine(::testing::Values(std::vector{1.9}, std::vector{1.7, 2.1},
                                                              std::vector{1.9, 1.9},
                                                              std::vector{1.7, 1.7, 2.1, 2.1}),
                                            ::testing::Bool()));

TEST(FlyingPixelsOf, SurfacesAreNone) {
  const auto expect_kept = [](const char* what, const std::vector<float>& depth) {
    EXPECT_EQ(cleaned(depth), depth) << what;
  };
  // A floor seen at 3° from 0.3 m above changes by decimetres a pixel.
  expect_kept("plane", image([](std::size_t, std::size_t v) { return 90 / (3.0 + static_cast<double>(v)); }));
  for (const double slant : {0.02, 0.05, 0.1})
    expect_kept("a slanted table up to its edge before a wall", image([&](std::size_t u, std::size_t) {
                  return u < 20 ? 1 / (0.8 - 0.1 * slant * (static_cast<double>(u) - 20)) : 4.0;
                }));
  expect_kept("pole", image([](std::size_t u, std::size_t) { return u == 20 ? 1.0 : 2.0; }));
  expect_kept("gap", image([](std::size_t u, std::size_t) { return u == 20 ? 2.0 : 1.0; }));
  // Stairs seen from below: each is between a nearer and a farther one.
  expect_kept("steps",
              image([](std::size_t, std::size_t v) { return 1 + 0.3 * static_cast<double>(v / 9); }));
}

TEST(FlyingPixelsOf, ImagesOfAnySizeAreRead) {
  for (const std::size_t size : {0, 1, 5, 12, 13}) {
    std::vector<float> depth(size * size, 1.F);
    erase_flying_pixels(depth, size);
    EXPECT_EQ(depth, std::vector<float>(size * size, 1.F));
  }
}

}  // namespace
}  // namespace octosurf::io
