#include "publisher.hpp"

#include "terrain_messages.hpp"

#include <chrono>
#include <ros/console.h>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::ros1 {

template <class Message, class Make>
void Publisher::add(ros::NodeHandle& node, const std::string& name, const Make& make) {
  Topic& topic = topics_.emplace_back();
  topic.publish = [&topic, make](const Shown& shown) { topic.publisher.publish(make(shown)); };
  const auto welcome = [this, &topic](const ros::SingleSubscriberPublisher&) {
    const std::lock_guard lock(mutex_);
    topic.has_new_listener = true;
    changed_.notify_one();
  };
  topic.publisher = node.advertise<Message>(name, 1, welcome);
}

Publisher::Publisher(ros::NodeHandle& node, std::string fixed_frame, std::function<Options()> options)
    : fixed_frame_(std::move(fixed_frame)), options_(std::move(options)) {
  add<octosurf_msgs::Surfaces>(
      node, "surfaces", [](const Shown& shown) { return surfaces_message(*shown.snapshot, shown.header); });
  add<visualization_msgs::MarkerArray>(node, "markers", [this](const Shown& shown) {
    return markers_message(*shown.snapshot, pieces_, shown.header);
  });
  add<jsk_recognition_msgs::PolygonArray>(node, "polygons", [this](const Shown& shown) {
    return polygons_message(*shown.snapshot, pieces_, shown.header);
  });
  add<convex_plane_decomposition_msgs::PlanarTerrain>(node, "planar_terrain", [this](const Shown& shown) {
    return terrain_message(*shown.snapshot, options_(), shown.header);
  });
  add<octomap_msgs::Octomap>(node, "octomap_binary", [this](const Shown& shown) {
    return octomap_message(*octree_.follow(shown.snapshot->octree), shown.header);
  });
  add<grid_map_msgs::GridMap>(node, "grid_map", [this](const Shown& shown) {
    return grid_map_message(*shown.snapshot, options_(), shown.header);
  });
  thread_ = std::thread([this] { run(); });
}

Publisher::~Publisher() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Publisher::show(std::shared_ptr<const Snapshot> snapshot, ros::Time stamp) {
  {
    const std::lock_guard lock(mutex_);
    shown_.snapshot = std::move(snapshot);
    shown_.header.stamp = stamp;
    shown_.header.frame_id = fixed_frame_;
    has_news_ = true;
  }
  changed_.notify_one();
}

void Publisher::run() {
  using Clock = std::chrono::steady_clock;
  Clock::time_point last{};
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    std::vector<Topic*> due;
    const auto next = last + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(1 / options_().publish_rate));
    const bool all = has_news_ && Clock::now() >= next;
    for (Topic& topic : topics_)
      if (shown_.snapshot && (all || topic.has_new_listener)) due.push_back(&topic);
    if (due.empty()) {
      has_news_ ? changed_.wait_until(lock, next), void() : changed_.wait(lock);
      continue;
    }
    if (all) {
      last = Clock::now();
      has_news_ = false;
    }
    for (Topic* topic : due) topic->has_new_listener = false;
    const Shown shown = shown_;
    lock.unlock();
    for (Topic* topic : due) publish(*topic, shown);
    lock.lock();
  }
}

void Publisher::publish(Topic& topic, const Shown& shown) {
  if (topic.publisher.getNumSubscribers() == 0) return;
  try {
    pieces_.update(*shown.snapshot);
    topic.publish(shown);
  } catch (const std::exception& error) {
    ROS_WARN_STREAM_THROTTLE(60, topic.publisher.getTopic() << " is not sent: " << error.what());
  }
}

}  // namespace octosurf::ros1
