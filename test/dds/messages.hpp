#pragma once

#include "io/cdr_bytes.hpp"
#include "io/ros_messages.hpp"

// Messages as JSON, by their definitions in ros/dds/idl and ros/octosurf_msgs.

namespace octosurf::test {

using ros::Json;

/// All types, by DDS's names.
const ros::Types& dds_types();
/// "sensor_msgs::msg::dds_::Image_" for "sensor_msgs/Image"; "Save_Request" is a service's.
std::string dds_name(const std::string& type);

/// What is missing is zero or empty.
std::string encoded(const std::string& type, const Json& message);
Json decoded(const std::string& type, const std::string& cdr);

}  // namespace octosurf::test
