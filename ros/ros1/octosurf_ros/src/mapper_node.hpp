#pragma once

#include "answers.hpp"
#include "dynamic_options.hpp"
#include "publisher.hpp"
#include "scan_intake.hpp"
#include "settings.hpp"

#include <chrono>
#include <memory>
#include <mutex>
#include <octosurf_msgs/Load.h>
#include <octosurf_msgs/Save.h>
#include <octosurf_msgs/Status.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <string>
#include <thread>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::ros1 {

/// The node: scans in, the map out, questions about it answered. One thread maps, one publishes, those of
/// ROS' spinner take messages and answer; what they share are snapshots.
class MapperNode {
 public:
  /// Throws Error for parameters that make no sense and a map that cannot be gone on with.
  MapperNode();
  MapperNode(const MapperNode&) = delete;
  MapperNode& operator=(const MapperNode&) = delete;
  ~MapperNode();

  /// No more scans; the one at work is finished and, if it is asked for, the map saved. Returns false if that
  /// failed.
  bool finish();

 private:
  void run();
  void insert(const PosedScan& scan);
  void refuse(const std::string& why);
  void checkpoint();
  void hear();
  void show(ros::Time stamp);
  std::shared_ptr<const AskedMap> asked();

  /// Both with mapping_ locked. `file` empty: map_file_. Return what was done; throw Error.
  std::string save(const std::string& file);
  std::string load(const std::string& file);
  std::string file_of(const std::string& asked_for) const;

  template <class Service, class Answer>
  void serve(const std::string& name, const Answer& answer);

  ros::NodeHandle node_, own_{"~"};
  const Settings settings_;
  const DynamicOptions options_;

  std::mutex mapping_;  ///< of mapper_ and of what stands with it
  Mapper mapper_;
  std::string map_file_;  ///< of what was loaded last, else ~map
  ros::Time last_stamp_;  ///< of the scans that were mapped
  bool unsaved_ = false;  ///< it is not what map_file_ holds
  std::chrono::steady_clock::time_point saved_at_ = std::chrono::steady_clock::now();
  octosurf_msgs::Status status_;

  std::mutex latest_mutex_, asking_;
  std::shared_ptr<const Snapshot> latest_;  ///< with latest_mutex_, which is never held for long
  std::shared_ptr<const AskedMap> asked_;   ///< with asking_: the latest that was asked about

  ros::Publisher status_topic_;
  Publisher publisher_;
  ScanIntake intake_;
  std::vector<ros::ServiceServer> services_;
  std::thread thread_;
};

}  // namespace octosurf::ros1
