#include "io/text_file.hpp"
#include "run_outputs.hpp"

#include <string>

namespace octosurf {

void require_same_frame(RunState& run) {
  const std::size_t scans = run.statistics.scans(),
                    rejected = run.statistics.scans_with(AlignmentOutcome::rejected);
  const std::string& map = run.options.resume;
  if (map.empty() || 2 * rejected <= scans) return;
  run.refuse(std::to_string(rejected) + " of " + io::count_of(scans, "scan") + " contradict " + map +
                 " where their poses put them",
             "if the poses are in another frame, octosurf localize " + map + " " + run.context.input.front() +
                 " --reach 5 --turn 180 --write-poses FILE finds them, for --poses FILE");
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

}  // namespace octosurf
