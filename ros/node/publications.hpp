#pragma once

#include "io/exporters/message_writer.hpp"
#include "mapping.hpp"
#include "middleware.hpp"
#include "node_options.hpp"

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <octosurf/ground.hpp>

namespace octosurf::node {

/// Publishers of the scans.
struct InputState {
  std::uint64_t lost = 0;  ///< scans that are known to have been sent but did not come
  std::uint32_t scan_publishers = 0, camera_publishers = 0, transform_publishers = 0;
};

/// Rules of the ground that is published, which is of z up (REP 103).
GroundRules rules_of(const NodeOptions& options, const Eigen::Vector3d& up, double resolution);

/// Publishes, latched, the map within a radius of the robot when it has changed and has subscribers, and the
/// node's status. In threads of its own, from snapshots, so that mapping never waits for it.
class Publications {
 public:
  Publications(Middleware& middleware, const Mapping& mapping, const NodeOptions& options,
               std::function<InputState()> inputs);

  /// The next publication is on all topics, and of what lies within `radius` m; 0: everything.
  void publish_all(double radius);

 private:
  /// The map around the robot at one moment.
  struct Part {
    Eigen::AlignedBox3d box;  ///< empty: everything
    Snapshot snapshot;        ///< its surfaces and cylinders
  };
  /// Equal for equal parts.
  struct Look {
    std::vector<std::pair<SurfaceId, std::uint64_t>> surfaces;  ///< ids and revisions
    std::vector<std::pair<CylinderId, std::uint64_t>> cylinders;
    std::uint64_t octree = 0;  ///< counts its changes in the box, and the box's
    friend bool operator==(const Look&, const Look&) = default;
  };
  struct Topic {
    std::string name;
    std::unique_ptr<Publisher> out;
    std::optional<Look> sent{};
  };
  using Write = std::function<void(io::MessageWriter&)>;

  Topic latched(Middleware& middleware, const char* topic, const char* type) const;
  void run(const std::stop_token& stop, const std::function<void()>& work) const;
  void publish_map();
  Part part_of(const MapMoment& moment, double radius);
  Look look_of(const MapMoment& moment, const Part& part);
  bool is_due(const Topic& topic) const;
  void publish(Topic& topic, const Write& message);
  void publish_ground(const MapMoment& moment, const Part& part);
  void tell(const std::string& what, const std::exception& error);
  void publish_status();

  const Mapping& mapping_;
  const NodeOptions& options_;
  std::function<InputState()> inputs_;
  Topic surfaces_, stairs_, markers_, terrain_, octomap_, grid_map_, status_;
  std::atomic<std::uint64_t> bytes_{0};
  std::atomic<double> map_ms_{0};
  std::mutex mutex_;                    // of the next
  std::optional<double> all_within_m_;  // requested
  // Of the thread that publishes the map:
  std::shared_ptr<const Snapshot> last_;
  std::optional<Eigen::Vector3d> middle_;
  bool all_ = false;  // topics, whatever was sent
  Look look_;
  OccupancyView octree_;  // at that look
  std::string problem_;   // reported last
  std::jthread map_thread_, status_thread_;
};

}  // namespace octosurf::node
