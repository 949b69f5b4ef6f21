// A biped's contacts up the mapped stairs of hpp-environments, judged anew constraint by constraint.
#include "contact_sequence.hpp"

#include "evaluation/planar_region.hpp"
#include "simulation/recording.hpp"
#include "support/paths.hpp"
#include "support/seed.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <utility>

#include <octosurf/contact.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/up.hpp>

namespace octosurf::examples {
namespace {

constexpr double exact = 1e-5;  // m, as plan_contacts() promises

Eigen::Vector3d middle_of(const evaluation::TrueFace& face) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : face.polygons)
    for (const Eigen::Vector2d& uv : polygon.outer) box.extend(uv);
  return face.T_map_face * Eigen::Vector3d(box.center().x(), box.center().y(), 0);
}

/// The mesh `bauzil_stairs`, mapped and given to the optimiser as pieces; from the floor to the platform.
/// Treads are 0.3 m deep and 0.1 m apart in height; those 0.1 m and 0.5 m above the floor are there but once.
class Stairs {
 public:
  static std::filesystem::path mesh() {
    return std::filesystem::path(test::paths::data()) / "terrain_meshes" / "bauzil_stairs.stl";
  }

  Stairs() {
    simulation::SimulationOptions options;
    options.mesh = mesh();
    options.seed = test::seed();
    options.frames = 75;
    const simulation::Recording recording(options);
    Parameters coarse;
    coarse.occupancy.resolution = 0.03;
    Mapper mapper(coarse);
    for (std::size_t i = 0; i < recording.size(); ++i) mapper.insert(recording.scan(i));
    // Simulated worlds stand a little askew; the optimiser's has z for up.
    const Up up = up_from_surfaces(mapper.map());
    const Eigen::Quaterniond R = upright(up.direction);
    std::vector<Eigen::Vector3d> treads;
    double floor = HUGE_VAL;
    for (const evaluation::TrueFace& face : recording.faces()) {
      if (face.plane.normal.dot(up.direction) < 0.99) continue;
      const Eigen::Vector3d middle = R * middle_of(face);
      const double area = evaluation::enclosed_area(face.polygons.at(0));
      if (area > 0.2 && area < 0.5) treads.push_back(middle);
      floor = std::min(floor, middle.z());
    }
    const auto higher = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.z() < b.z(); };
    const auto [lowest, highest] = std::minmax_element(treads.begin(), treads.end(), higher);
    const Eigen::Vector3d first = *lowest, last = *highest;
    const Eigen::Vector3d ahead = (last - first).cwiseProduct(Eigen::Vector3d(1, 1, 0)).normalized();
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(ahead) * BipedReach{}.stance_width_m / 2;
    Eigen::Vector3d from = first - 0.6 * ahead;
    from.z() = floor;
    task.start = {from + left, from - left};
    task.goal = last + 0.6 * ahead + (first.z() - floor) * Eigen::Vector3d::UnitZ();
    task.yaw_rad = std::atan2(ahead.y(), ahead.x());
    PlannerContact contact;
    contact.shape = sole;
    contact.yaw_rad = task.yaw_rad;
    contact.limits.up = up.direction;
    contact.limits.edge_margin_m = mapper.snapshot()->resolution;
    contact.pieces = 12;
    contact.turn = R;
    pieces = contact_pieces(planner_surfaces(*mapper.snapshot(), contact));
  }

  std::vector<ContactPiece> pieces;
  ContactTask task{};
  ContactShape sole = ContactShape::rectangle(0.22, 0.11);
};

class ContactSequenceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(Stairs::mesh())) GTEST_SKIP() << "no " << Stairs::mesh();
    static const Stairs mapped;
    stairs = &mapped;
  }
  const Stairs* stairs = nullptr;
};

/// `d` is in the box, seen forward, to `side` and up.
void expect_in(const Eigen::Vector3d& d, double yaw, double side, const Eigen::Vector3d& low,
               const Eigen::Vector3d& high) {
  const Eigen::Vector3d forward(std::cos(yaw), std::sin(yaw), 0), left(-std::sin(yaw), std::cos(yaw), 0);
  const Eigen::Vector3d seen(forward.dot(d), side * left.dot(d), d.z());
  for (int k = 0; k < 3; ++k) {
    EXPECT_GE(seen[k], low[k] - exact) << k;
    EXPECT_LE(seen[k], high[k] + exact) << k;
  }
}

TEST_F(ContactSequenceTest, ClimbsTheStairs) {
  const BipedReach reach;
  const ContactTask& task = stairs->task;
  const auto found = plan_contacts(stairs->pieces, task, reach, 16);
  ASSERT_TRUE(found) << "on " << stairs->pieces.size() << " pieces";
  Eigen::Vector3d standing = task.start[1], moving = task.start[0];
  for (std::size_t i = 0; i < found->steps.size(); ++i) {
    SCOPED_TRACE(i);
    const ContactSequence::Step& step = found->steps[i];
    const ContactPiece& piece = stairs->pieces.at(step.piece);
    EXPECT_LE((piece.A * step.foot - piece.b).maxCoeff(), exact);
    const double side = i % 2 == 0 ? 1 : -1;
    expect_in(step.foot - standing, task.yaw_rad, side, reach.step_low, reach.step_high);
    for (const Eigen::Vector3d& foot : {standing, moving, step.foot})
      expect_in(step.center - foot, task.yaw_rad, 1, reach.center_low, reach.center_high);
    expect_in(step.center - standing, task.yaw_rad, 1, {-reach.balance.x(), -reach.balance.y(), 0},
              {reach.balance.x(), reach.balance.y(), 2});
    moving = standing;
    standing = step.foot;
  }
  expect_in((standing + moving) / 2 - task.goal, task.yaw_rad, 1, -task.tolerance, task.tolerance);
}

TEST_F(ContactSequenceTest, OfTooFewStepsIsProvenNotToBe) {
  const auto found = plan_contacts(stairs->pieces, stairs->task, {}, 16);
  ASSERT_TRUE(found);
  EXPECT_FALSE(plan_contacts(stairs->pieces, stairs->task, {}, found->steps.size() - 1));
}

TEST_F(ContactSequenceTest, IsRefusedToLegsTooShortForTheRisers) {
  BipedReach reach;
  reach.step_high.z() = 0.07;  // risers are 0.1 m
  EXPECT_FALSE(plan_contacts(stairs->pieces, stairs->task, reach, 16));
}

}  // namespace
}  // namespace octosurf::examples
