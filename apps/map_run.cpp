#include "map_run.hpp"

#include "geometry/interruption.hpp"
#include "geometry/median.hpp"
#include "interrupt_guard.hpp"
#include "io/text_file.hpp"
#include "progress.hpp"
#include "run_outputs.hpp"
#include "sensing/fingerprint.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <future>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

/// Throws Error(data) for a lidar's scan that reaches farther than one sees.
void require_metres(const Scan& scan) {
  constexpr double farthest =
      300;  // m: no robot's sensor reaches so far, and such rays take hours and all memory
  if (scan.sensor != SensorKind::lidar) return;
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); std::isfinite(range)) ranges.push_back(range);
  if (ranges.empty() || static_cast<double>(geometry::median_of(ranges)) <= farthest) return;
  throw Error(Error::Kind::data, scan.name,
              "most of its readings reach farther than 300 m, as if not in metres",
              "--depth-scale 1000 for millimetres, 100 for centimetres; 1, if they are metres");
}

/// Throws Error(data) for a pose that is no place.
void require_near(const Scan& scan, const Eigen::Vector3d& origin) {
  constexpr double farthest = 1e8;  // m: nothing on Earth is, and doubles resolve 10 nm there
  const Eigen::Vector3d place = scan.T_map_sensor.translation() + origin;
  if (place.lpNorm<Eigen::Infinity>() <= farthest) return;
  throw Error(Error::Kind::data, scan.name, "its pose lies " + io::text_of(place) + " m from 0",
              "check that poses are in metres, and of the form that --pose-form says");
}

/// Returns how many there are.
std::size_t print_notes(const std::vector<std::string>& notes, std::size_t begin) {
  for (std::size_t i = begin; i < notes.size(); ++i) std::printf("%s\n", notes[i].c_str());
  return notes.size();
}

}  // namespace

MapRun::MapRun(const MapOptions& options, Map start, ScanKeeper keeper, RunContext context,
               RunState::Clock::time_point begin)
    : options_(options),
      run_{.options = options,
           .mapper = Mapper(std::move(start), options.threads, paper_detector()),
           .context = std::move(context),
           .begin = begin},
      keeper_(std::move(keeper)),
      poses_(options.write_poses, options.force, run_.mapper.map().origin()),
      checkpoints_(options.output, options.checkpoint_s, options.force && options.resume.empty()),
      live_(options.serve_port ? live_view(run_) : nullptr),
      arrivals_([this] { return run_.now_s(); }),
      reserve_(std::make_unique_for_overwrite<std::byte[]>(std::size_t{8} << 20)) {}

void MapRun::run(const std::optional<std::filesystem::path>& octree, std::unique_ptr<ScanSource> source) {
  const InterruptGuard guard;
  run_.mapper.remember_scans();
  bool cut_short = false;
  try {
    if (octree) take_over(*octree);
    if (source) map_scans(std::move(source));
    if (!interrupted()) {
      require_readings(run_);
      require_same_frame(run_);
      drain();
    }
    cut_short = interrupted();
    if (cut_short && !run_.changed)
      throw Error(Error::Kind::data, "", "interrupted before a scan was mapped", "nothing is written");
    save(Saving::end);
  } catch (const std::exception& failure) {
    const bool refused = dynamic_cast<const Error*>(&failure) != nullptr && !run_.changed && !saving_last_;
    if (refused) throw;  // its message is complete
    end_early(failure);
  }
  if (cut_short)
    throw Error(Error::Kind::data, "",
                "interrupted, " + io::count_of(run_.statistics.scans(), "scan") + " mapped and saved",
                "--resume " + options_.output + " goes on");
}

void MapRun::rebuild(std::unique_ptr<ScanSource> source, const Finish& finish) {
  map_scans(std::move(source));
  drain();
  geometry::end_if_interrupted();
  Map map = std::move(run_.mapper).release();
  run_.context.succeeded = finish(map, keeper_.kept().poses);
  run_.mapper = Mapper(std::move(map), options_.threads, paper_detector());
  geometry::end_if_interrupted();
  save(Saving::end);
}

void MapRun::take_over(const std::filesystem::path& octree) {
  const double arrival_s = run_.now_s();
  ScanReport report =
      options_.resume.empty()
          ? run_.mapper.detect_in_occupancy()
          : run_.mapper.replace_occupancy(map_from_octomap(octree, run_.mapper.map().parameters()));
  const double done_s = run_.now_s();
  report.total_ms = 1e3 * (done_s - arrival_s);
  run_.statistics.add_occupancy(report, arrival_s, done_s);
  run_.changed = true;
}

void MapRun::map_scans(std::unique_ptr<ScanSource> source) {
  const Map& map = run_.mapper.map();
  const Eigen::Vector3d origin = map.origin();
  const std::size_t listed = source->size(), printed = print_notes(source->notes(), 0);
  std::vector<std::uint64_t> held = surfaces::state_of(map).held;  // scans of before this run
  std::ranges::sort(held);
  bool checks_unit = !map.parameters().occupancy.max_range && !options_.source.depth_scale;
  ScanFeed feed(std::move(source), options_.range, [&](const Scan& scan) {
    if (std::exchange(checks_unit, false)) require_metres(scan);
    require_near(scan, origin);
    return held.empty() || !std::ranges::binary_search(held, sensing::fingerprint_of(scan));
  });
  if (feed.size() == 0)
    throw Error(Error::Kind::usage, "--skip", "leaves none of the " + std::to_string(listed) + " scans");
  const auto finish = [&] {
    print_notes(feed.notes(), printed);
    std::vector<std::string>& skipped = run_.context.skipped_scans;
    skipped.insert(skipped.begin(), feed.skipped().begin(), feed.skipped().end());
    run_.context.mapped_before = feed.refused();
    if (feed.refused() > 0)
      std::printf("%s left out: %s in the map already\n", io::count_of(feed.refused(), "scan").c_str(),
                  feed.refused() == 1 ? "it is" : "they are");
  };
  try {
    insert_all(feed);
  } catch (const Error&) {  // the report is still written
    finish();
    throw;
  }
  finish();
}

void MapRun::insert_all(ScanFeed& feed) {
  Progress progress(feed.size());
  checkpoints_.start(run_.now_s());
  // Without another thread, or if none can be started, get() calls next().
  const auto policy =
      options_.threads > 1 ? std::launch::async | std::launch::deferred : std::launch::deferred;
  const auto read_next = [&] { return std::async(policy, [&] { return next(feed); }); };
  std::future<std::optional<PreparedScan>> ahead = read_next();
  std::vector<PreparedScan> scans;
  for (std::size_t done = 0; !interrupted();) {
    std::optional<PreparedScan> first = ahead.get();
    if (!first) break;
    scans.clear();
    scans.push_back(std::move(*first));
    if (is_pause(last_stamp_s_, scans.front().scan().stamp_s)) drain();
    if (options_.realtime) arrivals_.wait_and_join(scans, feed, last_stamp_s_);
    if (interrupted()) break;
    ahead = read_next();
    insert(scans);
    done += scans.size();
    progress.show(done, [&] { return io::count_of(run_.mapper.snapshot()->surfaces.size(), "surface"); });
    if (checkpoints_.due(run_.now_s())) save(Saving::checkpoint);
  }
}

std::optional<PreparedScan> MapRun::next(ScanFeed& feed) const {
  std::optional<Scan> scan = feed.next();
  if (!scan) return {};
  if (options_.threads == 1 || (options_.realtime && arrivals_.of(*scan) > run_.now_s()))
    return PreparedScan(std::move(*scan));
  return run_.mapper.prepare(std::move(*scan));
}

void MapRun::insert(std::span<const PreparedScan> scans) {
  while (!scans.empty()) {
    try {
      const double start_s = run_.now_s();
      std::vector<ScanReport> reports = run_.mapper.insert_all(scans);
      const double done_s = run_.now_s();
      // Includes the time between stages.
      if (reports.size() == 1) reports.front().total_ms = 1e3 * (done_s - start_s);
      run_.changed = true;
      for (std::size_t i = 0; i < reports.size(); ++i) {
        const Scan& scan = scans[i].scan();
        run_.statistics.add(scan, reports[i], options_.realtime ? arrivals_.of(scan) : start_s, done_s);
        last_stamp_s_ = scan.stamp_s;
        if (reports[i].alignment.outcome == AlignmentOutcome::rejected) continue;
        const Eigen::Isometry3d& T_map_sensor = reports[i].alignment.T_map_sensor;
        poses_.add(scan.stamp_s, T_map_sensor);
        keeper_.add(scan, T_map_sensor);  // may fail: last, so that the log has all scans of the map
      }
      scans = scans.subspan(reports.size());
    } catch (const Error& error) {
      if (interrupted()) return;  // within a scan, which is not in the map
      if (!options_.source.skip_bad || error.kind() != Error::Kind::data) throw;
      run_.context.skipped_scans.emplace_back(error.what());
      scans = scans.subspan(1);
    }
  }
}

void MapRun::drain() try {
  run_.statistics.drain(run_.mapper, [this] { return run_.now_s(); });
} catch (const Error&) {
  if (!interrupted()) throw;
}

void MapRun::save(Saving saving) {
  if (saving == Saving::checkpoint && options_.strict && run_.statistics.judgement().contradicts()) return;
  const Map& map = run_.mapper.map();
  const std::size_t scans = run_.statistics.scans();
  keeper_.save();  // first what a saved map refers to
  if (saving == Saving::checkpoint) {
    checkpoints_.try_to_save(map, scans, keeper_.kept());
    poses_.save(saving);
  } else {
    saving_last_ = true;
    if (options_.strict) require_agreement(run_.statistics.judgement(), options_.output);
    checkpoints_.save(map, scans, keeper_.kept());
    poses_.save(saving);
    report(run_, keeper_.folder_written());
  }
  checkpoints_.start(run_.now_s());
}

void MapRun::end_early(const std::exception& failure) {
  reserve_.reset();
  const bool mapping = !saving_last_;
  const std::size_t scans = run_.statistics.scans();
  const auto all_saved = [&] { return checkpoints_.scans() == scans; };
  std::string line = reason_of(failure);
  if (dynamic_cast<const std::bad_alloc*>(&failure) != nullptr)
    line += " after " + std::to_string(scans) + " scans";
  if (mapping && run_.changed) {
    try {
      save(Saving::end);
    } catch (const std::exception& error) {
      if (!all_saved()) line += std::string("; saving failed, too: ") + reason_of(error);
    }
  }
  if (all_saved()) {
    const auto* error = dynamic_cast<const Error*>(&failure);
    const bool can_skip = mapping && error != nullptr && error->kind() == Error::Kind::data;
    line +=
        "; " + io::count_of(scans, "scan") + " mapped and saved" + (can_skip ? ", --skip-bad skips it" : "");
  } else {
    line += "; " + checkpoints_.last() +
            (checkpoints_.scans() ? ", --resume " + options_.output + " goes on" : "");
  }
  throw std::runtime_error(line);
}

}  // namespace octosurf
