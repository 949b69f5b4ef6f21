// Which readings may be of two planes, and which neighbours a third plane parts: beside the definition, asked
// anew for every pair.
#include "detection/junctions.hpp"

#include "detection/constants.hpp"
#include "support/pending_points.hpp"
#include "support/scene.hpp"

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

/// A wall, and a board of 3 cm that stands out of its lower half, turned by some angle; of the board one side
/// is seen, of the wall what is beside both. Each reading has the label of the face that it is nearest to.
class WallAndBoard {
 public:
  static constexpr Label wall = 1;
  static constexpr double half_thickness = 0.015, board_top = 0.7;

  explicit WallAndBoard(std::mt19937_64& rng)
      : turn_(std::uniform_real_distribution(0.0, 6.28)(rng), Eigen::Vector3d::UnitZ()),
        points_(look(rng)),
        readings_(points_.ledger) {
    for (const Eigen::Vector4d& face : faces()) {
      Patch patch;
      patch.plane = {turn_ * face.head<3>(), face.w()};
      patches_.push_back(patch);
    }
    for (Index i = 0; i < readings_.size(); ++i) labels_.push_back(nearest_face(i));
  }

  /// In the frame in which the wall is x = 0 and the board y = 0.
  Eigen::Vector3d at(Index i) const { return turn_.inverse() * readings_[i].position.cast<double>(); }
  const Readings& readings() const { return readings_; }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Patch>& patches() const { return patches_; }
  Junctions junctions() const { return {readings_, labels_, patches_}; }

 private:
  /// Normals and offsets; first of clutter.
  static std::vector<Eigen::Vector4d> faces() {
    return {Eigen::Vector4d::Zero(), {1, 0, 0, 0}, {0, -1, 0, half_thickness}, {0, 1, 0, half_thickness}};
  }

  std::vector<Scan> look(std::mt19937_64& rng) const {
    test::Scene scene;
    const auto rectangle = [&](Eigen::Vector3d from, Eigen::Vector3d a, Eigen::Vector3d b) {
      scene.rectangle(turn_ * from, turn_ * a, turn_ * b);
    };
    rectangle({0, -1, 0}, {0, 2, 0}, {0, 0, 1.4});
    for (const double side : {-half_thickness, half_thickness})
      rectangle({0, side, 0}, {0.3, 0, 0}, {0, 0, board_top});
    rectangle({0.3, -half_thickness, 0}, {0, 2 * half_thickness, 0}, {0, 0, board_top});
    std::vector<Scan> scans;
    for (const double y : {0.0, 0.7})
      scans.push_back(test::camera_scan(
          scene, test::look_at(turn_ * Eigen::Vector3d(1.3, y, 0.7), turn_ * Eigen::Vector3d(0, 0, 0.7)),
          rng));
    return scans;
  }

  Label nearest_face(Index i) const {
    const Eigen::Vector3d p = at(i);
    Label nearest = clutter;
    double least = 0.01;
    for (Label label = 1; label < patches_.size(); ++label) {
      if (label != wall && p.z() > board_top) continue;
      const double distance = std::fabs(readings_[i].distance(patches_[label].plane));
      if (distance >= least) continue;
      least = distance;
      nearest = label;
    }
    return nearest;
  }

  Eigen::AngleAxisd turn_;
  test::PendingPoints points_;
  Readings readings_;
  std::vector<Patch> patches_;
  std::vector<Label> labels_;
};

TEST(Junctions, AreWhatTheyAreDefinedAs) {
  std::mt19937_64 rng = test::rng();
  const WallAndBoard scene(rng);
  const Readings& readings = scene.readings();
  const std::vector<Label>& labels = scene.labels();
  const Junctions junctions = scene.junctions();
  const auto plane_of = [&](Index k) -> const Plane& { return scene.patches()[labels[k]].plane; };
  const auto at_angle = [&](Index i, Index k) {
    return labels[i] != clutter && labels[k] != clutter &&
           std::fabs(plane_of(i).normal.dot(plane_of(k).normal)) < Constants::cos_nearly_parallel;
  };
  std::size_t ambiguous = 0, parted = 0;
  for (Index i = 0; i < readings.size(); ++i) {
    const auto near = readings.near(i);
    EXPECT_EQ(junctions.ambiguous(i), std::any_of(near.begin(), near.end(), [&](Index k) {
                return labels[i] != clutter && labels[k] != clutter && labels[k] != labels[i] &&
                       plane_of(i).normal.dot(plane_of(k).normal) < Constants::cos_nearly_parallel &&
                       readings.gain(i, plane_of(k)) > 0;
              }));
    ambiguous += junctions.ambiguous(i);
    for (const Index j : near) {
      const auto passes = [&](Index beside) {
        const auto around = readings.near(beside);
        return std::any_of(around.begin(), around.end(), [&](Index k) {
          return at_angle(beside, k) &&
                 readings[i].distance(plane_of(k)) * readings[j].distance(plane_of(k)) < 0;
        });
      };
      ASSERT_EQ(junctions.separated_by_plane(i, j), passes(i) || passes(j));
      parted += junctions.separated_by_plane(i, j);
    }
  }
  EXPECT_GT(ambiguous, 0U);
  EXPECT_GT(parted, 0U);
}

TEST(Junctions, RenewedAreThoseOfTheNewLabels) {
  std::mt19937_64 rng = test::rng();
  const WallAndBoard scene(rng);
  // One side of the board is given up, the other renamed, and the planes move a little.
  std::vector<Label> labels = scene.labels();
  const std::vector<Label> into{clutter, 2, clutter, 1};
  for (Label& label : labels) label = into[label];
  std::vector<Patch> patches{scene.patches()[0], scene.patches()[3], scene.patches()[1]};
  std::normal_distribution<double> by(0, 0.003);
  for (Patch& patch : patches) patch.plane.offset += by(rng);
  Junctions renewed = scene.junctions();
  renewed.renew(labels, patches);
  const Junctions anew(scene.readings(), labels, patches);
  for (Index i = 0; i < scene.readings().size(); ++i) {
    EXPECT_EQ(renewed.ambiguous(i), anew.ambiguous(i));
    for (const Index j : scene.readings().near(i))
      EXPECT_EQ(renewed.separated_by_plane(i, j), anew.separated_by_plane(i, j));
  }
  EXPECT_TRUE(std::includes(renewed.contacts().begin(), renewed.contacts().end(), anew.contacts().begin(),
                            anew.contacts().end()));
  EXPECT_FALSE(anew.contacts().empty());
}

}  // namespace
}  // namespace octosurf::detection
