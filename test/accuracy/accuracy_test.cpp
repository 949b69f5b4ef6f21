// How good maps are, fenced in: a change that makes them worse, or that makes surfaces many or few, fails
// here.
//
// The recordings are short (24 views of a lap instead of 80) and their seeds are fixed on purpose: these are
// not random tests of a property but the same few places measured again after every change. Bounds stand a
// little off the figures measured when they were set, which stand beside them; who moves one says why. The
// whole table, five seeds a scene, is `./dev bench accuracy`.
#include "accuracy/simulated_map.hpp"
#include "evaluation/evaluate.hpp"
#include "support/double_layers.hpp"
#include "support/paths.hpp"
#include "surfaces/map_state.hpp"

#include <cstdio>
#include <filesystem>
#include <gtest/gtest.h>
#include <numbers>
#include <optional>
#include <ostream>

#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

struct Range {
  double low, high;
};

testing::AssertionResult within(double value, const Range& range) {
  if (value >= range.low && value <= range.high) return testing::AssertionSuccess();
  return testing::AssertionFailure() << value << " is outside [" << range.low << ", " << range.high << "]";
}

/// What a recording's map must come to. Shares and means, at least or at most.
struct Fence {
  const char *name, *scene, *sensor;
  Range surfaces;
  double correct, noise;  ///< counts of faces at least, of surfaces at most
  double coverage, multiplicity, unsafe, unsafe_10mm, normal_all_deg, offset_all_mm;
};

void PrintTo(const Fence& fence, std::ostream* out) { *out << fence.name; }

class Accuracy : public testing::TestWithParam<Fence> {};

TEST_P(Accuracy, StaysWhereItIs) {
  const Fence& fence = GetParam();
  simulation::SimulationOptions options;
  options.scene = fence.scene;
  options.sensor = fence.sensor;
  options.seed = 1;  // fixed: bounds lie close to what this recording scores
  options.frames = 24;
  const test::SimulatedMap map(options);
  const evaluation::Evaluation scores = evaluation::evaluate(*map.mapper.snapshot(), map.truth);
  const double unsafe_10mm = scores.unsafe_at(0) / scores.area_m2;
  const double normal_all_deg = scores.normal_all_rad.mean * 180 / std::numbers::pi;
  const double offset_all_mm = scores.offset_all_m.mean * 1000;
  std::printf(
      "%s: %zu surfaces, %zu of %zu faces correct, %zu noise, coverage %.4f, multiplicity %.4f, "
      "unsafe %.4f, at 1 cm %.4f, normal %.3f°, offset %.3f mm\n",
      fence.name, scores.surfaces, scores.correct, scores.faces, scores.noise, scores.coverage,
      scores.multiplicity, scores.unsafe_share, unsafe_10mm, normal_all_deg, offset_all_mm);
  EXPECT_TRUE(within(static_cast<double>(scores.surfaces), fence.surfaces)) << "surfaces";
  EXPECT_GE(static_cast<double>(scores.correct), fence.correct);
  EXPECT_LE(static_cast<double>(scores.noise), fence.noise);
  EXPECT_GE(scores.coverage, fence.coverage);
  EXPECT_LE(scores.multiplicity, fence.multiplicity);
  EXPECT_LE(scores.unsafe_share, fence.unsafe);
  EXPECT_LE(unsafe_10mm, fence.unsafe_10mm);
  EXPECT_LE(normal_all_deg, fence.normal_all_deg);
  EXPECT_LE(offset_all_mm, fence.offset_all_mm);
}

// Each bound with the figure behind it below, measured when one criterion took over from the tuned stages; by
// the real camera at 67393ac. Recordings are short, and the means of normals and offsets are those of one or
// two narrow faces.
// clang-format off
constexpr Fence fences[] = {
    {"room", "room", "depth",       {20, 25},   8,  1, 0.99,   1.01,   0.003,  0.006,  0.25,  0.15},
    //                               20         9   0  0.9988  1.0000  0.0002  0.0018  0.170  0.063
    {"office", "office", "depth",   {100, 118}, 27, 3, 0.99,   1.01,   0.0036, 0.006,  0.9,   0.75},
    //                               109        28  1  0.9934  1.0000  0.0034  0.0041  0.606  0.510
    {"stairs", "stairs", "depth",   {20, 23},   20, 1, 0.9995, 1.01,   0.003,  0.006,  0.75,  0.5},
    //                               21         21  0  0.9999  1.0000  0.0013  0.0036  0.498  0.354
    {"stones", "stones", "depth",   {68, 75},   65, 1, 0.996,  1.01,   0.0035, 0.008,  0.35,  0.35},
    //                               71         67  0  0.9979  1.0000  0.0019  0.0061  0.216  0.213
    {"room_by_real_camera", "room", "depth-real",
                                    {15, 24},   8,  3, 0.985,  1.02,   0.006,  0.010,  0.9,   1.5}};
    //                               19         9   1  0.9979  1.0007  0.0018  0.0046  0.641  0.782
// clang-format on

INSTANTIATE_TEST_SUITE_P(Recordings, Accuracy, testing::ValuesIn(fences),
                         [](const auto& test) { return test.param.name; });

/// What a map of a real recording, of which no truth is known, has too much or too little of when it is bad.
struct Contents {
  double surfaces = 0, large = 0;  ///< those of 0.05 m² and more
  double area_m2 = 0, layers = 0;

  void add(const Map& map) {
    const Snapshot& snapshot = *map.snapshot();
    surfaces += static_cast<double>(snapshot.surfaces.size());
    for (const SurfacePtr& surface : snapshot.surfaces) {
      area_m2 += surface->area_m2;
      large += surface->area_m2 >= 0.05;
    }
    layers += static_cast<double>(test::double_layers(surfaces::state_of(map).surfaces).size());
  }
};

/// Every `every`-th of the kitchen's 300 frames, beginning with `first`, in one map; nothing without the
/// recording.
std::optional<Mapper> kitchen(std::size_t first, std::size_t every) {
  const std::filesystem::path folder = std::filesystem::path(test::paths::data()) / "rgbd_7scenes_redkitchen";
  if (!std::filesystem::is_directory(folder)) return {};
  std::optional<Mapper> mapper(std::in_place, Parameters{});
  const auto source = open_scans({folder});
  source->skip(first);
  while (const auto scan = source->next()) {
    mapper->insert(*scan);
    source->skip(every - 1);
  }
  return mapper;
}

// Which surfaces part and which join may depend on a last digit somewhere, so that changes that mean nothing
// deal a map's counts anew. Maps that begin with other frames show how far apart they then lie: all
// twenty of every twentieth frame have, in the mean and with their standard deviation, 53.4 ± 3.39 surfaces,
// 34.10 ± 2.71 large ones, 13.45 ± 0.18 m² and 1.9 ± 1.18 double layers. A sum of three has three times the
// mean and √3 times the deviation; three of its deviations are left on either side, which chance passes once
// in 370 times.
TEST(AccuracyOfTheKitchen, StaysWhereItIs) {
  Contents all;
  for (const std::size_t first : {0, 4, 8}) {
    const std::optional<Mapper> mapper = kitchen(first, 20);
    if (!mapper) GTEST_SKIP() << "no rgbd_7scenes_redkitchen";
    all.add(mapper->map());
  }
  std::printf("kitchen: %.0f surfaces, %.0f of 0.05 m² and more, %.3f m², %.0f double layers\n", all.surfaces,
              all.large, all.area_m2, all.layers);
  EXPECT_TRUE(within(all.surfaces, {142, 178})) << "surfaces";
  EXPECT_TRUE(within(all.large, {88, 117})) << "large surfaces";
  EXPECT_TRUE(within(all.area_m2, {39.4, 41.3})) << "m²";
  EXPECT_LE(all.layers, 12);
}

// Where what a camera errs in common counted as nothing, and voxels as readings, a map of every third frame
// had 17 surfaces of 7.75 m²: fewer the longer it looked. Three such maps, of which this is the first, have
// in the mean 59.3 surfaces of 14.66 m² and 2.7 double layers. One deviates by 4.5 and 0.24 m², and layers,
// which are counts, by the root of their mean; three deviations are left.
TEST(AccuracyOfTheKitchen, SurfacesStayWhileTheRunGoesOn) {
  std::optional<Mapper> mapper = kitchen(0, 3);
  if (!mapper) GTEST_SKIP() << "no rgbd_7scenes_redkitchen";
  Contents as_it_went;
  as_it_went.add(mapper->map());
  std::printf("kitchen, every third frame: %.0f surfaces, %.3f m², %.0f double layers\n", as_it_went.surfaces,
              as_it_went.area_m2, as_it_went.layers);
  EXPECT_TRUE(within(as_it_went.surfaces, {45, 73})) << "surfaces";
  EXPECT_TRUE(within(as_it_went.area_m2, {13.9, 15.4})) << "m²";
  EXPECT_LE(as_it_went.layers, 7);
}

}  // namespace
}  // namespace octosurf
