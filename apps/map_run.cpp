#include "map_run.hpp"

#include "interrupt_guard.hpp"
#include "io/text_file.hpp"
#include "last_line.hpp"
#include "progress.hpp"
#include "run_observers.hpp"
#include "run_scans.hpp"

#include <future>
#include <new>
#include <ranges>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

MapRun::MapRun(const MapOptions& options, Map start, KeptScans kept, RunContext context,
               RunState::Clock::time_point begin)
    : options_(options),
      run_(options, std::move(start), std::move(context), begin),
      observers_(outputs_of(run_, std::move(kept))),
      arrivals_([this] { return run_.now_s(); }),
      reserve_(std::make_unique_for_overwrite<std::byte[]>(std::size_t{8} << 20)) {}

void MapRun::run(const std::optional<std::filesystem::path>& octree, std::unique_ptr<ScanSource> source) {
  const InterruptGuard guard;
  bool cut_short = false;
  try {
    if (octree) take_over(*octree);
    if (source) map_scans(std::move(source));
    if (!interrupted()) {
      require_readings(run_);
      drain();
    }
    cut_short = interrupted();
    if (cut_short && !run_.changed)
      throw Error(Error::Kind::data, "", "interrupted before a scan was mapped", "nothing is written");
    save(Saving::end);
  } catch (const std::exception& failure) {
    const bool refused =
        dynamic_cast<const Error*>(&failure) != nullptr && !run_.changed && !run_.saving_last;
    if (refused) throw;  // its message is complete
    end_early(failure);
  }
  if (cut_short)
    throw Error(Error::Kind::data, "",
                "interrupted, " + io::count_of(run_.statistics.scans(), "scan") + " mapped and saved",
                "--resume " + options_.output + " goes on");
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
  RunScans scans(run_, std::move(source));
  try {
    insert_all(scans.feed());
  } catch (const Error&) {  // the report is still written
    scans.finish();
    throw;
  }
  scans.finish();
}

void MapRun::insert_all(ScanFeed& feed) {
  Progress progress(feed.size());
  run_.checkpoints.start(run_.now_s());
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
    if (is_pause(run_.last_stamp_s, scans.front().scan().stamp_s)) drain();
    if (options_.realtime) arrivals_.wait_and_join(scans, feed, run_.last_stamp_s);
    if (interrupted()) break;
    ahead = read_next();
    const double start_s = run_.now_s();
    insert(scans);
    arrivals_.inserted(run_.now_s() - start_s);
    done += scans.size();
    progress.show(done, [&] { return io::count_of(run_.mapper.snapshot()->surfaces.size(), "surface"); });
    if (run_.checkpoints.due(run_.now_s())) save(Saving::checkpoint);
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
        const InsertedScan inserted{scan, reports[i], options_.realtime ? arrivals_.of(scan) : start_s,
                                    done_s};
        run_.statistics.add(scan, reports[i], inserted.arrival_s, done_s);
        run_.last_stamp_s = scan.stamp_s;
        if (reports[i].alignment.outcome == AlignmentOutcome::rejected) continue;
        // Kept scans, which may fail, after the logs, so that these have all scans of the map.
        for (const auto& observer : std::views::reverse(observers_)) observer->after(inserted);
      }
      notify_of_change();
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
  if (run_.statistics.drain(run_.mapper, [this] { return run_.now_s(); })) notify_of_change();
} catch (const Error&) {
  if (!interrupted()) throw;
}

void MapRun::notify_of_change() {
  if (!run_.last_stamp_s) return;
  for (const auto& observer : observers_) observer->changed(*run_.last_stamp_s);
}

void MapRun::save(Saving saving) {
  if (saving == Saving::checkpoint && options_.strict && run_.statistics.judgement().contradicts()) return;
  for (const auto& observer : observers_) observer->save(saving);
  run_.checkpoints.start(run_.now_s());
}

void MapRun::end_early(const std::exception& failure) {
  reserve_.reset();
  const bool mapping = !run_.saving_last;
  const auto all_saved = [this] {
    return run_.checkpoints.any() && run_.checkpoints.scans() == run_.statistics.scans();
  };
  LastLine line;
  line.add("%s", reason_of(failure));
  if (dynamic_cast<const std::bad_alloc*>(&failure) != nullptr)
    line.add(" after %zu scans", static_cast<std::size_t>(run_.statistics.scans()));
  if (mapping && run_.changed) {
    try {
      save(Saving::end);
    } catch (const std::exception& error) {
      if (!all_saved()) line.add("; saving failed, too: %s", reason_of(error));
    }
  }
  line.add("; ");
  if (all_saved()) {
    const auto* error = dynamic_cast<const Error*>(&failure);
    const bool can_skip = mapping && error != nullptr && error->kind() == Error::Kind::data;
    line.add("%zu scan%s mapped and saved", run_.checkpoints.scans(),
             run_.checkpoints.scans() == 1 ? "" : "s");
    if (can_skip) line.add(", --skip-bad skips it");
  } else {
    line.add_last_of(run_.checkpoints);
    if (run_.checkpoints.any()) line.add(", --resume %s goes on", options_.output.c_str());
  }
  throw line;
}

}  // namespace octosurf
