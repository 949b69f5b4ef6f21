#include "alignment/locate_scan.hpp"
#include "alignment/pose_search.hpp"
#include "sensing/downsample.hpp"
#include "sensing/noise_model.hpp"

#include <cmath>

#include <octosurf/alignment.hpp>
#include <octosurf/error.hpp>

namespace octosurf {

double Alignment::determined_length_m(const Twist& twist) const {
  double squares = 0;
  for (int i = 0; i < determined; ++i) {
    const double along = lever_m * directions.col(i).head<3>().dot(twist.head<3>()) +
                         directions.col(i).tail<3>().dot(twist.tail<3>());
    squares += along * along;
  }
  return std::sqrt(squares);
}

struct Localizer::Impl {
  std::shared_ptr<const Snapshot> map;
  AlignmentReach reach;
  alignment::NearSurfaces surfaces;
};

Localizer::Localizer(std::shared_ptr<const Snapshot> map, const AlignmentReach& reach)
    : impl_(std::make_unique<Impl>(Impl{std::move(map), reach, {}})) {
  alignment::require_reach(impl_->map, reach);
}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

void alignment::require_reach(const std::shared_ptr<const Snapshot>& map, const AlignmentReach& reach) {
  if (map == nullptr) throw Error(Error::Kind::usage, "map", "is null", "give the snapshot of a map");
  const auto require = [](const char* name, double value, double most) {
    if (!(value > 0 && value <= most))
      throw Error(Error::Kind::usage, name, "is " + std::to_string(value),
                  "must be in (0, " + std::to_string(most) + "]");
  };
  require("reach.translation_m", reach.translation_m, 10);
  require("reach.rotation_rad", reach.rotation_rad, 0.5);
}

Alignment Localizer::operator()(const Scan& scan) {
  require_rigid(scan.T_map_sensor, scan.name);
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scan);
  return alignment::locate_scan(*impl_->map, impl_->surfaces, scan, noise, impl_->reach);
}

Alignment alignment::locate_scan(const Snapshot& map, alignment::NearSurfaces& surfaces, const Scan& scan,
                                 const sensing::NoiseModel& noise, const AlignmentReach& reach,
                                 const alignment::FitErrors& errors) {
  const alignment::RangeLimits limits{0, sensing::default_max_range(scan.sensor)};
  const alignment::PoseSearch search(map, surfaces, scan, noise, limits, scan.T_map_sensor, reach, errors);
  Alignment result;
  result.samples = search.samples();
  const std::optional<alignment::PoseFit> found = search.coarse(scan.T_map_sensor);
  const alignment::PoseFit fit =
      found ? *found
            : search.fine(scan.T_map_sensor, alignment::uncertainty(reach.rotation_rad, map.resolution));
  const alignment::Determined determined = alignment::determined_by(fit, map.resolution);
  alignment::describe(fit, determined, 1, reach, result);
  result.disagreement = alignment::twist_between(scan.T_map_sensor, fit.T_map_sensor);
  result.T_map_sensor =
      found ? alignment::without_undetermined(scan.T_map_sensor, fit, determined) : scan.T_map_sensor;
  result.outcome = found                                        ? AlignmentOutcome::corrected
                   : fit.known < alignment::least_known_samples ? AlignmentOutcome::nothing_known
                                                                : AlignmentOutcome::unexplained;
  return result;
}

Alignment align(const std::shared_ptr<const Snapshot>& map, const Scan& scan, const AlignmentReach& reach) {
  return Localizer(map, reach)(scan);
}

}  // namespace octosurf
