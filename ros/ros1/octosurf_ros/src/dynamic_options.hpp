#pragma once

#include "settings.hpp"

#include <dynamic_reconfigure/server.h>
#include <mutex>
#include <ros/node_handle.h>

namespace octosurf::ros1 {

/// The options as dynamic_reconfigure has them, to be asked from any thread.
class DynamicOptions {
 public:
  explicit DynamicOptions(const ros::NodeHandle& node) : server_(updating_, node) {
    server_.setCallback([this](const Options& options, std::uint32_t) {
      const std::lock_guard lock(mutex_);
      options_ = options;
    });
  }

  Options operator()() const {
    const std::lock_guard lock(mutex_);
    return options_;
  }

 private:
  mutable std::mutex mutex_;
  Options options_;
  boost::recursive_mutex updating_;
  dynamic_reconfigure::Server<Options> server_;
};

}  // namespace octosurf::ros1
