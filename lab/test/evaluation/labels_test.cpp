#include "evaluation/labels.hpp"

#include "hand_made.hpp"
#include "simulation/fixture.hpp"
#include "support/paths.hpp"

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
  Json json() const { return Json::parse(to_json(scores())); }
};

TEST(Labels, OneSurfacePerLabelIsCorrectWithItsErrors) {
  Squares squares({4});
  // Through the centroid shifted by 5 mm, turned by 0.5° about it.
  const Eigen::Vector3d centroid(0.145, 0.145, 0);
  squares.add_surface(frame(centroid + Eigen::Vector3d(0, 0, 0.005), radians(0.5)));
  squares.assign(0, 0, 810, 1);
  const double offset = 0.005 * std::cos(radians(0.5));
  expect_in(squares.json(), "labels", 1, "correct", 1, "coverage", 0.9, "mean_iou", 0.9, "normal_deg/mean",
            0.5, "offset_m/mean", offset, "label_scores/0/offset_m", -offset, "noise", 0, "support_iou",
            Json());
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
  expect_in(squares.json(), "label_scores/0/verdict", "over-segmented", "label_scores/1/verdict",
            "under-segmented", "label_scores/2/verdict", "under-segmented", "label_scores/3/verdict",
            "missed", "noise", 1, "surfaces", 4, "points", 3600, "label_scores/1/iou", 0.5);
}

TEST(Labels, OnlyTheSupportIsJudgedInSupportClouds) {
  Squares squares({1, 20});
  squares.cloud.kind = LabelledCloud::Kind::support;
  squares.add_surface(frame({0, 0, 0}));
  squares.add_surface(frame({0, 0, 0}));
  squares.assign(0, 0, 800, 1);
  squares.assign(1, 0, 100, 1);
  squares.assign(1, 100, 800, 2);
  expect_in(squares.json(), "labels", 1, "correct", 1, "noise", 0, "support_iou", 0.8,
            "label_scores/1/verdict", "not judged");
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
  EXPECT_THROW(Squares({0}).scores(), Error) << "no label";
}

class LabelledClouds : public simulation::FolderTest {
 protected:
  const std::string version_ = "VERSION 0.7\n", points_ = "POINTS 2\nDATA ascii\n";
  const std::string plain_ = version_ + "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  const std::string labelled_ = version_ + "FIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n";
  const std::string coloured_ =
      version_ + "FIELDS x y z label rgba\nSIZE 4 4 4 4 4\nTYPE F F F U U\nCOUNT 1 1 1 1 1\n";
  const std::string two_ = "WIDTH 2\nHEIGHT 1\n";
};

TEST_F(LabelledClouds, WhatIsNoneIsRefusedByName) {
  for (const fs::path& path :
       {dir_ / "missing.pcd", dir_, write("empty.pcd", ""), write("foreign.pcd", "this is no cloud\n"),
        write("plain.pcd", plain_ + two_ + points_ + "0 0 0\n1 0 0\n"),
        write("huge.pcd", labelled_ + "WIDTH 2000000000\nHEIGHT 1\nPOINTS 2000000000\nDATA ascii\n"),
        write("short.pcd", labelled_ + two_ + points_ + "0 0 1 7\n")}) {
    const Error error = simulation::refusal(Error::Kind::data, [&path] { load_labelled_cloud(path); });
    EXPECT_THAT(error.what(), testing::HasSubstr(path.filename().string()));
  }
}

TEST_F(LabelledClouds, ColouredLabelsAreATableAndPlainOnesPlanesAtTheirViewpoint) {
  // Turned by 90° about z, then shifted: (1, 0, 1) goes to (0, 1, 1) + (10, 20, 30).
  const std::string pose = "VIEWPOINT 10 20 30 0.70710678 0 0 0.70710678\n";
  const LabelledCloud plain =
      load_labelled_cloud(write("plain.pcd", labelled_ + two_ + pose + points_ + "1 0 1 7\nnan nan nan 0\n"));
  EXPECT_EQ(plain.kind, LabelledCloud::Kind::planes);
  EXPECT_THAT(plain.labels, testing::ElementsAre(7u));
  EXPECT_NEAR((plain.points.at(0) - Eigen::Vector3f(10, 21, 31)).norm(), 0, 1e-5);
  const LabelledCloud coloured =
      load_labelled_cloud(write("coloured.pcd", coloured_ + two_ + points_ + "1 0 1 7 0\n1 0 2 21 0\n"));
  EXPECT_EQ(coloured.kind, LabelledCloud::Kind::support);
  EXPECT_THAT(coloured.labels, testing::ElementsAre(1u, 21u));
}

}  // namespace
}  // namespace octosurf::evaluation
