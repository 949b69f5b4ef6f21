#include "run_statistics.hpp"

#include "geometry/degrees.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::pair<const char*, double>> shares{{"p50", 0.5}, {"p95", 0.95}};

/// The most memory that the process has had.
double peak_rss_mb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1024e-6 * static_cast<double>(usage.ru_maxrss);
}

Json to_json_value(const std::string& text) {
  Json value = Json::parse(text, nullptr, false);
  return value.is_discarded() ? Json(text) : value;
}

Json parameters_object(const Parameters& parameters) {
  Json json = Json::object();
  for (const ParameterInfo& info : parameter_infos())
    json[info.name] = to_json_value(get_parameter(parameters, info.name));
  return json;
}

Json alignment_json(const AlignmentTotals& totals) {
  Json json{{"scans", Json::object()}};
  for (std::size_t outcome = 0; outcome < totals.outcomes.size(); ++outcome)
    json["scans"][std::string(alignment_outcome_names[outcome])] = totals.outcomes[outcome];
  json["correction_m"] = totals.corrections_m.to_json(shares);
  json["correction_deg"] = totals.corrections_deg.to_json(shares);
  return json;
}

Json judgement_json(const Judgement& judgement) {
  return {{"contradicts", judgement.contradicts()},
          {"views", judgement.views},
          {"alone", judgement.alone},
          {"sparse", judgement.sparse},
          {"pairs", judgement.pairs},
          {"contradicting", judgement.contradicting},
          {"axis", {judgement.axis.x(), judgement.axis.y(), judgement.axis.z()}},
          {"axis_pairs", judgement.axis_pairs},
          {"axis_contradicting", judgement.axis_contradicting},
          {"worst", judgement.worst},
          {"outvoted", judgement.outvoted},
          {"common_error", judgement.common_error},
          {"common_error_m", judgement.common_error_m},
          {"oddities", judgement.oddities}};
}

}  // namespace

void Spread::add(double value, double weight) {
  constexpr std::size_t most = std::size_t{1} << 14;  // a rank is then off by some 0.1 % of them
  sum_ += value * weight;
  weight_ += weight;
  max_ = count_ == 0 ? value : std::max(max_, value);
  if (count_++ % step_ != 0) return;
  kept_.emplace_back(value, weight);
  if (kept_.size() < most) return;
  step_ *= 2;
  std::size_t k = 0;
  std::erase_if(kept_, [&k](const auto&) { return k++ % 2 != 0; });
}

double Spread::percentile(double share) const {
  std::vector<std::pair<double, double>> sorted = kept_;
  std::ranges::sort(sorted);
  double all = 0, seen = 0;
  for (const auto& [value, weight] : sorted) all += weight;
  for (const auto& [value, weight] : sorted)
    if ((seen += weight) >= share * all) return value;
  return sorted.empty() ? 0 : sorted.back().first;
}

Json Spread::to_json(const std::vector<std::pair<const char*, double>>& at) const {
  Json json;
  for (const auto& [name, share] : at) json[name] = weight_ > 0 ? Json(percentile(share)) : Json();
  json["max"] = weight_ > 0 ? Json(max_) : Json();
  return json;
}

bool is_pause(std::optional<double> last_stamp_s, double stamp_s) {
  return last_stamp_s && stamp_s - *last_stamp_s > 1;
}

std::string parameters_json(const Parameters& parameters) { return parameters_object(parameters).dump(); }

void RunStatistics::add(const Scan& scan, const ScanReport& report, double arrival_s, double done_s) {
  if (scans_++ == 0) first_stamp_s_ = scan.stamp_s;
  last_stamp_s_ = scan.stamp_s;
  scans_at_origin_ += scan.T_map_sensor.matrix() == Eigen::Isometry3d::Identity().matrix();
  const Alignment& alignment = report.alignment;
  ++alignment_.outcomes[static_cast<std::size_t>(alignment.outcome)];
  if (alignment.outcome == AlignmentOutcome::corrected || alignment.outcome == AlignmentOutcome::recovered) {
    const Eigen::Isometry3d& used = alignment.T_map_sensor;
    alignment_.corrections_m.add((used.translation() - scan.T_map_sensor.translation()).norm());
    const Eigen::AngleAxisd turn(used.linear() * scan.T_map_sensor.linear().transpose());
    alignment_.corrections_deg.add(turn.angle() * deg_per_rad);
  }
  if (alignment.outcome != AlignmentOutcome::rejected) judge_.add(scan, alignment.T_map_sensor);
  add_occupancy(report, arrival_s, done_s);
}

const Judgement& RunStatistics::judgement() const {
  if (std::exchange(judged_, scans_) != scans_) judgement_ = judge_.judge();
  return judgement_;
}

bool RunStatistics::drain(Mapper& mapper, const std::function<double()>& now_s) {
  const double start_s = now_s();
  const std::shared_ptr<const Snapshot> before = mapper.snapshot();
  const ScanReport report = mapper.drain();
  if (mapper.snapshot() == before) return false;
  const double done_s = now_s();
  drain_ms_.add(1e3 * (done_s - start_s));
  if (first_detection_s_ < 0 && !report.born.empty()) first_detection_s_ = done_s - first_arrival_s_;
  totals_.detected += report.detected;
  return true;
}

void RunStatistics::add_occupancy(const ScanReport& report, double arrival_s, double done_s) {
  if (first_arrival_s_ < 0) first_arrival_s_ = arrival_s;
  if (first_detection_s_ < 0 && !report.born.empty()) first_detection_s_ = done_s - first_arrival_s_;
  scan_ms_.add(report.total_ms);
  waiting_.add(static_cast<double>(report.waiting));
  for (std::size_t stage = 0; stage < stage_ms_.size(); ++stage) stage_ms_[stage].add(report.stage_ms[stage]);
  if (report.categorized > 0) lag_s_.add(done_s - arrival_s, static_cast<double>(report.categorized));
  for (const auto count :
       {&ScanReport::points_raw, &ScanReport::points_not_finite, &ScanReport::points_too_near,
        &ScanReport::points_beyond_range, &ScanReport::points_out_of_map, &ScanReport::voxels,
        &ScanReport::appeared, &ScanReport::vanished, &ScanReport::categorized, &ScanReport::added,
        &ScanReport::expanded, &ScanReport::detected})
    totals_.*count += report.*count;
}

std::string RunStatistics::to_json(const Map& map, const RunContext& context) const {
  const Map::Size size = map.size();
  const std::shared_ptr<const Snapshot> snapshot = map.snapshot();
  const auto scans = static_cast<double>(scans_);
  const double span_s = scans_ > 1 ? (last_stamp_s_ - first_stamp_s_) * scans / (scans - 1) : 0;
  const std::size_t categorizable = size.inliers + size.pending;

  Json json;
  json["version"] = OCTOSURF_VERSION;
  json["parameters"] = parameters_object(map.parameters());
  json["input"] = context.input;
  if (const Eigen::Vector3d origin = map.origin(); !origin.isZero(0))
    json["origin"] = {origin.x(), origin.y(), origin.z()};
  json["scans"] = scans_;
  json["skipped_scans"] = context.skipped_scans;
  json["scans_mapped_before"] = context.mapped_before;
  json["warnings"] = context.warnings;
  json["points_raw"] = totals_.points_raw;
  json["points_dropped"] = {{"not_finite", totals_.points_not_finite},
                            {"too_near", totals_.points_too_near},
                            {"out_of_map", totals_.points_out_of_map}};
  json["points_beyond_range"] = totals_.points_beyond_range;
  json["points_new"] = totals_.appeared;
  json["points_per_second"] = span_s > 0 ? Json(static_cast<double>(totals_.appeared) / span_s) : Json();
  json["time_to_first_detection_s"] = first_detection_s_ >= 0 ? Json(first_detection_s_) : Json();
  json["detection_lag_s"] = lag_s_.to_json(shares);
  json["detection_lag_s"]["mean"] = lag_s_.sum() > 0 ? Json(lag_s_.mean()) : Json();
  json["categorized_percent"] =
      categorizable > 0 ? Json(100 * static_cast<double>(size.inliers) / static_cast<double>(categorizable))
                        : Json();
  json["new_inliers"] = {
      {"added", totals_.added}, {"expanded", totals_.expanded}, {"detected", totals_.detected}};
  json["scan_ms"] = scan_ms_.to_json({{"p50", 0.5}, {"p95", 0.95}, {"p99", 0.99}});
  for (std::size_t stage = 0; stage < stage_ms_.size(); ++stage) {
    Json& entry = json["stage_ms"][std::string(stage_names[stage])];
    entry = stage_ms_[stage].to_json(shares);
    entry["total"] = stage_ms_[stage].sum();
  }
  json["waiting_points"] = waiting_.to_json(shares);
  json["drain_ms"] = drain_ms_.to_json(shares);
  json["drain_ms"]["count"] = drain_ms_.count();
  json["alignment"] = alignment_json(alignment_);
  json["judgement"] = judgement_json(judgement());
  const Up up = up_of(map);
  json["up"] = {{"direction", up.direction}, {"from", name_of(up.source)}};
  json["surfaces"] = size.surfaces;
  json["area_m2"] = total_area(*snapshot);
  json["cylinders"] = snapshot->cylinders.size();
  json["pending_points"] = size.pending;
  json["peak_rss_mb"] = peak_rss_mb();
  json["octree"] = {{"nodes", size.nodes}, {"leaves", size.leaves}, {"bytes", size.bytes}};
  json["wall_s"] = context.wall_s;
  if (const auto& ids = context.succeeded)
    json["remap"] = {{"kept", ids->kept}, {"new", ids->born}, {"gone", ids->gone}};
  // A file name may be invalid UTF-8; the bytes in question are replaced.
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

void print_agreement(const Judgement& judgement) {
  if (judgement.views == 0) return;
  std::printf("%-12s %zu of %zu pairs of views", "agreement", judgement.pairs - judgement.contradicting,
              judgement.pairs);
  if (judgement.alone + judgement.sparse > 0)
    std::printf("; of %zu views %zu see nothing that others see, %zu have too few readings to compare",
                judgement.views, judgement.alone, judgement.sparse);
  std::printf("\n");
}

void warn_of(const Judgement& judgement, const std::string& check) {
  if (!judgement.contradicts()) return;
  std::fprintf(stderr, "warning: %s%s\n", judgement.describe().c_str(),
               check.empty() ? "" : ("; " + check + " finds the cause").c_str());
}

void require_agreement(const Judgement& judgement, const std::string& output) {
  if (judgement.contradicts())
    throw Error(Error::Kind::data, output, judgement.describe(),
                "no map is written; without --strict it would be");
}

Json largest_surfaces(const Snapshot& snapshot, std::size_t count, const Eigen::Vector3d& up) {
  std::vector<SurfacePtr> surfaces = snapshot.surfaces;
  std::ranges::stable_sort(surfaces,
                           [](const SurfacePtr& a, const SurfacePtr& b) { return a->area_m2 > b->area_m2; });
  surfaces.resize(std::min(count, surfaces.size()));
  Json list = Json::array();
  for (const SurfacePtr& surface : surfaces)
    list.push_back({{"id", surface->id},
                    {"area_m2", surface->area_m2},
                    {"inliers", surface->inliers},
                    {"rms_m", surface->rms_m},
                    {"normal", surface->plane.normal},
                    {"offset", surface->plane.offset},
                    {"slope_deg", slope_rad(*surface, up) * deg_per_rad}});
  return list;
}

double total_area(const Snapshot& snapshot) {
  double area_m2 = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) area_m2 += surface->area_m2;
  return area_m2;
}

void RunContext::warn(const std::string& warning) {
  if (warning.empty()) return;
  std::fprintf(stderr, "warning: %s\n", warning.c_str());
  warnings.push_back(warning);
}

}  // namespace octosurf
