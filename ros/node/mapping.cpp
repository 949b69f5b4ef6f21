#include "mapping.hpp"

#include "io/map_lock.hpp"
#include "surfaces/map_state.hpp"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf::node {
namespace {

/// "maps/office: 12 surfaces of revision 34 saved".
std::string kept_line(const std::string& stem, const Snapshot& snapshot, const std::string& what) {
  return stem + ": " + std::to_string(snapshot.surfaces.size()) + " surfaces of revision " +
         std::to_string(snapshot.revision) + " " + what;
}

constexpr std::int64_t pause_ns = 1'000'000'000;  // without a scan, by time stamps, as `octosurf map`

}  // namespace

Mapping::Mapping(Map start, const NodeOptions& options)
    : options_(options),
      sensors_(options),
      mapper_(std::make_shared<Mapper>(std::move(start), options.threads, paper_detector())),
      own_(options.output),
      lock_(own_),
      judge_(mapper_->map().parameters()),
      queue_(options.queue_mb << 20) {
  mapper_->share_octree();
  mapper_->remember_scans();
  show();
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Mapping::add_scan(RawMessage message) {
  {
    const std::lock_guard lock(mutex_);
    ++counts_.received;
    const std::size_t dropped = queue_.push({std::move(message), Sensors::Clock::now()});
    if (dropped > 0 && counts_.dropped == 0)
      std::fprintf(
          stderr,
          "warning: scans come faster than they are mapped; the oldest make way, %s/status counts them\n",
          options_.name.c_str());
    counts_.dropped += dropped;
  }
  work_.notify_all();
}

void Mapping::refuse(const std::string& what, std::uint64_t& count) {
  const std::lock_guard lock(mutex_);
  ++count;
  counts_.last_refusal = what;
  const auto now = Sensors::Clock::now();
  if (now - told_ < std::chrono::seconds(1)) return;  // a faulty sensor must not flood the log
  told_ = now;
  std::fprintf(stderr, "refused: %s (%llu so far)\n", what.c_str(), static_cast<unsigned long long>(count));
}

void Mapping::add_transforms(const RawMessage& message, bool fixed) try {
  warn(sensors_.add_transforms(message.bytes, fixed));
  const std::lock_guard lock(mutex_);
  ++counts_.transforms;
} catch (const std::runtime_error& error) {
  refuse(options_.tf + (fixed ? "_static: " : ": ") + error.what(), counts_.messages_refused);
}

void Mapping::add_camera(const RawMessage& message) try {
  sensors_.add_camera(message.bytes);
} catch (const std::runtime_error& error) {
  refuse(std::string("CameraInfo: ") + error.what(), counts_.messages_refused);
}

void Mapping::run(const std::stop_token& stop) try {
  for (;;) {
    std::optional<ScanQueue::Item> item;
    std::packaged_task<void()> task;
    {
      std::unique_lock lock(mutex_);
      const bool more = work_.wait_for(lock, stop, std::chrono::milliseconds(100),
                                       [&] { return !tasks_.empty() || queue_.size() > 0; });
      if (stop.stop_requested()) break;
      if (more && !tasks_.empty()) {
        task = std::move(tasks_.front());
        tasks_.pop_front();
      } else if (more) {
        item = queue_.pop();
        idle_ = false;
      }
    }
    if (task.valid()) task();
    if (item) map_scan(*item, stop);
    if (item) {
      const std::lock_guard lock(mutex_);
      idle_ = true;
    }
    save_checkpoint();
  }
} catch (...) {
  const std::lock_guard lock(mutex_);
  failure_ = std::current_exception();
  tasks_.clear();  // waiting threads get a broken promise
}

void Mapping::map_scan(const ScanQueue::Item& item, const std::stop_token& stop) try {
  const auto latest = item.came + std::chrono::duration_cast<Sensors::Clock::duration>(
                                      std::chrono::duration<double>(options_.wait_s));
  const ReceivedScan received = sensors_.scan_of(item.message.bytes, item.message.sent_ns, latest, stop);
  if (last_stamp_ns_ && std::abs(received.stamp_ns - *last_stamp_ns_) > pause_ns) {
    mapper_->drain();
    show();
  }
  const ScanReport report = mapper_->insert(received.scan);
  last_stamp_ns_ = received.stamp_ns;
  changed_ = true;
  show(&received);
  const bool rejected = report.alignment.outcome == AlignmentOutcome::rejected;
  std::optional<std::string> contradiction;
  if (!rejected) {
    constexpr std::uint64_t scans_of_verdict = 100;  // which takes 0.1 s, as much as a few of them
    judge_.add(received.scan, report.alignment.T_map_sensor);
    if (++judged_ % scans_of_verdict == 0) contradiction = judge_.judge().describe();
  }
  const std::lock_guard lock(mutex_);
  counts_.scan_ms = report.total_ms;
  ++(rejected ? counts_.rejected : counts_.mapped);
  if (!contradiction) return;
  if (counts_.contradiction.empty() && !contradiction->empty())
    std::fprintf(stderr, "warning: %s\n", contradiction->c_str());
  counts_.contradiction = *contradiction;
} catch (const std::runtime_error& error) {
  refuse(options_.scans() + ": " + error.what(), counts_.refused);
} catch (const std::bad_alloc&) {
  refuse(options_.scans() + ": no memory for a scan", counts_.refused);
}

void Mapping::warn(const std::string& what) {
  if (what.empty()) return;
  const std::lock_guard lock(mutex_);
  counts_.last_refusal = what;
  std::fprintf(stderr, "warning: %s\n", what.c_str());
}

void Mapping::show(const ReceivedScan* received) {
  const std::lock_guard lock(mutex_);
  shown_ = mapper_;
  revision_ = mapper_->snapshot()->revision;
  if (received != nullptr) {
    stamp_ns_ = received->stamp_ns;
    sensor_ = received->scan.T_map_sensor.translation();
  }
  up_ = mapper_->map().parameters().up.value_or(Eigen::Vector3d::UnitZ());
}

void Mapping::save_checkpoint() {
  const auto now = Sensors::Clock::now();
  if (options_.checkpoint_s <= 0 || !changed_ ||
      std::chrono::duration<double>(now - saved_).count() < options_.checkpoint_s)
    return;
  saved_ = now;
  try {
    save_map(mapper_->map(), own_);
    changed_ = false;
  } catch (const std::exception& error) {  // no space or no memory: there may be some the next time
    std::fprintf(stderr, "warning: no checkpoint, %s\n", error.what());
  }
}

void Mapping::do_between_scans(Work work) {
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    tasks_.push_back(std::move(task));
  }
  work_.notify_all();
  done.get();
}

std::string Mapping::save(const std::string& stem) {
  std::string done;
  do_between_scans([&] {
    const std::string& to = stem.empty() ? own_ : stem;
    save_map(mapper_->map(), to);
    if (to == own_) changed_ = false;
    done = kept_line(to, *mapper_->snapshot(), "saved");
  });
  return done;
}

std::string Mapping::load(const std::string& stem) {
  std::string done;
  do_between_scans([&] {
    const std::string from = stem.empty() ? own_ : stem;
    io::MapLock lock(from);
    LoadedMap loaded = load_map(from);
    auto mapper = std::make_shared<Mapper>(std::move(loaded.map), options_.threads, paper_detector());
    mapper->share_octree();
    mapper->remember_scans();
    lock_ = std::move(lock);
    mapper_ = std::move(mapper);
    done = kept_line(from, *mapper_->snapshot(), "loaded");
    if (!loaded.warning.empty()) done += "; " + loaded.warning;
    if (from != own_) done += "; saved there from now on, and no longer as " + own_;
    own_ = from;
    changed_ = false;
    show();
  });
  std::fprintf(stderr, "%s\n", done.c_str());
  return done;
}

std::string Mapping::clear(const SpacePart& part, bool as_free) {
  std::string done;
  do_between_scans([&] {
    const ScanReport report = mapper_->clear(part, as_free);
    changed_ = true;
    show();
    done = std::to_string(report.vanished) + " points taken back; " + std::to_string(report.gone.size()) +
           " surfaces gone, " + std::to_string(report.shrunk.size()) + " smaller";
  });
  return done;
}

MapMoment Mapping::moment() const {
  for (;;) {
    std::unique_lock lock(mutex_);
    const std::shared_ptr<const Mapper> mapper = shown_;
    const std::uint64_t revision = revision_;
    MapMoment moment{nullptr, stamp_ns_, sensor_, up_};
    lock.unlock();  // the thread need not wait while outlines are made
    moment.snapshot = mapper->snapshot();
    if (moment.snapshot->revision <= revision) return moment;
    // A scan is mapped, but not yet shown: its time and place follow at once.
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

std::shared_ptr<const planning::AskedMap> Mapping::asked(const MapMoment& moment) const {
  const std::lock_guard lock(asking_);
  if (!asked_ || asked_->snapshot != moment.snapshot)
    asked_ = std::make_shared<const planning::AskedMap>("the map", moment.snapshot, moment.snapshot->octree,
                                                        moment.up, asked_.get());
  return asked_;
}

MappingCounts Mapping::counts() const {
  const std::lock_guard lock(mutex_);
  MappingCounts counts = counts_;
  counts.waiting = queue_.size();
  return counts;
}

bool Mapping::failed() const {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

void Mapping::finish(const std::function<bool()>& hurry) {
  sensors_.end();
  for (std::size_t waiting = 1; waiting > 0 && !failed() && !hurry();) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::lock_guard lock(mutex_);
    waiting = queue_.size() + (idle_ ? 0 : 1);
  }
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  if (failure_) std::rethrow_exception(failure_);
  mapper_->drain();
  if (changed_) save_map(mapper_->map(), own_);
}

}  // namespace octosurf::node
