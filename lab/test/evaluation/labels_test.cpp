#include "evaluation/labels.hpp"

#include "hand_made.hpp"
#include "support/paths.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <map>
#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

using namespace hand_made;
namespace fs = std::filesystem;

/// Squares of 30 × 30 points, 1 cm apart, side by side in the plane z = 0, one label each.
struct Squares {
  World world;
  LabelledCloud cloud;
  std::vector<Eigen::Vector3d> points;
  std::vector<SurfaceId> found;

  explicit Squares(const std::vector<std::uint32_t>& labels) {
    for (std::size_t k = 0; k < labels.size(); ++k) {
      for (int i = 0; i < 900; ++i) {
        points.emplace_back(0.01 * (i % 30) + static_cast<double>(k), 0.01 * (i / 30), 0);
        cloud.labels.push_back(labels[k]);
      }
    }
    found.assign(points.size(), 0);
  }

  /// Gives `count` points of a square, from `first` on, to a surface.
  void assign(std::size_t square, int first, int count, SurfaceId surface) {
    for (int i = first; i < first + count; ++i) found[900 * square + static_cast<std::size_t>(i)] = surface;
  }
  void add_surface(const Eigen::Isometry3d& T) { world.add_surface(T, {polygon(box(0, 0, 1, 1))}); }
  LabelEvaluation scores() const { return evaluate_labels(cloud, points, found, world.snapshot); }
};

TEST(Labels, OneSurfacePerLabelIsCorrectWithItsErrors) {
  Squares squares({4});
  // Through the centroid shifted by 5 mm, turned by 0.5° about it.
  const Eigen::Vector3d centroid(0.145, 0.145, 0);
  squares.add_surface(frame(centroid + Eigen::Vector3d(0, 0, 0.005), radians(0.5)));
  squares.assign(0, 0, 810, 1);
  const LabelEvaluation scores = squares.scores();
  EXPECT_EQ(scores.labels, 1u);
  EXPECT_EQ(scores.correct, 1u);
  EXPECT_NEAR(scores.coverage, 0.9, 1e-12);
  EXPECT_NEAR(scores.mean_iou, 0.9, 1e-12);
  EXPECT_NEAR(scores.normal_rad.mean, radians(0.5), 1e-9);
  EXPECT_NEAR(scores.offset_m.mean, 0.005 * std::cos(radians(0.5)), 1e-9);
  EXPECT_LT(scores.label_scores.at(0).offset_m, 0);
  EXPECT_EQ(scores.noise, 0u);
  EXPECT_FALSE(scores.support_iou);
}

TEST(Labels, VerdictsFollowThePointSets) {
  Squares squares({1, 2, 3, 4, 0});
  for (int i = 0; i < 5; ++i) squares.add_surface(frame({0, 0, 0}));
  squares.assign(0, 0, 450, 1);  // label 1: two halves
  squares.assign(0, 450, 450, 2);
  squares.assign(1, 0, 900, 3);  // labels 2 and 3: one surface
  squares.assign(2, 0, 900, 3);
  squares.assign(3, 0, 400, 4);  // label 4: less than half
  squares.assign(4, 0, 900, 5);  // unlabelled: left out
  const LabelEvaluation scores = squares.scores();
  EXPECT_EQ(scores.label_scores.at(0).verdict, TruthVerdict::over_segmented);
  EXPECT_EQ(scores.label_scores.at(1).verdict, TruthVerdict::under_segmented);
  EXPECT_EQ(scores.label_scores.at(2).verdict, TruthVerdict::under_segmented);
  EXPECT_EQ(scores.label_scores.at(3).verdict, TruthVerdict::missed);
  EXPECT_EQ(scores.noise, 1u);
  EXPECT_EQ(scores.surfaces, 4u);
  EXPECT_EQ(scores.points, 3600u);
  EXPECT_NEAR(scores.label_scores.at(1).iou, 0.5, 1e-12);
}

TEST(Labels, OnlyTheSupportIsJudgedInSupportClouds) {
  Squares squares({1, 20});
  squares.cloud.kind = LabelledCloud::Kind::support;
  squares.add_surface(frame({0, 0, 0}));
  squares.add_surface(frame({0, 0, 0}));
  squares.assign(0, 0, 800, 1);
  squares.assign(1, 0, 100, 1);
  squares.assign(1, 100, 800, 2);
  const LabelEvaluation scores = squares.scores();
  EXPECT_EQ(scores.labels, 1u);
  EXPECT_EQ(scores.correct, 1u);
  EXPECT_EQ(scores.noise, 0u);
  ASSERT_TRUE(scores.support_iou);
  EXPECT_NEAR(*scores.support_iou, 800.0 / 1000.0, 1e-12);
  const auto json = nlohmann::json::parse(to_json(scores));
  EXPECT_NEAR(json.at("support_iou").get<double>(), 0.8, 1e-12);
  EXPECT_EQ(json.at("label_scores").at(1).at("verdict"), "not judged");
}

TEST(Labels, NonsenseIsRefused) {
  Squares squares({1});
  squares.found.pop_back();
  EXPECT_THROW(squares.scores(), Error);
  squares.found.push_back(7);  // no such surface
  EXPECT_THROW(squares.scores(), Error);
  squares.found.back() = 0;
  EXPECT_EQ(squares.scores().missed, 1u);
  squares.points.back().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(squares.scores(), Error);
  Squares unlabelled({0});
  EXPECT_THROW(unlabelled.scores(), Error);
  EXPECT_THROW((LabelOptions{2, 0.02, 0.8}.validate()), Error);
  EXPECT_THROW((LabelOptions{300, -1, 0.8}.validate()), Error);
  EXPECT_THROW((LabelOptions{300, 0.02, 0.5}.validate()), Error);
}

TEST(LabelledCloud, WhatIsNoneIsRefusedByName) {
  const fs::path folder = fs::path(testing::TempDir()) / "octosurf_labelled_cloud";
  fs::create_directories(folder);
  const auto refused = [](const fs::path& path) {
    try {
      load_labelled_cloud(path);
    } catch (const Error& error) {
      return error.kind() == Error::Kind::data &&
             std::string(error.what()).find(path.filename().string()) != std::string::npos;
    }
    return false;
  };
  const auto write = [&folder](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return folder / name;
  };
  const std::string head = "# .PCD v0.7\nVERSION 0.7\n";
  const std::string two = "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n";
  EXPECT_TRUE(refused(folder / "missing.pcd"));
  EXPECT_TRUE(refused(folder));
  EXPECT_TRUE(refused(write("empty.pcd", "")));
  EXPECT_TRUE(refused(write("foreign.pcd", "this is no cloud\n")));
  EXPECT_TRUE(refused(write(
      "plain.pcd", head + "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n" + two + "0 0 0\n1 0 0\n")));
  EXPECT_TRUE(
      refused(write("huge.pcd", head + "FIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
                                       "WIDTH 2000000000\nHEIGHT 1\nPOINTS 2000000000\nDATA ascii\n")));
  EXPECT_TRUE(
      refused(write("short.pcd", head + "FIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n" +
                                     two + "0 0 1 7\n")));
  fs::remove_all(folder);
}

TEST(LabelledCloud, ColouredLabelsAreATableAndPlainOnesPlanesAtTheirViewpoint) {
  const fs::path folder = fs::path(testing::TempDir()) / "octosurf_labelled_kinds";
  fs::create_directories(folder);
  const std::string size = "WIDTH 2\nHEIGHT 1\n", points = "POINTS 2\nDATA ascii\n";
  // Turned by 90° about z, then shifted: (1, 0, 1) goes to (0, 1, 1) + (10, 20, 30).
  const std::string pose = "VIEWPOINT 10 20 30 0.70710678 0 0 0.70710678\n";
  std::ofstream(folder / "plain.pcd") << "VERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\n"
                                      << "COUNT 1 1 1 1\n"
                                      << size << pose << points << "1 0 1 7\nnan nan nan 0\n";
  std::ofstream(folder / "coloured.pcd")
      << "VERSION 0.7\nFIELDS x y z label rgba\nSIZE 4 4 4 4 4\nTYPE F F F U U\nCOUNT 1 1 1 1 1\n"
      << size << points << "1 0 1 7 0\n1 0 2 21 0\n";
  const LabelledCloud plain = load_labelled_cloud(folder / "plain.pcd");
  EXPECT_EQ(plain.kind, LabelledCloud::Kind::planes);
  EXPECT_THAT(plain.labels, testing::ElementsAre(7u));
  EXPECT_NEAR((plain.points.at(0) - Eigen::Vector3f(10, 21, 31)).norm(), 0, 1e-5);
  const LabelledCloud coloured = load_labelled_cloud(folder / "coloured.pcd");
  EXPECT_EQ(coloured.kind, LabelledCloud::Kind::support);
  EXPECT_THAT(coloured.labels, testing::ElementsAre(1u, 21u));
  fs::remove_all(folder);
}

/// Scores of a detector that returns the labels themselves, with planes that do not matter here.
LabelEvaluation scores_of_the_labels(const LabelledCloud& cloud) {
  World world;
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& point : cloud.points) points.push_back(point.cast<double>());
  const std::uint32_t last = *std::max_element(cloud.labels.begin(), cloud.labels.end());
  for (std::uint32_t i = 1; i <= last; ++i) world.add_surface(frame({0, 0, 0}), {});
  return evaluate_labels(cloud, points, cloud.labels, world.snapshot);
}

// What the data's README files say was checked by other means.
TEST(LabelledCloud, EvopsFrameReadsAsSeventeenPlanes) {
  const fs::path folder = fs::path(test::paths::data()) / "labelled_evops_icl";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const LabelledCloud cloud = load_labelled_cloud(folder);
  EXPECT_EQ(cloud.kind, LabelledCloud::Kind::planes);
  const LabelEvaluation scores = scores_of_the_labels(cloud);
  EXPECT_EQ(scores.label_scores.size(), 17u);
  EXPECT_NEAR(static_cast<double>(scores.points), 273e3, 1e3);
  for (const LabelScore& label : scores.label_scores) {
    EXPECT_TRUE(label.points < 300 || label.rms_m < 0.0027) << label.label << ": " << label.rms_m;
  }
  EXPECT_EQ(scores.correct, scores.labels);
  EXPECT_EQ(scores.noise, 0u);
}

TEST(LabelledCloud, SynpebScanReadsAsThirtyEightPlanes) {
  const fs::path file = fs::path(test::paths::data()) / "labelled_synpeb_sample" / "test_500.pcd";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is missing";
  const LabelEvaluation scores = scores_of_the_labels(load_labelled_cloud(file));
  EXPECT_EQ(scores.label_scores.size(), 39u);
  EXPECT_EQ(scores.points, 250000u);
  for (const LabelScore& label : scores.label_scores) {
    EXPECT_EQ(label.rms_m < 0.005, label.label != 3) << label.label << ": " << label.rms_m;
  }
  EXPECT_EQ(scores.correct, scores.labels);
}

TEST(LabelledCloud, MosdFramesReadAsOneTableEach) {
  const fs::path folder = fs::path(test::paths::data()) / "labelled_mosd";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
  for (const char* name : {"setup_A/learn17.pcd", "setup_B/learn3.pcd"}) {
    const LabelledCloud cloud = load_labelled_cloud(folder / name);
    EXPECT_EQ(cloud.kind, LabelledCloud::Kind::support);
    EXPECT_THAT(cloud.labels, testing::Each(testing::AnyOf(1u, testing::Ge(20u)))) << name;
    const LabelEvaluation scores = scores_of_the_labels(cloud);
    EXPECT_EQ(scores.labels, 1u);
    EXPECT_EQ(scores.support_iou, 1.0);
    EXPECT_GT(scores.label_scores.at(0).rms_m, 0.0015) << name;
    EXPECT_LT(scores.label_scores.at(0).rms_m, 0.0020) << name;
  }
}

}  // namespace
}  // namespace octosurf::evaluation
