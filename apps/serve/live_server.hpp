#pragma once

#include "serve/api.hpp"
#include "serve/http_server.hpp"

#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf {

/// Serves a map while it grows, from threads of its own that leave the processor to the mapper. Answers are
/// of the latest snapshot; the mapper never waits for them.
class LiveServer {
 public:
  /// Has the mapper share its octree. `mapper` has to outlive this. `allow_clear`: clients may take back
  /// parts of the map. Throws as HttpServer.
  LiveServer(Mapper& mapper, std::string name, const HttpPlace& place, bool allow_clear);
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;
  ~LiveServer() { end_clearing(); }

  std::string url() const { return server_->url(); }

  /// By the thread that maps, between two scans: takes back what clients wait for. Whether there was any.
  bool clear_as_asked(Mapper& mapper);
  /// Who waits is refused, and who comes later.
  void end_clearing();

 private:
  using Clearing = std::packaged_task<HttpReply(Mapper&)>;

  std::shared_ptr<const ServedMap> latest();
  HttpReply clear(const SpacePart& part, bool as_free);

  const Mapper& mapper_;
  const std::string name_;
  const ServedMap::Run run_;
  const std::optional<Eigen::Vector3d> up_;  ///< if the map's parameters say
  std::mutex making_;                        ///< of the latest
  std::shared_ptr<const ServedMap> latest_;
  std::mutex asking_;  ///< of what follows
  std::vector<Clearing> clearings_;
  bool clearing_ended_ = false;
  Api api_;
  std::optional<HttpServer> server_;
};

}  // namespace octosurf
