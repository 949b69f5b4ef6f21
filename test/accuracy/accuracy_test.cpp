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
#include "support/paths.hpp"

#include <cstdio>
#include <filesystem>
#include <gtest/gtest.h>
#include <numbers>
#include <ostream>
#include <vector>

#include <octosurf/diagnosis.hpp>
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
                     .surfaces = {20, 25},    // 22
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
    .correct = 26,           // 27 of 37; 29 of 42 before faces of one plane were one: a shelf's fronts
    .noise = 3,              // 1
    .coverage = 0.99,        // 0.9934
    .multiplicity = 1.01,    // 1.0000
    .unsafe = 0.003,         // 0.0019
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

  void add(const Snapshot& snapshot) {
    surfaces += static_cast<double>(snapshot.surfaces.size());
    for (const SurfacePtr& surface : snapshot.surfaces) {
      area_m2 += surface->area_m2;
      large += surface->area_m2 >= 0.05;
    }
    layers += static_cast<double>(double_layers(snapshot).size());
  }
};

// Every twentieth of the kitchen's 300 frames: five maps that begin four frames apart, counted together.
//
// Which surfaces part and which join may depend on a last digit somewhere, so that changes that mean nothing
// deal a map's counts anew. How far apart they then lie is what maps tell that begin with other frames. All
// twenty have, in the mean and with their standard deviation, 53.4 ± 3.39 surfaces, 34.10 ± 2.71 large ones,
// 13.45 ± 0.18 m² and 1.9 ± 1.18 double layers. A sum of five has five times the mean and √5 times the
// deviation; three of its deviations are left on either side, which chance passes once in 370 times.
TEST(AccuracyOfTheKitchen, StaysWhereItIs) {
  const std::filesystem::path kitchen =
      std::filesystem::path(test::paths::data()) / "rgbd_7scenes_redkitchen";
  if (!std::filesystem::is_directory(kitchen)) GTEST_SKIP() << kitchen << " is missing";
  constexpr std::size_t apart = 4, every = 20;
  std::vector<Mapper> mappers(every / apart);
  const auto source = open_scans({kitchen});
  for (std::size_t i = 0; const auto scan = source->next(); ++i)
    if (i % apart == 0) mappers[i % every / apart].insert(*scan);
  Contents all;
  for (const Mapper& mapper : mappers) all.add(*mapper.snapshot());
  std::printf("kitchen: %.0f surfaces, %.0f of 0.05 m² and more, %.3f m², %.0f double layers\n", all.surfaces,
              all.large, all.area_m2, all.layers);
  EXPECT_TRUE(within(all.surfaces, {244, 290})) << "surfaces";     // 256
  EXPECT_TRUE(within(all.large, {152, 189})) << "large surfaces";  // 164
  EXPECT_TRUE(within(all.area_m2, {66, 68.5})) << "m²";            // 66.374
  EXPECT_LE(all.layers, 18);                                       // 10
}

// Every third of the 300 frames in one map: three maps that begin with the first, second and third frame,
// counted together. Where what a camera errs in common counted as nothing, and voxels as readings, such a map
// had 17 surfaces of 7.75 m²: fewer the longer it looked. With and without small planes looked at earlier,
// one has 49.7 ± 4.5 surfaces and 14.42 ± 0.24 m², and with all its points looked at once, as resegment()
// does, 38.3 ± 4.5 and 12.59 ± 0.66, with 1.5 ± 0.55 double layers: the far wall, which some scans' poses
// have doubled, is whole in some and half in others. Bounds are three deviations of a sum of three, of these
// or, where they are larger, of the maps above.
TEST(AccuracyOfTheKitchen, SurfacesStayWhileTheRunGoesOn) {
  const std::filesystem::path kitchen =
      std::filesystem::path(test::paths::data()) / "rgbd_7scenes_redkitchen";
  if (!std::filesystem::is_directory(kitchen)) GTEST_SKIP() << kitchen << " is missing";
  Contents as_it_went, at_once;
  for (std::size_t first = 0; first < 3; ++first) {
    Mapper mapper{Parameters{}};
    const auto source = open_scans({kitchen});
    for (std::size_t i = 0; const auto scan = source->next(); ++i)
      if (i % 3 == first) mapper.insert(*scan);
    as_it_went.add(*mapper.snapshot());
    mapper.resegment();
    at_once.add(*mapper.snapshot());
  }
  for (const auto& [name, all] : {std::pair("as it went", as_it_went), std::pair("at once", at_once)})
    std::printf("kitchen, every third frame, three maps, %s: %.0f surfaces, %.3f m², %.0f double layers\n",
                name, all.surfaces, all.area_m2, all.layers);
  // Since poses stay as given here, 178 and 130 surfaces and ten double layers at once, which are the poses'
  // own: counts, of which three deviations are allowed.
  EXPECT_TRUE(within(as_it_went.surfaces, {138, 218})) << "surfaces";  // 178
  EXPECT_TRUE(within(as_it_went.area_m2, {40.8, 45.7})) << "m²";       // 43.97
  EXPECT_LE(as_it_went.layers, 20);                                    // 8
  EXPECT_TRUE(within(at_once.surfaces, {96, 164})) << "surfaces";      // 130
  EXPECT_TRUE(within(at_once.area_m2, {34.3, 41.2})) << "m²";          // 39.72
  EXPECT_LE(at_once.layers, 19);                                       // 10
}

}  // namespace
}  // namespace octosurf
