#include "serve/live_server.hpp"

#include <array>
#include <cstdio>
#include <random>
#include <sys/resource.h>
#include <utility>

#include <octosurf/page.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

/// Of the calling thread, for good: what it does can wait, the next scan cannot.
void yield_to_the_mapper() {
  thread_local const int done = ::setpriority(PRIO_PROCESS, 0, 10);  // Linux: 0 is this thread
  static_cast<void>(done);  // where it is not allowed, all have the same share
}

/// No two runs have the same, so that nobody takes one's revisions for the other's.
std::string new_run() {
  std::random_device random;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", random(), random());
  return text.data();
}

}  // namespace

LiveServer::LiveServer(Mapper& mapper, std::string name, const HttpPlace& place)
    : mapper_(mapper),
      name_(std::move(name)),
      run_{new_run(),
           [this] {
             const std::lock_guard lock(tracking_);
             return track_;
           }},
      up_(mapper.map().parameters().up),
      api_([this] { return latest(); }) {
  mapper.share_octree();
  server_.emplace(place, api_);
}

void LiveServer::add_pose(SensorKind sensor, const Eigen::Isometry3d& T_map_sensor) {
  const std::lock_guard lock(tracking_);
  track_.add(sensor, T_map_sensor);
}

std::shared_ptr<const ServedMap> LiveServer::latest() {
  yield_to_the_mapper();
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  const std::lock_guard lock(making_);
  if (!latest_ || latest_->asked.snapshot != snapshot)
    latest_ =
        std::make_shared<const ServedMap>(snapshot, name_, up_ ? *up_ : estimate_up(*snapshot).direction,
                                          PageOptions{}.max_mb, run_, latest_.get());
  return latest_;
}

}  // namespace octosurf
