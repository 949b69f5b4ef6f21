#include "alignment/pose_fit.hpp"

#include "sensing/reading_code.hpp"
#include "sensing/reading_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <optional>

namespace octosurf::alignment {
namespace {

using Derivatives =
    Eigen::Matrix<double, 9, 1>;  // derivatives by the pose's twist, and by the surface's slopes and offset
using Block = Eigen::Matrix<double, 9, 9>;

/// Minimum cosine for measuring range errors: below it, the plane's own error would count more than twice.
constexpr double least_cos_for_errors = 0.5;
constexpr double significant = 3;      // standard deviations within which a reading is explained
constexpr double enough_samples = 20;  // of a surface, to estimate its mean
/// To the power of n a bound on the probability that most of n samples on a surface belong to a face beside
/// it: Chernoff's, 2 √(p (1 − p)) with every fifth sample wrong, as many as a pose may leave unexplained.
constexpr double most_mismatched = 0.8;
constexpr int most_rounds = 8, coarse_rounds = 2;

/// A reading and the intersection of its line of sight with a surface's plane. The intersection is free of
/// the noise along the line of sight, which would carry readings across the boundary on both sides.
struct Sighting {
  /// `arm`: from the sensor to the reading; not parallel to the plane.
  Sighting(const AlignedSurface& surface, const Eigen::Vector3d& sensor, const Eigen::Vector3d& arm) {
    const double above = surface.plane.signed_distance(sensor), along = surface.plane.normal.dot(arm);
    distance = above + along;
    in_surface = surface.T_surface_map * (sensor - above / along * arm);
  }
  bool covered_by(const AlignedSurface& surface) const {
    return surface.raster.covers(in_surface.x(), in_surface.y());
  }

  double distance;             ///< of the reading, off the plane
  Eigen::Vector3d in_surface;  ///< the intersection, in the surface's frame
};

/// Calls `visit` with the pairings of each sample.
template <class Visit>
void for_each_sample(std::span<const PoseFitter::Pairing> pairings, const Visit& visit) {
  for (std::size_t i = 0; i < pairings.size();) {
    std::size_t end = i + 1;
    while (end < pairings.size() && pairings[end].sample == pairings[i].sample) ++end;
    visit(pairings.subspan(i, end - i));
    i = end;
  }
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

}  // namespace

Twist twist_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Twist twist;
  twist.head<3>() = rotation_vector(to.linear() * from.linear().transpose());
  twist.tail<3>() = to.translation() - from.translation();
  return twist;
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Twist& twist) {
  const Eigen::Vector3d turn = twist.head<3>();
  const double angle = turn.norm();
  Eigen::Isometry3d result = pose;
  if (angle > 0) {
    const Eigen::Quaterniond R(pose.linear());
    result.linear() =
        (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * R).normalized().toRotationMatrix();
  }
  result.translation() += twist.tail<3>();
  return result;
}

void set_directions(const TwistCovariance& directions, const Eigen::Ref<const Eigen::VectorXd>& variances,
                    double lever_m, const AlignmentReach& reach, Alignment& alignment) {
  alignment.directions = directions;
  alignment.determined = static_cast<int>(variances.size());
  alignment.lever_m = lever_m;
  Twist per_metre;
  per_metre << Eigen::Vector3d::Constant(1 / lever_m), Eigen::Vector3d::Ones();
  const TwistCovariance motions = per_metre.asDiagonal() * directions;
  const double far = std::max(reach.translation_m, reach.rotation_rad * lever_m);
  Twist all = Twist::Constant(far * far);
  all.head(variances.size()) = variances;
  alignment.covariance = motions * all.asDiagonal() * motions.transpose();
}

struct PoseFitter::Sums {
  TwistCovariance information = TwistCovariance::Zero();
  Twist gradient = Twist::Zero();
  double squared_range = 0, weight = 0;
  std::size_t known = 0, explained = 0;
  double disagreement = 0;  ///< Σ of the surfaces' squared errors at this pose, in units of their deviations
  std::size_t met = 0;      ///< surfaces with samples
};

PoseFitter::PoseFitter(std::span<const Sample> samples, std::span<const AlignedSurface* const> surfaces,
                       const FitErrors& errors)
    : samples_(samples), surfaces_(surfaces), errors_(errors) {}

/// Calls `visit(sample, surface, distance)` for every `every`-th sample with the surfaces that face the
/// sensor at a pose; distance of the sample off the surface's plane, m.
template <class Visit>
void PoseFitter::for_each_facing(const Eigen::Isometry3d& pose, std::size_t every, const Visit& visit) const {
  // One row per surface, so that a reading is compared with all in a few vector operations.
  const auto count = static_cast<Eigen::Index>(surfaces_.size());
  Eigen::Matrix<float, Eigen::Dynamic, 4> planes(count, 4);
  const Eigen::Vector3d sensor = pose.translation();
  for (Eigen::Index s = 0; s < count; ++s) {
    const Plane& plane = surfaces_[static_cast<std::size_t>(s)]->plane;
    planes.row(s).head<3>() = plane.normal.cast<float>();
    planes(s, 3) =
        static_cast<float>(plane.signed_distance(sensor));  // small numbers, also far from the origin
  }
  Eigen::VectorXf along(count);
  for (std::uint32_t i = 0; i < samples_.size(); i += static_cast<std::uint32_t>(every)) {
    const Sample& sample = samples_[i];
    along.noalias() = planes.leftCols<3>() * (pose.linear() * sample.sight()).cast<float>();
    const Eigen::Vector3f origin = (pose.linear() * sample.origin).cast<float>();
    const float cos_incidence = static_cast<float>(sensing::ReadingModel::grazing_cosine * sample.range);
    for (Eigen::Index s = 0; s < count; ++s)
      if (along[s] < -cos_incidence)
        visit(i, static_cast<std::uint32_t>(s),
              along[s] + planes.row(s).head<3>().dot(origin) + planes(s, 3));
  }
}

std::vector<PoseFitter::Pairing> PoseFitter::pair(const Eigen::Isometry3d& pose, double reach,
                                                  std::size_t every) const {
  std::vector<Pairing> pairings;
  pairings.reserve(2 * samples_.size());
  for_each_facing(pose, every, [&](std::uint32_t sample, std::uint32_t surface, float distance) {
    if (std::fabs(distance) < static_cast<float>(reach)) pairings.push_back({sample, surface});
  });
  return pairings;
}

std::size_t PoseFitter::behind_surfaces(const Eigen::Isometry3d& pose) const {
  std::vector<char> behind(samples_.size());
  for_each_facing(pose, 1, [&](std::uint32_t i, std::uint32_t s, float distance) {
    if (behind[i] != 0 || distance > static_cast<float>(-errors_.gate_m)) return;
    const Sample& sample = samples_[i];
    const AlignedSurface& surface = *surfaces_[s];
    const Eigen::Vector3d sensor = pose * sample.origin;
    if (surface.plane.signed_distance(sensor) <= errors_.gate_m) return;
    // A mean of readings on both sides of an edge lies on neither.
    const auto crosses = [&](const Eigen::Vector3d& point) {
      const Sighting sighting(surface, sensor, pose.linear() * (point - sample.origin));
      return sighting.distance < -errors_.gate_m && sighting.covered_by(surface);
    };
    behind[i] = crosses(sample.point) && crosses(sample.first) && crosses(sample.last);
  });
  return static_cast<std::size_t>(std::count(behind.begin(), behind.end(), 1));
}

/// Common variances of slopes and offset of a scan's readings of a surface, from that of a reading.
Eigen::Vector3d PoseFitter::common_of(double reading) const {
  return Eigen::Vector3d::Constant(errors_.common_m * errors_.common_m + errors_.common_share * reading);
}

/// Sums over the samples on one surface.
struct PoseFitter::SurfaceSums {
  Block outer = Block::Zero();
  Derivatives right = Derivatives::Zero();
  double squares = 0, counted = 0;  ///< Σ of the residuals' squares by their variance, and of samples,
                                    ///< weighted robustly as above
  double samples = 0;               ///< overlapping ones by their share
  double weight = 0;                ///< Σ of 1/variance
};

/// A sample matched with a surface.
struct PoseFitter::Match {
  std::uint32_t surface;
  double distance;  ///< off the surface's plane
  double reading;   ///< variance along the normal, of the readings alone …
  double certain;   ///< … and including the surface's uncertainty
  Derivatives row;
  bool explained() const { return distance * distance < significant * significant * certain; }
};

/// A sample at a pose: matched with the nearest of the surfaces that cover it, if within the gate.
struct PoseFitter::Matched {
  std::uint32_t sample;
  bool known = false;  ///< a surface covers it
  std::optional<Match> match{};
  bool explained() const { return match && match->explained(); }
};

PoseFitter::Matched PoseFitter::match(const Eigen::Isometry3d& pose, double gate,
                                      std::span<const Pairing> candidates) const {
  Matched matched{candidates.front().sample};
  const Sample& sample = samples_[matched.sample];
  const Eigen::Vector3d arm = pose.linear() * sample.point;  // by which turns move it
  const Eigen::Vector3d sensor = pose * sample.origin, sight = pose.linear() * sample.sight();
  std::optional<Sighting> best;
  double nearest = gate;
  std::uint32_t which = 0;
  for (const Pairing& candidate : candidates) {
    const AlignedSurface& surface = *surfaces_[candidate.surface];
    const Sighting sighting(surface, sensor, sight);
    if (matched.known && std::fabs(sighting.distance) >= nearest) continue;
    if (!sighting.covered_by(surface)) continue;
    matched.known = true;
    if (std::fabs(sighting.distance) >= nearest) continue;
    nearest = std::fabs(sighting.distance);
    which = candidate.surface;
    best = sighting;
  }
  if (!best) return matched;
  const AlignedSurface& surface = *surfaces_[which];
  // A mean of readings on both sides of an edge lies on neither.
  const Sighting first(surface, sensor, pose.linear() * (sample.first - sample.origin)),
      last(surface, sensor, pose.linear() * (sample.last - sample.origin));
  matched.known = first.covered_by(surface) && last.covered_by(surface);
  if (!matched.known || std::fabs(first.distance) >= gate || std::fabs(last.distance) >= gate) return matched;

  const Eigen::Vector3d& n = surface.plane.normal;
  Derivatives row;
  row.head<3>() = arm.cross(n);
  row.segment<3>(3) = n;
  row.tail<3>() << -best->in_surface.x(), -best->in_surface.y(), -1;
  const double cosine = std::max(sensing::ReadingModel::view_error, std::fabs(n.dot(sight)) / sample.range);
  const double spread = errors_.noise_factor * sample.spread, along_normal = spread * cosine;
  const double reading = along_normal * along_normal;
  const Eigen::Vector3d by_surface = row.tail<3>();
  const double certain = reading + by_surface.dot(surface.covariance * by_surface) +
                         by_surface.cwiseAbs2().dot(common_of(reading));
  matched.match = {which, best->distance, reading, certain, row};
  return matched;
}

template <class Visit>
void PoseFitter::for_each_match(const Eigen::Isometry3d& pose, double gate, std::span<const Pairing> pairings,
                                const Visit& visit) const {
  for_each_sample(pairings, [&](auto candidates) { visit(match(pose, gate, candidates)); });
}

void PoseFitter::add_match(const Matched& matched, const TwistCovariance& uncertainty, Sums& sums,
                           std::vector<SurfaceSums>& of_surface) const {
  sums.known += matched.known ? 1 : 0;
  sums.explained += matched.explained() ? 1 : 0;
  if (!matched.match) return;
  const Sample& sample = samples_[matched.sample];
  const Match& match = *matched.match;
  const double distance = match.distance;
  const Twist by_pose = match.row.head<6>();
  const double robust = tukey_weight(distance, std::sqrt(match.certain + by_pose.dot(uncertainty * by_pose)));
  if (robust == 0) return;
  SurfaceSums& sum = of_surface[match.surface];
  // Samples that share readings carry no more information than those readings.
  const double weight = 1 / (sample.overlap * match.reading);
  sum.outer.selfadjointView<Eigen::Lower>().rankUpdate(match.row, robust * weight);
  sum.right += robust * weight * distance * match.row;
  sum.squares += robust * weight * distance * distance;
  sum.counted += robust / sample.overlap;
  sum.samples += 1 / sample.overlap;
  sum.weight += weight;
  sums.squared_range += robust * sample.point.squaredNorm();
  sums.weight += robust;
}

/// Ratio of the readings' scatter about their best-fitting plane to their variance; at least 1. About that
/// plane rather than the map's, which is tilted against them while the pose is off.
double PoseFitter::unevenness(const SurfaceSums& of) {
  if (of.samples < enough_samples) return 1;
  const Block full = of.outer.selfadjointView<Eigen::Lower>();
  const Eigen::Vector3d right = of.right.tail<3>();
  const double explained = right.dot(full.bottomRightCorner<3, 3>().ldlt().solve(right));
  return std::max(1.0, (of.squares - explained) / std::max(1.0, of.counted - 3));
}

/// Eliminates the surface's own error.
void PoseFitter::add_surface(const AlignedSurface& surface, const SurfaceSums& of, Sums& sums) const {
  Block full = of.outer.selfadjointView<Eigen::Lower>();
  const double uneven = unevenness(of);
  const double reading = uneven * of.samples / of.weight;
  full /= uneven;
  const Derivatives right = of.right / uneven;
  // The plane's uncertainty is its covariance plus the readings' common error.
  Eigen::Matrix3d known = surface.covariance;
  known.diagonal() += common_of(reading);
  // Samples of another face lie anywhere within the gate.
  const double gate = errors_.fine_gate_m();
  known(2, 2) += std::pow(most_mismatched, of.samples) * gate * gate / 3;
  const Eigen::Matrix3d known_information = known.inverse();
  full.bottomRightCorner<3, 3>() += known_information;
  const Eigen::Matrix<double, 6, 3> across = full.topRightCorner<6, 3>();
  const Eigen::LDLT<Eigen::Matrix3d> own = full.bottomRightCorner<3, 3>().ldlt();
  const Eigen::Matrix<double, 6, 3> eliminated = across * own.solve(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d off = own.solve(right.tail<3>());
  sums.disagreement += off.dot(known_information * off);
  ++sums.met;
  sums.information += full.topLeftCorner<6, 6>() - eliminated * across.transpose();
  sums.gradient += right.head<6>() - eliminated * right.tail<3>();
}

/// Factor by which the stated variances are too small, if the surfaces disagree more than their errors allow
/// (Birge ratio, squared): three numbers each, less six for the pose.
double PoseFitter::disagreement_ratio(const Sums& sums) {
  if (3 * sums.met <= 6) return 1;
  return std::max(1.0, sums.disagreement / (3 * static_cast<double>(sums.met) - 6));
}

PoseFitter::Sums PoseFitter::linearise(const Linearisation& at, std::span<const Pairing> pairings) const {
  std::vector<SurfaceSums> of_surface(surfaces_.size());
  Sums sums;
  for_each_match(at.pose, at.gate, pairings,
                 [&](const Matched& matched) { add_match(matched, at.uncertainty, sums, of_surface); });
  for (std::size_t s = 0; s < surfaces_.size(); ++s)
    if (of_surface[s].samples > 0) add_surface(*surfaces_[s], of_surface[s], sums);
  return sums;
}

Layout PoseFitter::lay(const Eigen::Isometry3d& pose) const {
  Layout layout;
  layout.readings.reserve(samples_.size());
  for_each_match(pose, errors_.gate_m, pair(pose, errors_.gate_m), [&](const Matched& matched) {
    layout.known += matched.known ? 1 : 0;
    layout.explained += matched.explained() ? 1 : 0;
    if (const auto& match = matched.match; match && std::fabs(match->distance) < errors_.fine_gate_m())
      layout.readings.push_back({samples_[matched.sample].point, surfaces_[match->surface], match->reading});
  });
  return layout;
}

std::vector<PoseFitter::Verdict> PoseFitter::judge(const Eigen::Isometry3d& pose, double reach) const {
  std::vector<Verdict> verdicts(samples_.size(), Verdict::none);
  for_each_match(pose, errors_.fine_gate_m(), pair(pose, reach), [&](const Matched& matched) {
    if (matched.known)
      verdicts[matched.sample] = matched.explained() ? Verdict::explained : Verdict::contradicted;
  });
  return verdicts;
}

std::vector<sensing::NoiseModel::Residual> PoseFitter::residuals(const Eigen::Isometry3d& pose) const {
  std::vector<sensing::NoiseModel::Residual> residuals;
  for_each_match(pose, errors_.fine_gate_m(), pair(pose, errors_.gate_m), [&](const Matched& matched) {
    if (!matched.match) return;
    const Sample& sample = samples_[matched.sample];
    const auto& [surface, distance, reading, certain, row] = *matched.match;
    const Eigen::Vector3d& normal = surfaces_[surface]->plane.normal;
    const double cos_incidence = -normal.dot(pose.linear() * sample.sight()) / sample.range;
    if (cos_incidence < least_cos_for_errors) return;
    const auto range_class =
        static_cast<std::uint8_t>(sensing::range_class_of(static_cast<float>(sample.range)));
    residuals.push_back(
        {range_class, surface, distance / cos_incidence, sample.spread * sample.spread, cos_incidence});
  });
  return residuals;
}

double PoseFitter::agreement(const Eigen::Isometry3d& pose, std::span<const Pairing> pairings) const {
  double sum = 0;
  for_each_sample(pairings, [&](auto candidates) {
    const Sample& sample = samples_[candidates.front().sample];
    const Eigen::Vector3d sensor = pose * sample.origin, sight = pose.linear() * sample.sight();
    double best = 0;
    for (const Pairing& candidate : candidates) {
      const AlignedSurface& surface = *surfaces_[candidate.surface];
      const Eigen::Vector3d& n = surface.plane.normal;
      const double along = n.dot(sight),
                   share = (surface.plane.signed_distance(sensor) + along) / errors_.gate_m;
      const double nearness = 1 - share * share;
      if (nearness > best && along < 0 && Sighting(surface, sensor, sight).covered_by(surface))
        best = nearness;
    }
    sum += best;
  });
  return sum;
}

PoseFit PoseFitter::fit(const Eigen::Isometry3d& start, const TwistCovariance& prior) const {
  PoseFit fit;
  fit.T_map_sensor = start;
  const std::vector<Pairing> pairings = pair(start, 2 * errors_.gate_m);
  const TwistCovariance prior_information = prior.inverse();
  TwistCovariance uncertainty = prior;
  for (int round = 0;; ++round) {
    const double gate = round < coarse_rounds ? errors_.gate_m : errors_.fine_gate_m();
    const Sums sums = linearise({fit.T_map_sensor, gate, uncertainty}, pairings);
    fit.information = sums.information / disagreement_ratio(sums);
    fit.known = sums.known;
    fit.explained = sums.explained;
    if (sums.weight > 0) fit.lever_m = std::sqrt(sums.squared_range / sums.weight);
    if (round == most_rounds) return fit;
    const Twist off = twist_between(start, fit.T_map_sensor);
    const Eigen::LDLT<TwistCovariance> information(sums.information + prior_information);
    const Twist step = -information.solve((sums.gradient + prior_information * off).eval());
    const bool settled =
        round >= coarse_rounds + 1 && step.tail<3>().norm() + fit.lever_m * step.head<3>().norm() < 2e-5;
    if (settled) return fit;
    fit.T_map_sensor = moved(fit.T_map_sensor, step);
    // The pose's uncertainty widens the weights' reach until the fit has converged.
    uncertainty = information.solve(TwistCovariance::Identity());
  }
}

}  // namespace octosurf::alignment
