#pragma once

#include "questions.hpp"

#include <octosurf_msgs/ContactRegions.h>
#include <octosurf_msgs/Plan.h>
#include <octosurf_msgs/Query.h>

namespace octosurf::ros1 {

using services::AskedMap;

// What the services answer about a map. A question that makes no sense is answered
// by success = false and why: ROS 1 has no other place for a reason.

octosurf_msgs::Query::Response answer(const AskedMap& map, const octosurf_msgs::Query::Request& request);
octosurf_msgs::ContactRegions::Response answer(const AskedMap& map,
                                               const octosurf_msgs::ContactRegions::Request& request);
octosurf_msgs::Plan::Response answer(const AskedMap& map, const octosurf_msgs::Plan::Request& request);

}  // namespace octosurf::ros1
