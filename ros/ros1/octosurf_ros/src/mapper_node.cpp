#include "mapper_node.hpp"

#include <filesystem>
#include <ros/console.h>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::ros1 {

template <class Service, class Answer>
void MapperNode::serve(const std::string& name, const Answer& answer) {
  const boost::function<bool(typename Service::Request&, typename Service::Response&)> callback =
      [this, answer](typename Service::Request& request, typename Service::Response& response) {
        response = answer(request);
        return true;
      };
  services_.push_back(own_.advertiseService(name, callback));
}

namespace {

const ros::Duration pause(1);  // without a scan, by time stamps, as `octosurf map`

/// What `work` says it has done, or why it has not.
template <class Response, class Work>
Response done(std::mutex& mapping, const Work& work) {
  Response response;
  const std::lock_guard lock(mapping);
  try {
    response.message = work();
    response.success = true;
    ROS_INFO_STREAM(response.message);
  } catch (const std::exception& error) {
    response.message = error.what();
    ROS_ERROR_STREAM(response.message);
  }
  return response;
}

bool is_map(const std::string& stem) { return std::filesystem::exists(stem + ".surfaces"); }

}  // namespace

MapperNode::MapperNode()
    : settings_(read_settings(own_)),
      options_(own_),
      mapper_(settings_.parameters, settings_.threads),
      map_file_(settings_.map),
      status_topic_(own_.advertise<octosurf_msgs::Status>("status", 100, true)),
      publisher_(own_, settings_.fixed_frame, [this] { return options_(); }),
      intake_(node_, settings_, [this] { return options_(); }) {
  if (settings_.resume && !map_file_.empty() && is_map(map_file_)) {
    const std::lock_guard lock(mapping_);
    ROS_INFO_STREAM(load({}));
  }
  mapper_.share_octree();
  show({});
  using octosurf_msgs::ContactRegions;
  using octosurf_msgs::Load;
  using octosurf_msgs::Plan;
  using octosurf_msgs::Query;
  using octosurf_msgs::Save;
  serve<Query>("query", [this](const Query::Request& request) { return answer(*asked(), request); });
  serve<ContactRegions>("contact_regions",
                        [this](const ContactRegions::Request& request) { return answer(*asked(), request); });
  serve<Plan>("plan", [this](const Plan::Request& request) { return answer(*asked(), request); });
  serve<Save>("save", [this](const Save::Request& request) {
    return done<Save::Response>(mapping_, [&] { return save(request.file); });
  });
  serve<Load>("load", [this](const Load::Request& request) {
    return done<Load::Response>(mapping_, [&] { return load(request.file); });
  });
  thread_ = std::thread([this] { run(); });
}

MapperNode::~MapperNode() { finish(); }

bool MapperNode::finish() {
  intake_.stop();
  if (!thread_.joinable()) return true;
  thread_.join();
  const std::lock_guard lock(mapping_);
  if (!settings_.save_at_end || map_file_.empty()) return true;
  try {
    mapper_.drain();
    if (unsaved_) ROS_INFO_STREAM(save({}));
    return true;
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("the map is not saved: " << error.what());
    return false;
  }
}

std::shared_ptr<const AskedMap> MapperNode::asked() {
  const std::lock_guard alone(asking_);
  std::shared_ptr<const Snapshot> snapshot;
  {
    const std::lock_guard lock(latest_mutex_);
    snapshot = latest_;
  }
  if (!asked_ || asked_->snapshot != snapshot)
    asked_ = std::make_shared<const AskedMap>(snapshot, asked_.get());
  return asked_;
}

void MapperNode::run() {
  while (true) {
    try {
      const std::optional<PosedScan> scan = intake_.next();
      if (!scan) return;
      insert(*scan);
    } catch (const std::bad_alloc&) {
      refuse("out of memory");
    } catch (const std::exception& error) {
      refuse(error.what());
    }
  }
}

void MapperNode::insert(const PosedScan& posed) {
  if (!options_().enabled)
    throw Error(Error::Kind::data, posed.scan.name, "is not mapped, as ~enabled is off");
  const std::lock_guard lock(mapping_);
  if (!last_stamp_.isZero() && posed.stamp - last_stamp_ > pause) mapper_.drain();
  const ScanReport report = mapper_.insert(posed.scan);
  last_stamp_ = posed.stamp;
  unsaved_ = true;
  ++(report.alignment.outcome == AlignmentOutcome::set_aside ? status_.set_aside : status_.mapped);
  status_.scan_ms = report.total_ms;
  show(posed.stamp);
  checkpoint();
}

void MapperNode::refuse(const std::string& why) {
  ROS_WARN_STREAM("refused: " << why);
  const std::lock_guard lock(mapping_);
  hear();
  ++status_.refused;
  status_.last_refusal = why;
  show(status_.header.stamp);
}

void MapperNode::checkpoint() {
  const double period = options_().checkpoint_period;
  if (period == 0 || map_file_.empty() ||
      std::chrono::steady_clock::now() - saved_at_ < std::chrono::duration<double>(period))
    return;
  try {
    ROS_INFO_STREAM(save({}));
  } catch (const std::exception& error) {  // mapping goes on, and the next one may succeed
    saved_at_ = std::chrono::steady_clock::now();
    ROS_ERROR_STREAM("no checkpoint: " << error.what());
  }
}

/// What came besides scans, into the status.
void MapperNode::hear() {
  const Heard heard = intake_.heard();
  if (heard.messages_refused != status_.messages_refused) status_.last_refusal = heard.last_refusal;
  status_.messages_refused = heard.messages_refused;
  status_.transforms = heard.transforms;
  status_.scan_publishers = heard.scan_publishers;
  status_.camera_publishers = heard.camera_publishers;
  status_.transform_publishers = heard.transform_publishers;
}

void MapperNode::show(ros::Time stamp) {
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  {
    const std::lock_guard lock(latest_mutex_);
    latest_ = snapshot;
  }
  publisher_.show(snapshot, stamp);
  hear();
  const ScanQueue::Counts counts = intake_.counts();
  status_.header.stamp = stamp;
  status_.header.frame_id = settings_.fixed_frame;
  status_.revision = snapshot->revision;
  status_.surfaces = static_cast<std::uint32_t>(snapshot->surfaces.size());
  status_.waiting = counts.waiting;
  status_.received = counts.received;
  status_.dropped = counts.dropped;
  status_topic_.publish(status_);
}

std::string MapperNode::file_of(const std::string& asked_for) const {
  if (!asked_for.empty()) return asked_for;
  if (map_file_.empty()) throw Error(Error::Kind::usage, "~map", "is empty", "name a file");
  return map_file_;
}

std::string MapperNode::save(const std::string& file) {
  const std::string stem = file_of(file);
  save_map(mapper_.map(), stem);
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  saved_at_ = std::chrono::steady_clock::now();
  if (stem == map_file_) unsaved_ = false;
  return services::kept_line(stem, *snapshot, "saved");
}

std::string MapperNode::load(const std::string& file) {
  const std::string stem = file_of(file);
  LoadedMap loaded = load_map(stem);
  require_z_up(loaded.map.parameters(), stem);
  if (!loaded.warning.empty()) ROS_WARN_STREAM(loaded.warning);
  mapper_ = Mapper(std::move(loaded.map), settings_.threads);
  mapper_.share_octree();
  show(status_.header.stamp);
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  map_file_ = stem;
  unsaved_ = false;
  return services::kept_line(stem, *snapshot, "loaded");
}

}  // namespace octosurf::ros1
