#include "map_run.hpp"

#include "cloud_viewpoint.hpp"
#include "interrupt_guard.hpp"
#include "io/new_file.hpp"
#include "io/text_file.hpp"
#include "last_line.hpp"
#include "map_past.hpp"
#include "output_files.hpp"
#include "progress.hpp"
#include "run_warnings.hpp"
#include "sensing/fingerprint.hpp"
#include "serve/live_server.hpp"
#include "surface_table.hpp"
#include "surfaces/map_state.hpp"
#include "up_option.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <future>
#include <new>
#include <set>
#include <thread>
#include <utility>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/changes.hpp>
#include <octosurf/diagnosis.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
MapRun::MapRun(const MapOptions& options, Map start, KeptScans kept, RunContext context,
               Clock::time_point begin)
    : options_(options),
      mapper_(std::move(start), options.threads, paper_detector()),
      statistics_(mapper_.map().parameters()),
      context_(std::move(context)),
      begin_(begin),
      checkpoints_(options.output, options.checkpoint_s, options.force && options.resume.empty()),
      past_(options.output, options.resume, &mapper_.map()),
      keeper_(std::move(kept)),
      poses_(options.write_poses, options.force, mapper_.map().origin()),
      backlog_(options.together),
      scene_(options.mcap, options.force, mapper_.map().parameters().up.value_or(Eigen::Vector3d::UnitZ())),
      reserve_(std::make_unique_for_overwrite<std::byte[]>(std::size_t{8} << 20)) {
  if (!options.forget_scans) mapper_.remember_scans();
  for (const std::string& warning : past_.warnings()) context_.warn(warning);
}

MapRun::~MapRun() = default;

void MapRun::serve() {
  HttpPlace place;
  place.port = *options_.serve_port;
  server_ = std::make_unique<LiveServer>(mapper_, title_of(options_.output), place, options_.allow_clear);
  std::printf("serving %s\n", server_->url().c_str());
  std::fflush(stdout);
}

void MapRun::run(bool adopt, std::unique_ptr<ScanSource> source) {
  const InterruptGuard guard;
  bool cut_short = false;
  try {
    if (options_.serve_port) serve();
    if (adopt) adopt_octree();
    if (source) map_scans(std::move(source));
    cut_short = interrupted();
    if (!cut_short) require_mapped();
    if (!cut_short && !pose_check_.full()) require_sensible_poses();
    if (!cut_short) drain();
    if (cut_short && !changed_)
      throw Error(Error::Kind::data, "", "interrupted before a scan was mapped", "nothing is written");
    finish();
  } catch (const std::exception& failure) {
    const bool refused = dynamic_cast<const Error*>(&failure) != nullptr && !changed_ && !finishing_;
    if (refused) throw;  // its message is complete
    end_early(failure);
  }
  if (cut_short)
    throw Error(Error::Kind::data, "",
                "interrupted, " + io::count_of(statistics_.scans(), "scan") + " mapped and saved",
                "--resume " + options_.output + " goes on");
}

void MapRun::adopt_octree() {
  const double arrival_s = now_s();
  ScanReport report = mapper_.detect_in_occupancy();
  const double done_s = now_s();
  report.total_ms = 1e3 * (done_s - arrival_s);
  statistics_.add_occupancy(report, arrival_s, done_s);
  changed_ = true;
}

void MapRun::map_scans(std::unique_ptr<ScanSource> source) {
  const std::size_t listed = source->size();
  posed_ = options_.source.poses.has_value();
  const std::vector<std::string> before = source->notes();
  for (const std::string& note : before) {
    std::printf("%s\n", note.c_str());
    posed_ = posed_ || note.find("poses: ") != std::string::npos;
  }
  const bool alone = listed == 1 && !options_.source.poses;
  ScanFeed feed(std::move(source), options_.range, options_.realtime ? options_.together : 1,
                accepting(alone));
  const ScanRange& range = options_.range;
  if (feed.size() == 0 && range.parts > 1)
    throw Error(Error::Kind::usage,
                "--subset " + std::to_string(range.part) + "/" + std::to_string(range.parts),
                "is empty, as there are fewer scans than parts", "take fewer parts");
  if (range.parts > 1)
    std::printf("part %zu of %zu: %s\n", range.part, range.parts, io::count_of(feed.size(), "scan").c_str());
  if (feed.size() == 0)
    throw Error(Error::Kind::usage, "--skip", "leaves none of the " + std::to_string(listed) + " scans");
  const auto note_skipped = [&] {
    // Values without a return that only later scans have.
    const std::vector<std::string> notes = feed.notes();
    for (std::size_t i = before.size(); i < notes.size(); ++i) std::printf("%s\n", notes[i].c_str());
    const std::vector<std::string> skipped = feed.skipped();
    context_.skipped_scans.insert(context_.skipped_scans.begin(), skipped.begin(), skipped.end());
  };
  try {
    insert_all(feed);
  } catch (const Error&) {  // the report is still written
    note_skipped();
    throw;
  }
  note_skipped();
  if (feed.refused() == 0) return;
  context_.mapped_before = feed.refused();
  std::printf("%s left out: %s in the map already; --again maps them once more\n",
              io::count_of(feed.refused(), "scan").c_str(), feed.refused() == 1 ? "it is" : "they are");
}

std::function<bool(Scan&)> MapRun::accepting(bool alone) const {
  const std::vector<std::uint64_t>& held = mapper_.map().state().held;
  std::set<std::uint64_t> before;
  if (!options_.again) before.insert(held.begin(), held.end());
  return [this, alone, before = std::move(before), first = true](Scan& scan) mutable {
    if (std::exchange(first, false) && !options_.source.cloud_scale)
      require_metres(scan, mapper_.map().parameters());  // before its rays are traced
    place(scan, alone);
    return before.empty() || !before.contains(sensing::fingerprint_of(scan));
  };
}

void MapRun::place(Scan& cloud, bool alone) const {
  if (options_.pose_form) cloud.T_map_sensor = pose_from(*options_.pose_form, cloud.T_map_sensor);
  const bool posed = cloud.T_map_sensor.matrix() != Eigen::Isometry3d::Identity().matrix();
  if (!options_.viewpoint.empty()) {
    if (posed || cloud.sensor != SensorKind::lidar)
      throw Error(Error::Kind::usage, "--viewpoint", cloud.name + " has a pose already",
                  "give it with clouds that have none");
    return set_viewpoint(cloud, Eigen::Map<const Eigen::Vector3d>(options_.viewpoint.data()));
  }
  if (posed || !alone || cloud.sensor != SensorKind::lidar) return;
  const Parameters& parameters = mapper_.map().parameters();
  const auto found = likely_viewpoint(cloud, parameters.up.value_or(Eigen::Vector3d::UnitZ()),
                                      parameters.occupancy.resolution);
  if (!found) return;
  std::fprintf(
      stderr,
      "warning: %s does not say where it was seen from; from the origin %.0f %% of its readings would "
      "lie behind others, from above %.0f %%: taken as seen from %.2f %.2f %.2f; --viewpoint X Y Z says "
      "where it was\n",
      cloud.name.c_str(), 100 * found->hidden_origin, 100 * found->hidden, found->at.x(), found->at.y(),
      found->at.z());
  set_viewpoint(cloud, found->at);
}

void MapRun::refuse(const std::string& what, const std::string& hint) {
  changed_ = false;  // nothing to save
  throw Error(Error::Kind::data, context_.input.empty() ? "" : context_.input.front(),
              what + "; nothing is written", hint);
}

void MapRun::require_sensible_poses() {
  if (!options_.pose_form)
    if (const auto form = pose_check_.better_form()) {
      const std::string name = pose_form_names.at(static_cast<std::size_t>(*form));
      refuse("scans do not fit each other at the poses as they are, but do if these are taken as " + name,
             "--pose-form " + name + "; or --pose-form as-given, if they are right");
    }
  if (options_.source.depth_scale || options_.source.cloud_scale) return;
  if (const auto scale = pose_check_.better_scale()) {
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
    refuse(what.data(), hint.data());
  }
}

void MapRun::require_mapped() {
  const ScanReport& totals = statistics_.totals();
  if (statistics_.scans() == 0) return;
  const std::string units =
      "check the units: --depth-scale says how many there are to a metre in images, --cloud-scale in clouds; "
      "poses are in metres";
  if (near_sensor_ && mapper_.snapshot()->surfaces.empty())
    refuse("no surface was found, as hardly a reading is more than a few voxels from the sensor", units);
  const std::size_t readings = totals.points_raw - totals.points_not_finite;
  const std::size_t mapped =
      readings - totals.points_too_near - totals.points_out_of_map - totals.points_beyond_range;
  // A map of a hundredth of what was seen is none, unless it was asked for by a range.
  constexpr std::size_t hardly_any = 100;
  const bool asked = mapper_.map().parameters().occupancy.max_range.has_value();
  if (mapped > 0 && (asked || mapped >= readings / hardly_any)) return;
  const std::string how_many =
      mapped == 0 ? "no reading was"
                  : "only " + std::to_string(mapped) + " of " + std::to_string(readings) + " readings were";
  if (totals.points_beyond_range + totals.points_out_of_map > 0)
    refuse(how_many + " mapped, all " + (mapped == 0 ? "" : "others ") +
               "lie beyond the maximum range, or outside the octree",
           units + (asked ? "" : "; --max-range says how far readings are mapped"));
  if (totals.points_too_near > 0) refuse(how_many + " mapped, all are nearer than min_range", units);
  refuse("the scans hold no readings", "check the input");
}

void MapRun::end_early(const std::exception& failure) {
  reserve_.reset();
  const bool mapping = !finishing_;
  LastLine line;
  line.add("%s", reason_of(failure));
  if (dynamic_cast<const std::bad_alloc*>(&failure) != nullptr)
    line.add(" after %zu scans", static_cast<std::size_t>(statistics_.scans()));
  if (mapping && changed_) {
    try {
      finish();
    } catch (const std::exception& error) {
      if (!all_saved()) line.add("; saving failed, too: %s", reason_of(error));
    }
  }
  line.add("; ");
  if (all_saved()) {
    const auto* error = dynamic_cast<const Error*>(&failure);
    const bool can_skip = mapping && error != nullptr && error->kind() == Error::Kind::data;
    line.add("%zu scan%s mapped and saved", checkpoints_.scans(), checkpoints_.scans() == 1 ? "" : "s");
    if (can_skip) line.add(", --skip-bad skips it");
  } else {
    line.add_last_of(checkpoints_);
    if (checkpoints_.any()) line.add(", --resume %s goes on", options_.output.c_str());
  }
  throw line;
}

void MapRun::insert_all(ScanFeed& feed) {
  Progress progress(feed.size());
  checkpoints_.start(now_s());
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
    if (options_.realtime) wait_and_join(scans, feed);
    if (interrupted()) break;
    if (statistics_.scans() == 0)
      near_sensor_ =
          warn_of_first_scan(scans.front().scan(), context_.input, posed_, mapper_.map().parameters());
    if (!pose_check_.full()) {
      for (const PreparedScan& prepared : scans) pose_check_.add(prepared.scan());
      if (pose_check_.full()) require_sensible_poses();
    }
    ahead = read_next();
    clear_as_asked();
    const double start_s = now_s();
    insert(scans);
    backlog_.mapped(now_s() - start_s);
    done += scans.size();
    progress.show(done, [&] { return io::count_of(mapper_.snapshot()->surfaces.size(), "surface"); });
    checkpoint();
  }
}

std::optional<PreparedScan> MapRun::next(ScanFeed& feed) const {
  std::optional<Scan> scan = feed.next();
  if (!scan) return {};
  if (options_.threads == 1 || (options_.realtime && arrival_of(*scan) > now_s()))
    return PreparedScan(std::move(*scan));
  return mapper_.prepare(std::move(*scan));
}

void MapRun::wait_and_join(std::vector<PreparedScan>& scans, ScanFeed& feed) {
  const Scan& first = scans.front().scan();
  constexpr double longest_pause_s = 60;  // by then all is found and saved; a clock that is set takes years
  const double pause_s = last_stamp_s_ ? first.stamp_s - *last_stamp_s_ : 0;
  if (pause_s > longest_pause_s)
    std::fprintf(stderr, "warning: %.0f s until %s are not waited for\n", pause_s, first.name.c_str());
  if (!last_stamp_s_ || pause_s > longest_pause_s) stamp_zero_s_ = now_s() - first.stamp_s;
  const double arrival_s = arrival_of(first);
  backlog_.next(first.stamp_s, now_s() - arrival_s);
  wait_for(arrival_s);
  if (!backlog_.join()) return;
  for (const Scan* next;
       scans.size() < options_.together && (next = feed.peek()) != nullptr && arrival_of(*next) <= now_s();) {
    backlog_.joined(next->stamp_s);
    scans.emplace_back(std::move(*feed.next()));
  }
}

void MapRun::insert(std::span<const PreparedScan> scans) {
  while (!scans.empty()) {
    try {
      const double start_s = now_s();
      std::vector<ScanReport> reports = mapper_.insert_all(scans);
      const double done_s = now_s();
      // Includes the time between stages.
      if (reports.size() == 1) reports.front().total_ms = 1e3 * (done_s - start_s);
      changed_ = true;
      for (std::size_t i = 0; i < reports.size(); ++i) {
        const Scan& scan = scans[i].scan();
        note(scan, reports[i], options_.realtime ? arrival_of(scan) : start_s, done_s);
        last_stamp_s_ = scan.stamp_s;
      }
      scene_.add_surfaces(*last_stamp_s_, mapper_);
      scans = scans.subspan(reports.size());
    } catch (const Error& error) {
      if (!options_.source.skip_bad || error.kind() != Error::Kind::data) throw;
      context_.skipped_scans.emplace_back(error.what());
      scans = scans.subspan(1);
    }
  }
}

void MapRun::drain() {
  if (statistics_.drain(mapper_, [this] { return now_s(); }) && last_stamp_s_)
    scene_.add_surfaces(*last_stamp_s_, mapper_);
}

void MapRun::note(const Scan& scan, const ScanReport& report, double arrival_s, double done_s) {
  statistics_.add(scan, report, arrival_s, done_s);
  if (report.alignment.outcome == AlignmentOutcome::rejected) return;
  poses_.add(scan.stamp_s, report.alignment.T_map_sensor);
  scene_.add_pose(scan.stamp_s, report.alignment.T_map_sensor);
  keeper_.add(scan, report.alignment.T_map_sensor);
  if (server_) server_->add_pose(scan.sensor, report.alignment.T_map_sensor);
}

void MapRun::wait_for(double arrival_s) {
  constexpr double longest_s = 0.05;  // to notice interrupts, and who asks
  for (double left_s; !interrupted() && (left_s = arrival_s - now_s()) > 0; clear_as_asked())
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, longest_s)));
}

void MapRun::clear_as_asked() {
  if (!server_ || !server_->clear_as_asked(mapper_)) return;
  changed_ = true;
  if (last_stamp_s_) scene_.add_surfaces(*last_stamp_s_, mapper_);
}

void MapRun::checkpoint() {
  if (!checkpoints_.due(now_s())) return;
  if (options_.strict && statistics_.agreement().contradiction()) return;
  keeper_.finish();
  checkpoints_.try_to_save(mapper_.map(), statistics_.scans(), keeper_.kept(), past_);
  poses_.try_to_save();
  checkpoints_.start(now_s());
}

void MapRun::require_agreement() {
  if (!options_.strict) return;
  if (const std::string text = contradiction_text(statistics_.agreement()); !text.empty())
    throw Error(Error::Kind::data, options_.output, text, "no map is written; without --strict it would be");
}

void MapRun::finish() {
  const Map& map = mapper_.map();
  if (server_) server_->end_clearing();
  keeper_.finish();
  finishing_ = true;
  require_agreement();
  checkpoints_.save(map, statistics_.scans(), keeper_.kept(), past_);
  keep_session(past_, map, last_stamp_s_);
  poses_.save();
  scene_.save(last_stamp_s_.value_or(0), *mapper_.snapshot());
  if (const std::string warning = memory_warning(map); !warning.empty()) context_.warnings.push_back(warning);
  context_.wall_s = now_s();
  if (!options_.report.empty()) write_report();
  print_summary();
  print_warnings(statistics_, map, !options_.report.empty());
}

void MapRun::write_report() {
  io::NewFile file(options_.report, options_.force);
  file.write([&](std::ostream& out) { out << statistics_.to_json(mapper_.map(), context_) << '\n'; });
  file.commit();
}

void MapRun::print_summary() const {
  const Map::Size size = mapper_.map().size();
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  std::printf("%-12s %zu", "scans", static_cast<std::size_t>(statistics_.scans()));
  const std::size_t rejected = statistics_.scans_with(AlignmentOutcome::rejected);
  if (size.scans + rejected != statistics_.scans())
    std::printf(", %zu with those before", static_cast<std::size_t>(size.scans));
  if (!context_.skipped_scans.empty())
    std::printf(", %zu skipped, e.g. %s", context_.skipped_scans.size(), context_.skipped_scans[0].c_str());
  std::printf("\n%-12s %zu, of them %zu new\n", "points", statistics_.totals().points_raw,
              statistics_.totals().appeared);
  print_dropped();
  print_alignment();
  if (const RunAgreement& agreement = statistics_.agreement(); agreement.scans() > 0)
    std::printf("%-12s %.1f %%, least %.1f %%\n", "agreement", 100 * agreement.median(),
                100 * agreement.least());
  std::printf("%-12s %zu, %.2f m²\n", "surfaces", size.surfaces, total_area(*snapshot));
  std::printf("%-12s %zu of %zu points\n", "pending", size.pending, size.points);
  std::printf("%-12s %.1f s; a scan %.1f ms (95 %% within %.1f ms)\n", "time", now_s(),
              statistics_.scan_ms_percentile(0.5), statistics_.scan_ms_percentile(0.95));
  if (const std::vector<io::Session>& sessions = past_.sessions(); sessions.size() > 1)
    std::printf("%-12s session %zu, %llu bytes\n", "past", sessions.size(),
                static_cast<unsigned long long>(sessions.back().undo_bytes));
  std::printf("%-12s %s.surfaces, %s.bt", "written", options_.output.c_str(), options_.output.c_str());
  for (const std::string& file :
       {keeper_.kept().folder.string(), options_.write_poses, options_.mcap, options_.report})
    if (!file.empty()) std::printf(", %s", file.c_str());
  std::printf("\n");
  if (snapshot->surfaces.empty()) return;
  const Up up = up_of(mapper_.map());
  if (up.source != Up::Source::given) std::printf("%-12s %s\n", "up", describe(up).c_str());
  std::printf("\n");
  print_table(largest_surfaces(*snapshot, 5), up.direction);
}

void MapRun::print_alignment() const {
  const auto count = [this](AlignmentOutcome outcome) { return statistics_.scans_with(outcome); };
  const std::size_t corrected = count(AlignmentOutcome::corrected),
                    recovered = count(AlignmentOutcome::recovered),
                    rejected = count(AlignmentOutcome::rejected),
                    unexplained = count(AlignmentOutcome::unexplained);
  if (corrected + recovered + rejected + unexplained == 0) return;
  std::printf("%-12s %zu corrected", "poses", corrected + recovered);
  if (recovered > 0) std::printf(", %zu of them far off", recovered);
  if (rejected > 0)
    std::printf("; %s left out: far off, and not to be found", io::count_of(rejected, "scan").c_str());
  if (unexplained > 0) std::printf("; %zu fit nowhere and are mapped as given", unexplained);
  std::printf("\n");
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
