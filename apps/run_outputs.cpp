#include "run_outputs.hpp"

#include "io/new_file.hpp"
#include "io/text_file.hpp"
#include "open_map.hpp"
#include "readable.hpp"

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace octosurf {
namespace {

void print_dropped(const ScanReport& totals) {
  const std::pair<std::size_t, const char*> reasons[] = {{totals.points_not_finite, "not finite"},
                                                         {totals.points_too_near, "nearer than min_range"},
                                                         {totals.points_out_of_map, "outside the octree"}};
  for (const auto& [count, reason] : reasons)
    if (count > 0) std::printf("%-12s %zu points: %s\n", "dropped", count, reason);
  if (totals.points_beyond_range > 0)
    std::printf("%-12s %zu points only freed space: beyond max_range\n", "far", totals.points_beyond_range);
}

void print_alignment(const RunStatistics& statistics) {
  const std::size_t corrected = statistics.scans_with(AlignmentOutcome::corrected),
                    recovered = statistics.scans_with(AlignmentOutcome::recovered),
                    rejected = statistics.scans_with(AlignmentOutcome::rejected);
  if (corrected + recovered + rejected == 0) return;
  std::printf("%-12s %zu corrected", "poses", corrected + recovered);
  if (recovered > 0) std::printf(", %zu of them far off", recovered);
  if (rejected > 0) std::printf("; %s left out", io::count_of(rejected, "scan").c_str());
  std::printf("\n");
}

void print_scans(const RunState& run, const Map::Size& size) {
  const auto scans = static_cast<std::size_t>(run.statistics.scans());
  std::printf("%-12s %zu", "scans", scans);
  if (size.scans + run.statistics.scans_with(AlignmentOutcome::rejected) != scans)
    std::printf(", %zu with those before", static_cast<std::size_t>(size.scans));
  if (const std::vector<std::string>& skipped = run.context.skipped_scans; !skipped.empty())
    std::printf(", %zu skipped, e.g. %s", skipped.size(), skipped[0].c_str());
  std::printf("\n");
}

void print_summary(const RunState& run, const std::filesystem::path& kept_scans) {
  const Map& map = run.mapper.map();
  const Map::Size size = map.size();
  const RunStatistics& statistics = run.statistics;
  const std::shared_ptr<const Snapshot> snapshot = run.mapper.snapshot();
  print_scans(run, size);
  std::printf("%-12s %zu, of them %zu new\n", "points", statistics.totals().points_raw,
              statistics.totals().appeared);
  print_dropped(statistics.totals());
  print_alignment(statistics);
  print_agreement(statistics.judgement());
  std::printf("%-12s %zu, %.2f m²\n", "surfaces", size.surfaces, total_area(*snapshot));
  if (const auto& ids = run.context.succeeded)
    std::printf("%-12s %zu as before, %zu new; %zu of those before are gone\n", "ids", ids->kept, ids->born,
                ids->gone.size());
  std::printf("%-12s %zu of %zu points\n", "pending", size.pending, size.points);
  std::printf("%-12s %.1f s; a scan %.1f ms (95 %% within %.1f ms)\n", "time", run.now_s(),
              statistics.scan_ms().percentile(0.5), statistics.scan_ms().percentile(0.95));
  std::printf("%-12s %s.surfaces, %s.bt", "written", run.options.output.c_str(), run.options.output.c_str());
  for (const std::string& file : {kept_scans.string(), run.options.write_poses, run.options.report})
    if (!file.empty()) std::printf(", %s", file.c_str());
  std::printf("\n");
  if (snapshot->surfaces.empty()) return;
  const Up up = up_of(map);
  if (up.source != Up::Source::given) std::printf("%-12s %s\n", "up", describe(up).c_str());
  print_readable({{"largest", largest_surfaces(*snapshot, 5, up.direction)}});
}

/// Clouds without poses are from a sensor that stood still, or their poses are in a file that was not given.
void warn_of_missing_poses(const RunState& run) {
  const auto scans = static_cast<std::size_t>(run.statistics.scans());
  if (run.options.source.viewpoint || scans == 0 || run.statistics.scans_at_origin() < scans) return;
  std::fprintf(
      stderr,
      "warning: all scans (%zu) are mapped from the map's origin, as they came without poses: --poses "
      "FILE gives them, --viewpoint X Y Z that of a sensor that stood still\n",
      scans);
}

}  // namespace

void require_same_frame(RunState& run) {
  const std::size_t scans = run.statistics.scans(),
                    rejected = run.statistics.scans_with(AlignmentOutcome::rejected);
  const std::string& map = run.options.resume;
  if (map.empty() || 2 * rejected <= scans) return;
  run.refuse(std::to_string(rejected) + " of " + io::count_of(scans, "scan") + " contradict " + map +
                 " where their poses put them",
             "if the poses are in another frame, --locate finds it in the map");
}

void require_readings(RunState& run) {
  if (run.statistics.scans() == 0) return;
  const ScanReport& totals = run.statistics.totals();
  const std::string units =
      "check the units: --depth-scale says how many there are to a metre; poses are in metres";
  const std::size_t readings = totals.points_raw - totals.points_not_finite;
  const std::size_t mapped =
      readings - totals.points_too_near - totals.points_out_of_map - totals.points_beyond_range;
  // A map of a hundredth of what was seen is none, unless a range was given.
  constexpr std::size_t hardly_any = 100;
  const bool range_given = run.mapper.map().parameters().occupancy.max_range.has_value();
  if (mapped > 0 && (range_given || mapped >= readings / hardly_any)) return;
  const std::string how_many =
      mapped == 0 ? "no reading was"
                  : "only " + std::to_string(mapped) + " of " + std::to_string(readings) + " readings were";
  if (totals.points_beyond_range + totals.points_out_of_map > 0)
    run.refuse(how_many + " mapped, all " + (mapped == 0 ? "" : "others ") +
                   "lie beyond the maximum range, or outside the octree",
               units + (range_given ? "" : "; --max-range says how far readings are mapped"));
  if (totals.points_too_near > 0) run.refuse(how_many + " mapped, all are nearer than min_range", units);
  run.refuse("the scans hold no readings", "check the input");
}

void report(RunState& run, const std::filesystem::path& kept_scans) {
  const Map& map = run.mapper.map();
  const std::string& file = run.options.report;
  run.context.wall_s = run.now_s();
  if (!file.empty())
    io::write_file(file, run.options.force,
                   [&](std::ostream& out) { out << run.statistics.to_json(map, run.context) << '\n'; });
  print_summary(run, kept_scans);
  std::fflush(stdout);           // warnings follow the summary
  if (!run.context.succeeded) {  // else the run that built it has told
    warn_of_missing_poses(run);
    if (!run.statistics.judgement().contradicts()) warn_of_up(map);
  }
  warn_of(run.statistics.judgement(), run.options.check);
}

}  // namespace octosurf
