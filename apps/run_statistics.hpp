#pragma once

#include "surfaces/succession.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/judgement.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// Data of a report besides the scans' results.
struct RunContext {
  std::vector<std::string> input;          ///< as given by the user
  std::vector<std::string> skipped_scans;  ///< a line each: which, and why
  std::size_t mapped_before = 0;           ///< scans left out, as the map has them
  std::vector<std::string> warnings;
  double wall_s = 0;                             ///< the whole run, reading and saving included
  std::optional<surfaces::Succeeded> succeeded;  ///< surfaces, of a map that was rebuilt

  /// Prints a warning, and keeps it; nothing if it is empty.
  void warn(const std::string& warning);
};

/// Values of a run's scans. Percentiles are nearest-rank, by weight: of all values up to 2¹⁴, then of every
/// second, fourth, … one, so that memory is bounded.
class Spread {
 public:
  void add(double value, double weight = 1);
  double percentile(double share) const;  ///< 0 without values
  nlohmann::ordered_json to_json(const std::vector<std::pair<const char*, double>>& shares) const;
  std::uint64_t count() const { return count_; }
  double sum() const { return sum_; }  ///< of all, each times its weight
  double mean() const { return sum_ / weight_; }

 private:
  std::vector<std::pair<double, double>> kept_;  // value and weight
  std::uint64_t count_ = 0, step_ = 1;
  double sum_ = 0, weight_ = 0, max_ = 0;
};

/// Alignment of one run's poses.
struct AlignmentTotals {
  std::array<std::size_t, alignment_outcome_names.size()> outcomes{};  ///< scans
  Spread corrections_m, corrections_deg;  ///< of the scans that were corrected or recovered
};

/// Collects the results of one run's scans for the report (docs/formats.md §1). Times are in seconds on one
/// clock of the caller's.
class RunStatistics {
 public:
  explicit RunStatistics(const Parameters& parameters) : judge_(parameters) {}

  /// `arrival_s`: when the scan was available, `done_s`: when its surfaces could be read.
  void add(const Scan& scan, const ScanReport& report, double arrival_s, double done_s);

  /// The pass over an occupancy map: counts everything except a scan and sensor time.
  void add_occupancy(const ScanReport& report, double arrival_s, double done_s);

  /// Mapper::drain(), at the end or a pause of the input. False if nothing waited.
  bool drain(Mapper& mapper, const std::function<double()>& now_s);

  /// The report. `map`: after the run. What is not defined, such as a rate without increasing time stamps, is
  /// null. `points_per_second` is per second of time stamps, to one mean period after the last one's.
  std::string to_json(const Map& map, const RunContext& context = {}) const;

  std::uint64_t scans() const { return scans_; }
  std::uint64_t scans_at_origin() const { return scans_at_origin_; }  ///< stated pose: exactly the identity
  std::size_t scans_with(AlignmentOutcome outcome) const {
    return alignment_.outcomes[static_cast<std::size_t>(outcome)];
  }
  const Judgement& judgement() const;                   ///< of the scans that were mapped
  const ScanReport& totals() const { return totals_; }  ///< counts only; no ids, no times
  const Spread& scan_ms() const { return scan_ms_; }

 private:
  ScanReport totals_;
  std::uint64_t scans_ = 0, scans_at_origin_ = 0;
  double first_stamp_s_ = 0, last_stamp_s_ = 0;
  double first_arrival_s_ = -1, first_detection_s_ = -1;  // -1: none yet
  Spread scan_ms_, drain_ms_;
  Spread waiting_;  // readings, after each scan
  std::array<Spread, stage_names.size()> stage_ms_;
  Spread lag_s_;  // by the points that each scan categorised
  AlignmentTotals alignment_;
  RecordingJudge judge_;
  mutable Judgement judgement_;
  mutable std::uint64_t judged_ = 0;  // scans of which that is
};

/// A gap between scans after which everything waiting is processed: 1 s, by time stamps, so that the map does
/// not depend on the machine.
bool is_pause(std::optional<double> last_stamp_s, double stamp_s);

/// One line of a run's summary; none without scans.
void print_agreement(const Judgement& judgement);
/// On stderr, if the scans contradict each other. `check`: the command that finds the cause, or empty.
void warn_of(const Judgement& judgement, const std::string& check = {});
/// Throws Error(data) if they do: `output`, a map, is not written.
void require_agreement(const Judgement& judgement, const std::string& output);

/// Parameters by name, as a JSON object: numbers, booleans and get_parameter()'s words. Angles in degrees.
std::string parameters_json(const Parameters& parameters);

/// The surfaces of largest area, at most `count`, ties by id: a list of objects. `up`: for their slopes.
nlohmann::ordered_json largest_surfaces(const Snapshot& snapshot, std::size_t count,
                                        const Eigen::Vector3d& up);

double total_area(const Snapshot& snapshot);  ///< m²

}  // namespace octosurf
