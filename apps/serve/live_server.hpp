#pragma once

#include "serve/api.hpp"
#include "serve/http_server.hpp"

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <octosurf/mapper.hpp>

namespace octosurf {

/// Serves a map while it grows, from threads of its own that leave the processor to the mapper. Answers are
/// of the latest snapshot; the mapper never waits for them.
class LiveServer {
 public:
  /// Has the mapper share its octree. `mapper` has to outlive this. Throws as HttpServer.
  LiveServer(Mapper& mapper, std::string name, const HttpPlace& place);

  std::string url() const { return server_->url(); }

  /// Where the scan was seen from that was mapped last.
  void add_pose(SensorKind sensor, const Eigen::Isometry3d& T_map_sensor);

 private:
  std::shared_ptr<const ServedMap> latest();

  const Mapper& mapper_;
  const std::string name_;
  const ServedMap::Run run_;
  const std::optional<Eigen::Vector3d> up_;  ///< if the map's parameters say
  std::mutex making_;                        ///< of the latest
  std::shared_ptr<const ServedMap> latest_;
  std::mutex tracking_;  ///< of the track
  io::SensorTrack track_;
  Api api_;
  std::optional<HttpServer> server_;
};

}  // namespace octosurf
