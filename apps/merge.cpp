// `octosurf merge`: two maps into one.
#include "geometry/degrees.hpp"
#include "geometry/interruption.hpp"
#include "interrupt_guard.hpp"
#include "io/map_lock.hpp"
#include "io/text_file.hpp"
#include "occupancy/agreement.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "run_statistics.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/map_alignment.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

constexpr const char* merge_description = R"(Merges two maps of one place.

Examples:
  octosurf merge maps/east maps/west -o maps/house                     both in one frame
  octosurf merge maps/east maps/west -o maps/house --pose 4.2 0.1 0 0 0 90
  octosurf merge maps/east maps/west -o maps/house --pose 4 0 0 0 0 92 --align
  octosurf merge maps/monday maps/tuesday -o maps/monday --force       into the first one's files
  for part in parts/3 parts/4; do octosurf merge maps/all $part -o maps/all --force; done   one after the other

The second map is merged into the first, whose frame, parameters and surface ids stay. The readings of both count as
independent, so the maps must not share scans; where one saw a surface and the other free space, the sum of their
log-odds decides. Surfaces of the second that lie on a plane of the first continue it; the others keep their planes
and get new ids. Maps that have no place in common or contradict each other there are refused, as are maps of another
resolution. The merged map can be continued (map --resume), but keeps no scans.

--pose is the pose of the second map's frame in the first's: metres, then degrees about x, then y, then z. It must be
right to about a voxel. Without it both have the same frame. --align refines a guess by the surfaces of both maps, if
it is right to 30 cm and 5 degrees.
)";

struct MergeOptions {
  std::string first, second, output;
  std::vector<double> pose;
  bool align = false, anyway = false, force = false;
};

Eigen::Isometry3d pose_of(const std::vector<double>& pose) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (pose.empty()) return T;
  T.translation() = Eigen::Vector3d(pose[0], pose[1], pose[2]);
  // Exactly the identity if not requested otherwise, so that voxels are not resampled.
  for (const int axis : {2, 1, 0})
    if (const double angle = pose[3 + static_cast<std::size_t>(axis)] / deg_per_rad; angle != 0)
      T.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
  return T;
}

[[noreturn]] void refuse(const MergeOptions& options, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::data, options.second, what, hint);
}

void require_other_scans(const MergeOptions& options, const LoadedMap& first, const LoadedMap& second) {
  const std::vector<std::uint64_t>&held = surfaces::state_of(first.map).held,
        &others = surfaces::state_of(second.map).held;
  const std::set<std::uint64_t> known(held.begin(), held.end());
  const auto shared = static_cast<std::size_t>(
      std::ranges::count_if(others, [&](std::uint64_t scan) { return known.contains(scan); }));
  if (shared > 0)
    refuse(options,
           "holds " + io::count_of(shared, "scan") + " of " + options.first +
               ", whose readings would count twice",
           "merge maps of different scans, --anyway merges them as they are");
}

Eigen::Isometry3d aligned(const MergeOptions& options, const MapAlignment& found) {
  if (found.scan.outcome == AlignmentOutcome::corrected) return found.T_map_other;
  refuse(options,
         found.scan.outcome == AlignmentOutcome::nothing_known
             ? "has too little in common with " + options.first + " to be aligned"
             : "fits " + options.first + " nowhere within reach, or at several places alike",
         "give a nearer --pose, or merge without --align");
}

/// Where both have the same surfaces, these must coincide: if another pose certainly fits better, the given
/// one is wrong.
void require_pose(const MergeOptions& options, const MapAlignment& found, const Eigen::Isometry3d& T,
                  double resolution) {
  if (found.scan.outcome != AlignmentOutcome::corrected || found.scan.determined < 6) return;
  const Eigen::Isometry3d off = found.T_map_other * T.inverse();
  const Eigen::Vector3d place = found.scan.T_map_sensor.translation();
  const double distance = (off * place - place).norm(), turn = Eigen::AngleAxisd(off.linear()).angle();
  const double lever = 1;  // m, from there to the surfaces
  if (distance + lever * turn <= 2 * resolution) return;
  refuse(options,
         io::formatted("lies %.1f cm and %.1f° off where its surfaces meet those of ", 100 * distance,
                       deg_per_rad * turn) +
             options.first,
         "--align merges it there, --anyway where it was said to be");
}

/// Of a map's points on surfaces, in numbers: those where another has looked, and of these those on or beside
/// its points. By 100,000 of them a share is known to 0.3 %.
struct Overlap {
  double all = 0, known = 0, agree = 0;
};

Overlap overlap_of(const Map& map, const Map& other, const Eigen::Isometry3d& T_other_map) {
  const std::size_t step = 1 + map.size().points / 100000;
  std::size_t count = 0;
  std::vector<occupancy::ReadingEnd> some;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface != 0 && count++ % step == 0)
      some.push_back({T_other_map * voxel.point, other.parameters().occupancy.resolution});
  });
  const occupancy::Agreement found = occupancy::agreement_of(some, other.octree());
  const auto times = static_cast<double>(step), agree = static_cast<double>(found.agrees);
  return {times * static_cast<double>(some.size()),
          times * (agree + static_cast<double>(found.in_free_space)), times * agree};
}

/// Where one map has looked, the other's surfaces must be its own, too. Of maps of one place, 96 % and more
/// are; of two rooms about the same 0, whose floors coincide, 60 % and 89 %.
void require_common_place(const MergeOptions& options, const Map& first, const Map& second,
                          const Eigen::Isometry3d& T) {
  constexpr double least_known = 0.02;      // of the smaller map's points
  constexpr double least_agreement = 0.75;  // changes of a place seldom take a quarter of what both saw
  const Overlap in_first = overlap_of(second, first, T), in_second = overlap_of(first, second, T.inverse());
  const std::string hint =
      std::string(options.align ? "give a nearer --pose" : "--align finds the pose between two maps") +
      ", --anyway merges them as they are";
  if (in_first.known + in_second.known <= least_known * std::min(in_first.all, in_second.all))
    refuse(options, "has no place in common with " + options.first, hint);
  for (const Overlap& overlap : {in_first, in_second})
    if (overlap.agree < least_agreement * overlap.known)
      refuse(options,
             "does not fit " + options.first + ": of the surfaces of one where the other has looked, only " +
                 std::to_string(std::lround(100 * overlap.agree / overlap.known)) + " % are there in both",
             hint);
}

void print_pose(const Eigen::Isometry3d& T, const Alignment& found) {
  const Eigen::Vector3d t = T.translation();
  const Eigen::Matrix3d& R = T.linear();
  std::printf(
      "%-12s --pose %.4f %.4f %.4f %.3f %.3f %.3f; %d of 6 directions fixed, %.0f %% of %zu readings fit\n",
      "aligned", t.x(), t.y(), t.z(), deg_per_rad * std::atan2(R(2, 1), R(2, 2)),
      deg_per_rad * std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
      deg_per_rad * std::atan2(R(1, 0), R(0, 0)), found.determined, 100 * found.explained_share(),
      found.known);
}

void print_map(const char* label, const Map& map) {
  const Map::Size size = map.size();
  std::printf("%-12s %zu surfaces, %.2f m²; %zu points, %zu of them pending; %llu scans\n", label,
              size.surfaces, total_area(*map.snapshot()), size.points, size.pending,
              static_cast<unsigned long long>(size.scans));
}

void run_merge(const MergeOptions& options) {
  if (writes_over(options.first, options.second))
    throw Error(Error::Kind::usage, options.second, "is given twice, and its readings would count twice",
                "give each map once");
  require_map_writable(options.output, options.force);
  const InterruptGuard guard;
  const io::MapLock lock(options.output);
  LoadedMap first = load_with_warning(options.first);
  const LoadedMap second = load_with_warning(options.second);
  if (!options.anyway) require_other_scans(options, first, second);
  Mapper mapper(std::move(first.map), 1, paper_detector());
  const std::shared_ptr<const Snapshot> before = mapper.snapshot();
  print_map("first", mapper.map());
  print_map("second", second.map);
  Eigen::Isometry3d T = pose_of(options.pose);
  T *= Eigen::Translation3d(second.map.origin() - mapper.map().origin());
  if (options.align || !options.anyway) {
    const MapAlignment found = align_maps(before, second.map, T);
    if (options.align) {
      T = aligned(options, found);
      print_pose(T, found.scan);
    } else {
      require_pose(options, found, T, before->resolution);
    }
  }
  if (!options.anyway) require_common_place(options, mapper.map(), second.map, T);
  const ScanReport report = mapper.merge(second.map, T);
  geometry::end_if_interrupted();
  RunContext().warn(save_map(mapper.map(), options.output));
  print_map("merged", mapper.map());
  const auto& surfaces = mapper.snapshot()->surfaces;
  const auto born = std::ranges::count_if(
      surfaces, [&](const SurfacePtr& one) { return before->find(one->id) == nullptr; });
  std::printf("%-12s %td go on, %td are new\n", "surfaces",
              static_cast<std::ptrdiff_t>(surfaces.size()) - born, born);
  if (report.points_out_of_map > 0)
    std::printf("%-12s %zu points outside the octree\n", "dropped", report.points_out_of_map);
  const std::vector<std::string> written = files_of_map(options.output);
  std::printf("%-12s %s, %s\n", "written", written[0].c_str(), written[1].c_str());
}

}  // namespace

void add_merge(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("merge", merge_description);
  const auto options = std::make_shared<MergeOptions>();
  verb->add_option("first", options->first, "the map whose frame, parameters and ids stay")->required();
  verb->add_option("second", options->second, "the map that is merged into it")->required();
  verb->add_option("-o,--output", options->output, "map to write: name without ending")->required();
  verb->add_option("--pose", options->pose,
                   "X Y Z ROLL PITCH YAW: the second map's frame in the first's, m and degrees [the same]")
      ->expected(6);
  verb->add_flag("--align", options->align, "find the pose by the surfaces of both maps; --pose is a guess");
  verb->add_flag("--anyway", options->anyway, "merge even if the maps do not fit");
  verb->add_flag("--force", options->force, "overwrite a map");
  verb->callback([options] { run_merge(*options); });
}

}  // namespace octosurf
