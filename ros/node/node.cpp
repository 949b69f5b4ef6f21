#include "node.hpp"

#include "io/text_file.hpp"

#include <chrono>
#include <cstdio>
#include <utility>

#include <octosurf/ros_messages.hpp>

namespace octosurf::node {

Node::Node(Middleware& middleware, const NodeOptions& options)
    : options_(options), mapping_(start_of(options), options) {
  const auto hear = [&](const std::string& topic, const char* type, Profile profile, int depth,
                        auto receive) {
    inputs_.push_back(middleware.subscribe(topic, type, profile, depth, receive));
  };
  // In this order: a scan is better mapped when what fixes its pose was read.
  hear(options.tf + "_static", "tf2_msgs/TFMessage", Profile::latched, 1000,
       [this](const RawMessage& message) { mapping_.add_transforms(message, true); });
  hear(options.tf, "tf2_msgs/TFMessage", Profile::reliable, 1000,
       [this](const RawMessage& message) { mapping_.add_transforms(message, false); });
  if (options.takes_depth())
    hear(options.info.value_or(camera_info_topic(options.depth)), "sensor_msgs/CameraInfo", Profile::sensor,
         1, [this](const RawMessage& message) { mapping_.add_camera(message); });
  hear(options.scans(), options.takes_depth() ? "sensor_msgs/Image" : "sensor_msgs/PointCloud2",
       options.reliable ? Profile::reliable : Profile::sensor, 10,
       [this](RawMessage message) { mapping_.add_scan(std::move(message)); });
  publications_.emplace(middleware, mapping_, options, [this] { return state(); });
  if (options.patch_hz > 0) patches_.emplace(middleware, mapping_, options);
  services_.emplace(middleware, mapping_, *publications_, options);
}

InputState Node::state() {
  const Subscription& scans = *inputs_.back();
  const auto heard = [](const Subscription& input) { return static_cast<std::uint32_t>(input.publishers()); };
  const std::string mismatch = scans.mismatch();
  if (mismatch != std::exchange(mismatch_, mismatch))
    std::fprintf(stderr, "warning: a publisher of %s is not heard, as it offers less %s%s\n",
                 options_.scans().c_str(), mismatch.c_str(),
                 options_.reliable ? "; without --reliable it would be" : "");
  const InputState state{scans.lost(), heard(scans), options_.takes_depth() ? heard(*inputs_[2]) : 0,
                         heard(*inputs_[0]) + heard(*inputs_[1])};
  constexpr std::chrono::seconds discovery(5);
  const bool waited = std::chrono::steady_clock::now() - began_ >= discovery;
  if (waited && state.scan_publishers == 0 && !std::exchange(told_of_scans_, true))
    std::fprintf(stderr, "warning: no publisher of %s, whose scans are mapped; is the topic called so?\n",
                 options_.scans().c_str());
  // Not at once: publishers are discovered one after the other.
  without_tf_ = state.scan_publishers > 0 && state.transform_publishers == 0 ? without_tf_ + 1 : 0;
  if (without_tf_ == 3)
    std::fprintf(stderr,
                 "warning: no publisher of %s or %s_static, which pose the scans; --tf names another topic\n",
                 options_.tf.c_str(), options_.tf.c_str());
  return state;
}

std::string Node::finish(const std::function<bool()>& hurry) {
  services_.reset();
  patches_.reset();
  publications_.reset();
  inputs_.clear();
  mapping_.finish(hurry);
  const MappingCounts counts = mapping_.counts();
  const auto number = [](std::uint64_t count) { return static_cast<unsigned long long>(count); };
  return io::formatted("%llu scans: %llu mapped, %llu rejected, %llu refused, %llu dropped, %llu not reached",
                       number(counts.received), number(counts.mapped), number(counts.rejected),
                       number(counts.refused), number(counts.dropped), number(counts.waiting));
}

}  // namespace octosurf::node
