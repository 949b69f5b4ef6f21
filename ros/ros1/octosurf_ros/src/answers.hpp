#pragma once

#include <memory>
#include <octosurf_msgs/ContactRegions.h>
#include <octosurf_msgs/Plan.h>
#include <octosurf_msgs/Query.h>
#include <utility>

#include <octosurf/queries.hpp>

namespace octosurf::ros1 {

/// A map at one moment, its octree with it.
struct AskedMap {
  explicit AskedMap(std::shared_ptr<const Snapshot> of, const AskedMap* previous = nullptr)
      : snapshot(std::move(of)), index(snapshot, previous != nullptr ? &previous->index : nullptr) {}

  const std::shared_ptr<const Snapshot> snapshot;
  const SurfaceIndex index;
};

// What the services answer about it. A question that makes no sense is answered
// by success = false and why: ROS 1 has no other place for a reason.

octosurf_msgs::Query::Response answer(const AskedMap& map, const octosurf_msgs::Query::Request& request);
octosurf_msgs::ContactRegions::Response answer(const AskedMap& map,
                                               const octosurf_msgs::ContactRegions::Request& request);
octosurf_msgs::Plan::Response answer(const AskedMap& map, const octosurf_msgs::Plan::Request& request);

}  // namespace octosurf::ros1
