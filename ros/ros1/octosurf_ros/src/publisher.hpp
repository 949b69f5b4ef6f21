#pragma once

#include "settings.hpp"
#include "surface_messages.hpp"

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <string>
#include <thread>

#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::ros1 {

/// Publishes snapshots from a thread of its own: mapping never waits for it. Of snapshots that come faster
/// than ~publish_rate the last one is sent; who subscribes gets the present one. A message that nobody
/// listens to is not made.
class Publisher {
 public:
  /// `options`: those of now, from any thread.
  Publisher(ros::NodeHandle& node, std::string fixed_frame, std::function<Options()> options);
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;
  ~Publisher();

  /// The map after a scan of that time.
  void show(std::shared_ptr<const Snapshot> snapshot, ros::Time stamp);

 private:
  struct Shown {
    std::shared_ptr<const Snapshot> snapshot;
    std_msgs::Header header;
  };
  struct Topic {
    ros::Publisher publisher;
    std::function<void(const Shown&)> publish;
    bool has_new_listener = false;
  };
  /// `make` makes the topic's Message of what is shown.
  template <class Message, class Make>
  void add(ros::NodeHandle& node, const std::string& name, const Make& make);
  void run();
  void publish(Topic& topic, const Shown& shown);

  const std::string fixed_frame_;
  const std::function<Options()> options_;
  PieceCache pieces_;
  OctomapFollower octree_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Topic> topics_;  // stay where they are: callbacks know them
  Shown shown_;
  bool has_news_ = false, stopping_ = false;
  std::thread thread_;
};

}  // namespace octosurf::ros1
