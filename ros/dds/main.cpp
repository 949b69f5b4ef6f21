// `octosurf-dds`: a mapping node of ROS 2 on a machine without ROS 2.
#include "endpoints.hpp"
#include "mapping.hpp"
#include "options.hpp"
#include "publications.hpp"
#include "reading_options.hpp"
#include "services.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf::dds {
namespace {

constexpr const char* description =
    R"(Maps what a ROS 2 robot's sensors publish, and publishes the map: over DDS, without ROS 2.

Examples:
  octosurf-dds --depth /camera/depth/image_rect_raw -o maps/lab
  octosurf-dds --cloud /lidar/points --frame odom -o maps/yard --resume
  ROS_DOMAIN_ID=7 octosurf-dds --cloud /points -o maps/lab --resolution 0.05 --reliable

Reads a PointCloud2, or depth as Image (16UC1, mono16, 32FC1) with its CameraInfo, and /tf and /tf_static.
Publishes, latched: NAME/surfaces, NAME/markers, NAME/planar_terrain, NAME/octomap_binary, NAME/grid_map and
NAME/status. Services: NAME/save, NAME/load, NAME/query, NAME/contact_regions, NAME/plan. ros/dds/README.md has
the types, and what of ROS 2 it was tested with. Ctrl-C and SIGTERM end it after the scan at hand, and save.
)";

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

std::uint32_t domain_of_environment() {
  const char* id = std::getenv("ROS_DOMAIN_ID");
  std::uint32_t domain = 0;
  if (id != nullptr && *id != '\0' && !CLI::detail::lexical_cast(std::string(id), domain))
    throw Error(Error::Kind::usage, "ROS_DOMAIN_ID", std::string("'") + id + "' is no number");
  return domain;
}

void add_options(CLI::App& app, NodeOptions& options, bool& force) {
  auto* cloud = app.add_option("--cloud", options.cloud, "topic of sensor_msgs/PointCloud2");
  auto* depth =
      app.add_option("--depth", options.depth, "topic of depth as sensor_msgs/Image")->excludes(cloud);
  app.add_option("--camera-info", options.info, "topic; default: camera_info beside --depth")->needs(depth);
  app.add_option("--depth-scale", options.depth_scale,
                 "depth's units per metre [1000 of integers, 1 of floats]")
      ->check(CLI::PositiveNumber);
  app.add_option("--frame", options.frame, "the map's, in tf")->capture_default_str();
  app.add_option("--max-pose-gap", options.max_pose_gap_s,
                 "seconds between two transforms at most that one is "
                 "interpolated between")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--wait", options.wait_s, "seconds at most that a scan waits for tf and CameraInfo")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  app.add_flag("--reliable", options.reliable,
               "ask for scans again that were lost; hears only publishers that "
               "offer it");
  app.add_option("--queue", options.queue_mb, "MB of scans that may wait; then the oldest make way")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("-o,--output", options.output, "the map: MAP.surfaces and MAP.bt")->required();
  app.add_flag("--resume", options.resume, "resume the map, if it is there");
  app.add_flag("--force", force, "begin anew, and write over a map that is there")->excludes("--resume");
  app.add_option("--checkpoint", options.checkpoint_s, "seconds between two savings; 0: only in the end")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--name", options.name, "before topics and services")->capture_default_str();
  app.add_option("--publish", options.publish_s, "seconds between two publications of the map")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  app.add_option("--foot-radius", options.foot_radius_m, "m, of the planar terrain's insets")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-slope", options.max_slope_deg, "degrees, of planar terrain and grid map")
      ->check(CLI::Range(0.0, 80.0))
      ->capture_default_str();
  app.add_option("--clearance", options.clearance_m,
                 "m over a foot of the planar terrain in which nothing may stand or hang; 0: any")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--domain", options.domain, "[ROS_DOMAIN_ID, else 0]");
  app.add_option("--threads", options.threads, "result does not depend on it")->capture_default_str();
  add_reading_options(app, options.readings);
  add_parameter_options(app, options.parameters);
}

Map start_of(const NodeOptions& options, bool force) {
  const ParameterChoice choice(options.parameters, true);
  const bool there = std::filesystem::exists(options.output + ".surfaces");
  if (there && !options.resume && !force)
    throw Error(Error::Kind::usage, options.output + ".surfaces", "exists",
                "--resume resumes it, --force begins anew");
  if (!there || force) return Map(choice.in_force());
  LoadedMap loaded = load_map(options.output);
  choice.require_same(loaded.map.parameters());
  loaded.map.state().parameters.up = choice.up_over(loaded.map.parameters());
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  return std::move(loaded.map);
}

/// What the node hears.
class Inputs {
 public:
  Inputs(const Participant& participant, const NodeOptions& options)
      : scans_(participant, topic_over_dds(options.scans()),
               type_over_dds(options.takes_depth() ? "sensor_msgs/Image" : "sensor_msgs/PointCloud2"),
               options.reliable ? Profile::reliable : Profile::sensor, 10),
        tf_(participant, "rt/tf", type_over_dds("tf2_msgs/TFMessage"), Profile::reliable, 1000),
        tf_static_(participant, "rt/tf_static", type_over_dds("tf2_msgs/TFMessage"), Profile::latched, 1000) {
    if (options.takes_depth())
      camera_.emplace(participant, topic_over_dds(options.info.value_or(camera_info_topic(options.depth))),
                      type_over_dds("sensor_msgs/CameraInfo"), Profile::sensor, 1);
    std::vector<const Reader*> readers{&scans_, &tf_, &tf_static_};
    if (camera_) readers.push_back(&*camera_);
    news_.emplace(participant, readers);
  }

  /// Until it is interrupted or the map has failed.
  void pass_on(Mapping& mapping) const {
    while (!interrupted && !mapping.failed()) {
      news_->wait(std::chrono::milliseconds(100));
      while (const auto message = tf_static_.take()) mapping.add_transforms(*message, true);
      while (const auto message = tf_.take()) mapping.add_transforms(*message, false);
      while (const auto message = camera_ ? camera_->take() : std::nullopt) mapping.add_camera(*message);
      while (auto message = scans_.take()) mapping.add_scan(std::move(*message));
    }
  }

  InputState state() const {
    const auto count = [](std::size_t writers) { return static_cast<std::uint32_t>(writers); };
    return {scans_.lost(), count(scans_.writers()), count(camera_ ? camera_->writers() : 0),
            count(tf_.writers() + tf_static_.writers())};
  }

 private:
  Reader scans_, tf_, tf_static_;
  std::optional<Reader> camera_;
  std::optional<Waiting> news_;
};

void run(const NodeOptions& options, bool force) {
  if (options.scans().empty())
    throw Error(Error::Kind::usage, "--cloud or --depth", "is missing", "name the topic of the scans");
  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  Mapping mapping(start_of(options, force), options);
  {
    const Participant participant(options.domain);
    const Inputs inputs(participant, options);
    const Publications publications(participant, mapping, options, [&] { return inputs.state(); });
    const Services services(participant, mapping, options);
    std::printf("mapping %s in domain %u\n", options.scans().c_str(), options.domain);
    std::fflush(stdout);
    inputs.pass_on(mapping);
  }
  mapping.finish();
  const MappingCounts counts = mapping.counts();
  std::printf(
      "%llu scans: %llu mapped, %llu rejected, %llu refused, %llu dropped, %llu not reached\n",
      static_cast<unsigned long long>(counts.received), static_cast<unsigned long long>(counts.mapped),
      static_cast<unsigned long long>(counts.rejected), static_cast<unsigned long long>(counts.refused),
      static_cast<unsigned long long>(counts.dropped), static_cast<unsigned long long>(counts.waiting));
}

}  // namespace
}  // namespace octosurf::dds

int main(int argc, char** argv) {
  using octosurf::Error;
  CLI::App app(octosurf::dds::description, "octosurf-dds");
  octosurf::dds::NodeOptions options;
  bool force = false;
  try {
    options.domain = octosurf::dds::domain_of_environment();
    octosurf::dds::add_options(app, options, force);
    app.parse(argc, argv);
    octosurf::dds::run(options, force);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const Error& error) {
    std::fprintf(stderr, "octosurf-dds: %s\n", error.what());
    return error.kind() == Error::Kind::usage ? 2 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octosurf-dds: %s\n", error.what());
    return 1;
  }
}
