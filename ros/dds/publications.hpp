#pragma once

#include "endpoints.hpp"
#include "io/exporters/message_writer.hpp"
#include "mapping.hpp"
#include "options.hpp"

#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <thread>

#include <octosurf/adapters/octomap_follower.hpp>

namespace octosurf::dds {

/// Who is heard.
struct InputState {
  std::uint64_t lost = 0;  ///< scans that are known to have been sent but did not come
  std::uint32_t scan_publishers = 0, camera_publishers = 0, transform_publishers = 0;
};

/// Publishes the map, latched, whenever it has changed, and how the node does; in a thread of its own, from
/// snapshots, so that mapping never waits for it.
class Publications {
 public:
  Publications(const Participant& participant, const Mapping& mapping, const NodeOptions& options,
               std::function<InputState()> inputs);

 private:
  void run(std::stop_token stop);
  bool publish_map(const MapMoment& moment);
  bool publish(const Writer& writer, const char* what,
               const std::function<void(io::MessageWriter&)>& message);
  void tell(const char* what, const std::exception& error);
  void publish_status(const MapMoment& moment);

  const Mapping& mapping_;
  const NodeOptions& options_;
  std::function<InputState()> inputs_;
  Writer surfaces_, stairs_, markers_, terrain_, octomap_, grid_map_, status_;
  OctomapFollower octree_;  // of the thread, as is the next
  std::string problem_;     // reported last
  std::jthread thread_;
};

}  // namespace octosurf::dds
