// contact_sequence MAP X Y Z X Y Z: contacts of a biped from between its feet here to there, in a map whose z
// is up.
#include "contact_sequence.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include <octosurf/map.hpp>

int main(int argc, char** argv) {
  using namespace octosurf::examples;
  if (argc != 8) {
    std::fprintf(stderr, "usage: contact_sequence MAP X Y Z X Y Z\n");
    return 2;
  }
  try {
    const auto point = [&](int i) {
      return Eigen::Vector3d(std::atof(argv[i]), std::atof(argv[i + 1]), std::atof(argv[i + 2]));
    };
    const BipedReach reach;
    const Eigen::Vector3d from = point(2), to = point(5),
                          way = (to - from).cwiseProduct(Eigen::Vector3d(1, 1, 0));
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(way.normalized()) * reach.stance_width_m / 2;
    ContactTask task{{from + left, from - left}, to};
    task.yaw_rad = std::atan2(way.y(), way.x());
    octosurf::PlannerContact sole;
    sole.shape = octosurf::ContactShape::rectangle(0.22, 0.11);
    sole.yaw_rad = task.yaw_rad;
    sole.pieces = 12;
    const octosurf::LoadedMap loaded = octosurf::load_map(argv[1]);
    const auto surfaces = octosurf::planner_surfaces(*loaded.map.snapshot(), sole);
    const auto found = plan_contacts(contact_pieces(surfaces), task, reach, 20);
    if (!found) {
      std::fprintf(stderr, "contact_sequence: no sequence of at most 20 steps\n");
      return 1;
    }
    for (std::size_t i = 0; i < found->steps.size(); ++i) {
      const Eigen::Vector3d& foot = found->steps[i].foot;
      std::printf("%s %.3f %.3f %.3f\n", i % 2 == 0 ? "left " : "right", foot.x(), foot.y(), foot.z());
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "contact_sequence: %s\n", error.what());
    return 1;
  }
}
