#include "map_run.hpp"

#include "io/new_file.hpp"
#include "progress.hpp"
#include "surface_table.hpp"
#include "up_option.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <thread>
#include <utility>

#include <octosurf/diagnosis.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // a signal handler may not wait for a lock

/// While it lives, the first Ctrl-C or SIGTERM only sets `interrupted`; the second ends the program.
class InterruptGuard {
 public:
  InterruptGuard() {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = true; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &before_int_);
    sigaction(SIGTERM, &action, &before_term_);
  }
  ~InterruptGuard() {
    sigaction(SIGINT, &before_int_, nullptr);
    sigaction(SIGTERM, &before_term_, nullptr);
  }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction before_int_ {
  }, before_term_{};
};

std::string count_of(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace

MapRun::MapRun(const MapOptions& options, Map start, RunContext context, Clock::time_point begin)
    : options_(options),
      mapper_(std::move(start), options.threads),
      statistics_(mapper_.map().parameters()),
      context_(std::move(context)),
      begin_(begin) {}

void MapRun::adopt_octree() {
  changed_ = true;
  const double arrival_s = now_s();
  ScanReport report = mapper_.detect_in_occupancy();
  const double done_s = now_s();
  report.total_ms = 1e3 * (done_s - arrival_s);
  statistics_.add_occupancy(report, arrival_s, done_s);
}

void MapRun::map_scans(std::unique_ptr<ScanSource> source) {
  const InterruptGuard guard;
  const std::size_t listed = source->size();
  ScanFeed feed(std::move(source), options_.range);
  if (feed.size() == 0)
    throw Error(Error::Kind::usage, "--skip", "leaves none of the " + std::to_string(listed) + " scans");
  std::optional<Error> failure;
  try {
    insert_all(feed);
  } catch (const Error& error) {
    failure = error;
  }
  const std::vector<std::string> skipped = feed.skipped();
  context_.skipped_scans.insert(context_.skipped_scans.begin(), skipped.begin(), skipped.end());
  if (failure || interrupted) end_early(failure);
}

void MapRun::end_early(const std::optional<Error>& failure) {
  if (!changed_ && failure) throw Error(*failure);
  if (!changed_)
    throw Error(Error::Kind::data, "", "interrupted before a scan was mapped", "nothing is written");
  finish();
  const std::string saved = count_of(statistics_.scans(), "scan") + " mapped and saved";
  if (!failure)
    throw Error(Error::Kind::data, "", "interrupted, " + saved, "--resume " + options_.output + " goes on");
  const bool can_skip = failure->kind() == Error::Kind::data;
  throw Error(failure->kind(), "", failure->what(),
              saved + (can_skip ? ", --skip-bad goes on without it" : ""));
}

void MapRun::insert_all(ScanFeed& feed) {
  Progress progress(feed.size());
  saved_s_ = now_s();
  for (std::size_t done = 1; !interrupted; ++done) {
    const std::optional<Scan> scan = feed.next();
    if (!scan) break;
    try {
      insert(*scan);
    } catch (const Error& error) {
      if (!options_.source.skip_bad || error.kind() != Error::Kind::data) throw;
      context_.skipped_scans.emplace_back(error.what());
    }
    progress.show(done, count_of(mapper_.snapshot()->surfaces.size(), "surface"));
    checkpoint();
  }
}

void MapRun::insert(const Scan& scan) {
  double arrival_s = now_s();
  if (options_.realtime) {
    if (statistics_.scans() == 0) stamp_zero_s_ = arrival_s - scan.stamp_s;
    arrival_s = stamp_zero_s_ + scan.stamp_s;
    wait_for(arrival_s);
    if (interrupted) return;
  }
  const double start_s = now_s();
  ScanReport report = mapper_.insert(scan);
  const double done_s = now_s();
  report.total_ms = 1e3 * (done_s - start_s);  // what lies between the stages included
  statistics_.add(scan, report, arrival_s, done_s);
  changed_ = true;
}

void MapRun::wait_for(double arrival_s) const {
  constexpr double longest_s = 0.05;  // so that an interrupt is seen
  for (double left_s; !interrupted && (left_s = arrival_s - now_s()) > 0;)
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, longest_s)));
}

void MapRun::checkpoint() {
  if (options_.checkpoint_s <= 0 || now_s() - saved_s_ < options_.checkpoint_s) return;
  save_map(mapper_.map(), options_.output);
  saved_s_ = now_s();
}

void MapRun::finish() {
  save_map(mapper_.map(), options_.output);
  context_.wall_s = now_s();
  if (!options_.report.empty()) write_report();
  print_summary();
  warn_of_double_layers();
}

void MapRun::write_report() {
  NewFile file(options_.report, true);  // that it may be written was seen before the first scan
  file.write([&](std::ostream& out) { out << statistics_.to_json(mapper_.map(), context_) << '\n'; });
  file.commit();
}

void MapRun::print_summary() const {
  const Map::Size size = mapper_.map().size();
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  std::printf("%-12s %zu", "scans", static_cast<std::size_t>(statistics_.scans()));
  if (size.scans != statistics_.scans())
    std::printf(", %zu with those before", static_cast<std::size_t>(size.scans));
  if (!context_.skipped_scans.empty())
    std::printf(", %zu skipped, e.g. %s", context_.skipped_scans.size(), context_.skipped_scans[0].c_str());
  std::printf("\n%-12s %zu, of them %zu new\n", "points", statistics_.totals().points_raw,
              statistics_.totals().appeared);
  print_dropped();
  std::printf("%-12s %zu, %.2f m²\n", "surfaces", size.surfaces, total_area(*snapshot));
  std::printf("%-12s %zu of %zu points\n", "pending", size.pending, size.points);
  std::printf("%-12s %.1f s; a scan %.1f ms (95 %% within %.1f ms)\n", "time", now_s(),
              statistics_.scan_ms_percentile(0.5), statistics_.scan_ms_percentile(0.95));
  std::printf("%-12s %s.surfaces, %s.bt%s%s\n", "written", options_.output.c_str(), options_.output.c_str(),
              options_.report.empty() ? "" : ", ", options_.report.c_str());
  if (snapshot->surfaces.empty()) return;
  const Up up = up_of(mapper_.map());
  if (up.source != Up::Source::given) std::printf("%-12s %s\n", "up", describe(up).c_str());
  std::printf("\n");
  print_table(largest_surfaces(*snapshot, 5), up.direction);
}

void MapRun::warn_of_double_layers() const {
  const std::vector<DoubleLayer> layers = double_layers(*mapper_.snapshot());
  if (layers.empty()) return;
  const DoubleLayer& worst = *std::max_element(
      layers.begin(), layers.end(),
      [](const DoubleLayer& a, const DoubleLayer& b) { return a.overlap_m2 < b.overlap_m2; });
  std::fflush(stdout);  // so that it follows the summary
  std::fprintf(stderr, "warning: %s of two surfaces on one face, e.g. %u and %u: %.2f m² %.1f cm apart; %s\n",
               count_of(layers.size(), "pair").c_str(), worst.first, worst.second, worst.overlap_m2,
               100 * worst.distance_m,
               options_.report.empty() ? "--report FILE lists them" : "the report lists them");
}

void MapRun::print_dropped() const {
  const ScanReport& totals = statistics_.totals();
  const std::pair<std::size_t, const char*> reasons[] = {{totals.points_not_finite, "not finite"},
                                                         {totals.points_too_near, "nearer than min_range"},
                                                         {totals.points_out_of_map, "outside the octree"}};
  for (const auto& [count, reason] : reasons)
    if (count > 0) std::printf("%-12s %zu points: %s\n", "dropped", count, reason);
  if (totals.points_beyond_range > 0)
    std::printf("%-12s %zu points only freed space: beyond max_range\n", "far", totals.points_beyond_range);
}

}  // namespace octosurf
