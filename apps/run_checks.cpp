#include "run_observers.hpp"
#include "run_warnings.hpp"

#include <array>
#include <cstdio>
#include <string>

namespace octosurf {
namespace {

/// That readings are mapped at all.
class ReadingsCheck : public RunObserver {
 public:
  explicit ReadingsCheck(RunState& run) : run_(run) {}

  void before(const Scan& scan) override {
    if (run_.statistics.scans() > 0) return;
    const MapOptions& options = run_.options;
    const Parameters& parameters = run_.mapper.map().parameters();
    if (!run_.poses_elsewhere && options.viewpoint.empty())
      require_poses(scan, run_.feed->peek(), options.inputs);
    near_sensor_ = warn_of_units(scan, parameters);
    run_.context.warn(spacing_warning(scan, parameters));
  }

  void after_all() override {
    const ScanReport& totals = run_.statistics.totals();
    if (run_.statistics.scans() == 0) return;
    const std::string units =
        "check the units: --depth-scale says how many there are to a metre in images, --cloud-scale in "
        "clouds; poses are in metres";
    if (near_sensor_ && run_.mapper.snapshot()->surfaces.empty())
      run_.refuse("no surface was found, as hardly a reading is more than a few voxels from the sensor",
                  units);
    const std::size_t readings = totals.points_raw - totals.points_not_finite;
    const std::size_t mapped =
        readings - totals.points_too_near - totals.points_out_of_map - totals.points_beyond_range;
    // A map of a hundredth of what was seen is none, unless a range was given.
    constexpr std::size_t hardly_any = 100;
    const bool range_given = run_.mapper.map().parameters().occupancy.max_range.has_value();
    if (mapped > 0 && (range_given || mapped >= readings / hardly_any)) return;
    const std::string how_many =
        mapped == 0 ? "no reading was"
                    : "only " + std::to_string(mapped) + " of " + std::to_string(readings) + " readings were";
    if (totals.points_beyond_range + totals.points_out_of_map > 0)
      run_.refuse(how_many + " mapped, all " + (mapped == 0 ? "" : "others ") +
                      "lie beyond the maximum range, or outside the octree",
                  units + (range_given ? "" : "; --max-range says how far readings are mapped"));
    if (totals.points_too_near > 0) run_.refuse(how_many + " mapped, all are nearer than min_range", units);
    run_.refuse("the scans hold no readings", "check the input");
  }

 private:
  RunState& run_;
  bool near_sensor_ = false;  // nearly all readings of the first scan
};

/// That poses are in the form and unit of the readings, else they ruin the map.
class PosesCheck : public RunObserver {
 public:
  explicit PosesCheck(RunState& run) : run_(run) {}

  void before(const Scan&) override {
    if (!checked_ && scans_.views() >= alignment::RecordingCheck::enough_views) require_sensible();
  }
  void after_all() override {
    if (!checked_) require_sensible();
  }

 private:
  void require_sensible() {
    checked_ = true;
    if (!run_.options.pose_form)
      if (const auto form = scans_.better_form()) {
        if (*form == alignment::Meaning::of_body && can_begin_anew()) throw PosesOfBody{};
        const std::string name = alignment::meaning_names.at(static_cast<std::size_t>(*form));
        run_.refuse(
            "scans do not fit each other at the poses as they are, but do if these are taken as " + name,
            "--pose-form " + name + "; or --pose-form as-given, if they are right");
      }
    if (run_.options.source.depth_scale || run_.options.source.cloud_scale) return;
    const auto scale = scans_.better_scale();
    if (!scale) return;
    const bool long_readings = *scale > 1;
    std::array<char, 300> hint{};
    std::snprintf(
        hint.data(), hint.size(),
        "of depth images --depth-scale %g where it was 1000, of clouds --cloud-scale %g; or state the "
        "scale they have, if it is right and the poses' unit is no metre",
        1000 * *scale, *scale);
    std::array<char, 120> what{};
    std::snprintf(what.data(), what.size(),
                  "scans do not fit each other, but do if readings are taken as %g times too %s",
                  long_readings ? *scale : 1 / *scale, long_readings ? "long" : "short");
    run_.refuse(what.data(), hint.data());
  }

  /// Nothing of this run is on disk yet.
  bool can_begin_anew() const { return !run_.checkpoints.any() && run_.options.keep_scans.empty(); }

  RunState& run_;
  const alignment::RecordingCheck& scans_ = run_.statistics.recording();
  bool checked_ = false;
};

}  // namespace

RunObservers checks_of(RunState& run) {
  RunObservers checks;
  checks.push_back(std::make_unique<ReadingsCheck>(run));
  checks.push_back(std::make_unique<PosesCheck>(run));
  return checks;
}

}  // namespace octosurf
