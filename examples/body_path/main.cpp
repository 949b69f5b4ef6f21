// body_path MAP X Y YAW X Y YAW: where a robot's trunk goes from the one place to the other, m and degrees.
#include "body_path.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numbers>

#include <octosurf/map.hpp>

int main(int argc, char** argv) {
  using namespace octosurf;
  if (argc != 8) {
    std::fprintf(stderr, "usage: body_path MAP X Y YAW X Y YAW\n");
    return 2;
  }
  try {
    const auto state = [&](int i) {
      return examples::BodyState{std::atof(argv[i]), std::atof(argv[i + 1]),
                                 std::atof(argv[i + 2]) * std::numbers::pi / 180};
    };
    const LoadedMap loaded = load_map(argv[1]);
    const examples::BodyPlanner planner(*loaded.map.snapshot(), loaded.map.octree());
    const examples::BodyPath path = planner.plan(state(2), state(5));
    if (path.poses.empty()) {
      std::fprintf(stderr, "body_path: %s\n", path.refusal.c_str());
      return 1;
    }
    for (const Eigen::Isometry3d& pose : path.poses)
      std::printf("%.3f %.3f %.3f\n", pose.translation().x(), pose.translation().y(), pose.translation().z());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "body_path: %s\n", error.what());
    return 1;
  }
}
