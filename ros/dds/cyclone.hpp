#pragma once

#include "node/middleware.hpp"

#include <dds/dds.h>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace octosurf::dds {

/// ROS 2 as rmw_cyclonedds_cpp has it over DDS, without ROS 2. A service is a topic of requests and one of
/// replies, both with the client's id and the request's number before the message. (rmw_fastrtps_cpp sends
/// those beside the message, and does not understand these.)
class Cyclone final : public node::Middleware {
 public:
  /// Joins the domain. ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY and ROS_STATIC_PEERS apply as to
  /// rmw_cyclonedds_cpp, and CYCLONEDDS_URI. Throws Error(usage) if that cannot be.
  explicit Cyclone(std::uint32_t domain);
  ~Cyclone() override;

  /// These throw Error(usage) unless it is a whole topic name.
  std::unique_ptr<node::Publisher> advertise(const std::string& topic, const std::string& type,
                                             node::Profile profile) override;
  std::unique_ptr<node::Subscription> subscribe(const std::string& topic, const std::string& type,
                                                node::Profile profile, int depth,
                                                std::function<void(node::RawMessage)> receive) override;
  std::shared_ptr<void> serve(const std::string& name, const std::string& type,
                              std::function<void(node::Request)> receive) override;

  /// Tells ROS 2's tools what was made so far as a node's, "/name" (ros_discovery_info, as since Iron).
  void announce(const std::string& name);

 private:
  class Reader;
  struct Service;

  void run(const std::stop_token& stop);

  dds_entity_t domain_ = 0, participant_ = 0, waitset_ = 0;
  std::mutex mutex_;                    // of the next
  std::vector<const Reader*> readers_;  // the first are read first
  std::vector<dds_entity_t> made_;      // endpoints
  std::unique_ptr<node::Publisher> info_;
  std::jthread thread_;
};

}  // namespace octosurf::dds
