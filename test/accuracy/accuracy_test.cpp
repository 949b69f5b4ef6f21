// How good maps are, fenced in: a change that makes them worse, or that makes surfaces many or few, fails
// here.
//
// The recordings are short (24 views of a lap instead of 80) and their seeds are fixed on purpose: these are
// not random tests of a property but the same few places measured again after every change. Bounds stand a
// little off the figures measured when they were set, which stand beside them; who moves one says why. The
// whole table, five seeds a scene, is `./dev bench accuracy`.
#include "accuracy/simulated_map.hpp"
#include "evaluation/evaluate.hpp"
#include "simulation/recording.hpp"
#include "support/double_layers.hpp"
#include "support/paths.hpp"
#include "surfaces/map_state.hpp"

#include <cstdio>
#include <filesystem>
#include <gtest/gtest.h>
#include <numbers>
#include <optional>
#include <ostream>

#include <octosurf/mapper.hpp>
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

/// What a recording's map must come to.
struct Fence {
  const char* name;
  const char* scene;
  const char* sensor;
  Range surfaces;         ///< count
  double correct;         ///< faces, at least
  double noise;           ///< surfaces, at most
  double coverage;        ///< share, at least
  double multiplicity;    ///< at most
  double unsafe;          ///< share, at most
  double unsafe_10mm;     ///< share, at most
  double normal_all_deg;  ///< mean, at most
  double offset_all_mm;   ///< mean, at most
};

void PrintTo(const Fence& fence, std::ostream* out) { *out << fence.name; }

class Accuracy : public testing::TestWithParam<Fence> {};

evaluation::Evaluation measure(const Fence& fence) {
  simulation::SimulationOptions options;
  options.scene = fence.scene;
  options.sensor = fence.sensor;
  options.seed = 1;  // fixed: bounds lie close to what this recording scores
  options.frames = 24;
  const test::SimulatedMap map(options);
  return evaluation::evaluate(*map.mapper.snapshot(), map.truth);
}

TEST_P(Accuracy, StaysWhereItIs) {
  const Fence& fence = GetParam();
  const evaluation::Evaluation scores = measure(fence);
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

// Each bound with the figure behind it, measured when one criterion took over from the tuned stages.
// Recordings are short, and the means of normals and offsets are those of one or two narrow faces.
constexpr Fence room{.name = "room",
                     .scene = "room",
                     .sensor = "depth",
                     .surfaces = {20, 25},    // 20
                     .correct = 8,            // 9 of 10
                     .noise = 1,              // 0
                     .coverage = 0.99,        // 0.9988
                     .multiplicity = 1.01,    // 1.0000
                     .unsafe = 0.003,         // 0.0002
                     .unsafe_10mm = 0.006,    // 0.0018
                     .normal_all_deg = 0.25,  // 0.170
                     .offset_all_mm = 0.15};  // 0.063

constexpr Fence office{
    .name = "office",
    .scene = "office",
    .sensor = "depth",
    .surfaces = {100, 118},  // 109
    .correct = 27,           // 28 of 37; 29 of 42 before faces of one plane were one: a shelf's fronts
    .noise = 3,              // 1
    .coverage = 0.99,        // 0.9934
    .multiplicity = 1.01,    // 1.0000
    .unsafe = 0.0036,        // 0.0034, of it 0.0007 one surface; all twelve of the gate: 0.0048
    .unsafe_10mm = 0.006,    // 0.0041
    .normal_all_deg = 0.9,   // 0.606
    .offset_all_mm = 0.75};  // 0.510

constexpr Fence stairs{.name = "stairs",
                       .scene = "stairs",
                       .sensor = "depth",
                       .surfaces = {20, 23},    // 21
                       .correct = 20,           // 21 of 21
                       .noise = 1,              // 0
                       .coverage = 0.9995,      // 0.9999; 0.9991 where rims end before edges
                       .multiplicity = 1.01,    // 1.0000
                       .unsafe = 0.003,         // 0.0013
                       .unsafe_10mm = 0.006,    // 0.0036
                       .normal_all_deg = 0.75,  // 0.498
                       .offset_all_mm = 0.5};   // 0.354

constexpr Fence stones{.name = "stones",
                       .scene = "stones",
                       .sensor = "depth",
                       .surfaces = {68, 75},    // 71
                       .correct = 65,           // 67 of 71
                       .noise = 1,              // 0
                       .coverage = 0.996,       // 0.9979; 0.9928 where rims end before edges
                       .multiplicity = 1.01,    // 1.0000
                       .unsafe = 0.0035,        // 0.0019
                       .unsafe_10mm = 0.008,    // 0.0061
                       .normal_all_deg = 0.35,  // 0.216
                       .offset_all_mm = 0.35};  // 0.213

// Measured at 67393ac. The mean of the normals is that of one narrow face, which is 5° off. Surfaces: since
// outlines go on to where surfaces meet, scans are aligned with more of each, and 19 are left of 24, the
// faces and their errors as before.
constexpr Fence room_by_real_camera{.name = "room_by_real_camera",
                                    .scene = "room",
                                    .sensor = "depth-real",
                                    .surfaces = {15, 24},   // 19
                                    .correct = 8,           // 9 of 10
                                    .noise = 3,             // 1
                                    .coverage = 0.985,      // 0.9979
                                    .multiplicity = 1.02,   // 1.0007
                                    .unsafe = 0.006,        // 0.0018
                                    .unsafe_10mm = 0.010,   // 0.0046
                                    .normal_all_deg = 0.9,  // 0.641
                                    .offset_all_mm = 1.5};  // 0.782

INSTANTIATE_TEST_SUITE_P(Recordings, Accuracy,
                         testing::Values(room, office, stairs, stones, room_by_real_camera),
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
// in the mean 59.3 surfaces of 14.66 m² and 2.7 double layers; with all points looked at once, as resegment()
// does, 43.3 of 13.24 m² and 3.3: the far wall, which some scans' poses have doubled, is whole in some and
// half in others. One deviates by 4.5 and 0.24 m², at once by 4.5 and 0.66 m², and layers, which are counts,
// by the root of their mean; three deviations are left.
TEST(AccuracyOfTheKitchen, SurfacesStayWhileTheRunGoesOn) {
  std::optional<Mapper> mapper = kitchen(0, 3);
  if (!mapper) GTEST_SKIP() << "no rgbd_7scenes_redkitchen";
  Contents as_it_went, at_once;
  as_it_went.add(mapper->map());
  mapper->resegment();
  at_once.add(mapper->map());
  for (const auto& [name, all] : {std::pair("as it went", as_it_went), std::pair("at once", at_once)})
    std::printf("kitchen, every third frame, %s: %.0f surfaces, %.3f m², %.0f double layers\n", name,
                all.surfaces, all.area_m2, all.layers);
  EXPECT_TRUE(within(as_it_went.surfaces, {45, 73})) << "surfaces";
  EXPECT_TRUE(within(as_it_went.area_m2, {13.9, 15.4})) << "m²";
  EXPECT_LE(as_it_went.layers, 7);
  EXPECT_TRUE(within(at_once.surfaces, {29, 57})) << "surfaces";
  EXPECT_TRUE(within(at_once.area_m2, {11.2, 15.3})) << "m²";
  EXPECT_LE(at_once.layers, 8);
}

}  // namespace
}  // namespace octosurf
