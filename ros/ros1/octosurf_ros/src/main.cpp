// octosurf_node: the mapper as a node of ROS 1 (ros/ros1/README.md).
#include "mapper_node.hpp"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ros/ros.h>

#include <octosurf/adapters/paper_detector.hpp>

namespace {

std::atomic<int> stop_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free);  // a signal handler may not wait for a lock

}  // namespace

int main(int argc, char** argv) {
  octosurf::enable_paper_detector();
  std::setvbuf(stdout, nullptr, _IOLBF,
               0);  // rosconsole does not flush, and lines matter when they are written
  // ROS' own handler ends the connection to the master while the map is still to be saved.
  ros::init(argc, argv, "octosurf", ros::init_options::NoSigintHandler);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int which) { stop_signal = which; });
  try {
    octosurf::ros1::MapperNode node;
    ros::AsyncSpinner spinner(4);
    spinner.start();
    ROS_INFO("ready");
    while (stop_signal == 0 && ros::ok()) ros::WallDuration(0.02).sleep();
    const bool saved = node.finish();
    spinner.stop();
    return saved ? EXIT_SUCCESS : EXIT_FAILURE;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octosurf_node: %s\n", error.what());  // ROS' log has ended with the node's handles
    return EXIT_FAILURE;
  }
}
