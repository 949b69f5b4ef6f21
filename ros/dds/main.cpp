// `octosurf-dds`: a mapping node of ROS 2 on a machine without ROS 2.
#include "cyclone.hpp"
#include "node/node.hpp"

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <octosurf/error.hpp>

namespace octosurf::dds {
namespace {

constexpr const char* description =
    R"(Maps what a ROS 2 robot's sensors publish, and publishes the map: over DDS, without ROS 2.

Examples:
  octosurf-dds --depth /camera/depth/image_rect_raw -o maps/lab
  octosurf-dds --cloud /lidar/points --frame odom -o maps/yard --resume
  ROS_DOMAIN_ID=7 octosurf-dds --cloud /points -o maps/lab --resolution 0.05 --reliable

Reads a PointCloud2, or depth as Image (16UC1, mono16, 32FC1) with its CameraInfo, and /tf and /tf_static.
Publishes what lies about the robot, latched: NAME/surfaces, stairs, markers, planar_terrain, octomap_binary,
grid_map; NAME/status; NAME/patch and heights at --patch-rate. Services: NAME/save, load, query, contact_regions,
plan, changes, publish, clear. ros/README.md has the types, and what of ROS 2 it was tested with. Ctrl-C and
SIGTERM end it when the scans that wait are mapped, and save; a second one leaves those.
)";

std::atomic<int> interrupts{0};
static_assert(std::atomic<int>::is_always_lock_free);

std::uint32_t domain_of_environment() {
  const char* id = std::getenv("ROS_DOMAIN_ID");
  std::uint32_t domain = 0;
  if (id != nullptr && *id != '\0' && !CLI::detail::lexical_cast(std::string(id), domain))
    throw Error(Error::Kind::usage, "ROS_DOMAIN_ID", std::string("'") + id + "' is no number");
  return domain;
}

void run(const node::NodeOptions& options, std::uint32_t domain) {
  std::signal(SIGINT, [](int) { ++interrupts; });
  std::signal(SIGTERM, [](int) { ++interrupts; });
  Cyclone cyclone(domain);
  node::Node node(cyclone, options);
  cyclone.announce(options.name);
  std::printf("mapping %s in domain %u\n", options.scans().c_str(), domain);
  std::fflush(stdout);
  while (interrupts == 0 && !node.failed()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::printf("%s\n", node.finish([] { return interrupts > 1; }).c_str());
}

}  // namespace
}  // namespace octosurf::dds

int main(int argc, char** argv) {
  using octosurf::Error;
  CLI::App app(octosurf::dds::description, "octosurf-dds");
  octosurf::node::NodeOptions options;
  try {
    std::uint32_t domain = octosurf::dds::domain_of_environment();
    app.add_option("--domain", domain, "[ROS_DOMAIN_ID, else 0]");
    octosurf::node::add_options(app, options);
    app.parse(argc, argv);
    octosurf::dds::run(options, domain);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octosurf-dds: %s\n", error.what());
    const auto* const own = dynamic_cast<const Error*>(&error);
    return own != nullptr && own->kind() == Error::Kind::usage ? 2 : 1;
  }
}
