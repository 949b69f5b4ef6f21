#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::sensing {
struct VoxelScan;
}  // namespace octosurf::sensing

/// Posed depth or lidar scans in; one map of a place, and the contact surfaces in it, out.
namespace octosurf {

/// Stages of one scan's way (docs/design.md §4), in order.
enum class Stage {
  align,
  downsample,
  occupancy,
  retract,
  add_inliers,
  expand,
  detect,
  revise,
  cylinders,
  derive
};
/// By Stage, as in reports.
inline constexpr std::array<std::string_view, 10> stage_names{
    "align",  "downsample", "occupancy", "retract",   "add_inliers",
    "expand", "detect",     "revise",    "cylinders", "derive"};

/// What one scan did.
struct ScanReport {
  std::size_t points_raw = 0;           ///< handed in
  std::size_t points_not_finite = 0;    ///< no reading
  std::size_t points_too_near = 0;      ///< dropped: nearer than min_range
  std::size_t points_beyond_range = 0;  ///< not mapped, but free space up to max_range
  std::size_t points_out_of_map = 0;    ///< dropped: outside the octree's 2¹⁶ voxels
  std::size_t voxels = 0;               ///< distinct end voxels
  std::size_t appeared = 0;             ///< voxels that became occupied
  std::size_t vanished = 0;             ///< voxels that no longer are
  std::size_t categorized = 0;          ///< of the appeared, in a surface when insert returned
  std::size_t added = 0;     ///< new inliers of surfaces that were there before, inside them or at their rims
  std::size_t expanded = 0;  ///< by which they expanded over their boundaries
  std::size_t detected = 0;  ///< that detection gave them
  std::size_t waiting = 0;   ///< new readings in blocks whose turn has not come, see Mapper::drain()
  Alignment alignment;  ///< of the pose; alignment.T_map_sensor is the one that the scan was inserted with
  std::vector<SurfaceId> born;    ///< surfaces that appeared
  std::vector<SurfaceId> grown;   ///< that were given points
  std::vector<SurfaceId> shrunk;  ///< that lost points
  std::vector<SurfaceId> merged;  ///< that others took in
  std::vector<SurfaceId> gone;    ///< that were dissolved: what is left of their points is pending
  std::array<double, stage_names.size()> stage_ms{};  ///< milliseconds, by Stage
  double total_ms = 0;                                ///< milliseconds, all of insert()
};

/// What became of another map's surface, see Mapper::merge().
struct MergedSurface {
  SurfaceId other = 0;          ///< its id in the other map
  SurfaceId id = 0;             ///< the surface here that has most of its points; 0: none has any
  std::size_t inliers = 0;      ///< points that it had there
  std::size_t shared = 0;       ///< of them, in voxels of surface `id` here
  std::size_t on_surfaces = 0;  ///< of them, in voxels of any surface here
};

/// What a merger did.
struct MergeReport {
  ScanReport changes;                   ///< as of a scan; points_raw: those of the other map
  std::vector<MergedSurface> surfaces;  ///< each of the other map's, ascending id there
};

/// Keeps a map and its surfaces up to date, scan by scan (the paper's system).
///
/// 1. Same scans and parameters, same map, byte for byte, whatever `threads` is.
/// 2. All or nothing: whatever insert(), insert_all(), drain(), merge(), detect_in_occupancy() and
///    resegment() throw, an Error because something is refused or std::bad_alloc in the middle, the map is
///    byte for byte what it was before the call, and goes on from there: free some memory and insert the scan
///    again, or leave it out.
/// 3. snapshot() may be called from any thread at any time and never waits for insert().
/// 4. To take back what was begun may need memory, too. If there is none, the next call of the mapper does
///    what is left, or throws std::bad_alloc again; until then save_map() and all else that is asked of a Map
///    that somebody holds throw Error(incomplete). snapshot() goes on giving what was complete before.
///
/// One thread at a time may call insert(). Threads that the system does not grant are done without.
class Mapper {
 public:
  /// `threads` in [1, 256] share a scan's points and rays, and the outlines of what has changed. Throws
  /// Error(usage), also if the parameters' detector is `paper` and the program has not called
  /// enable_paper_detector() (adapters/paper_detector.hpp).
  explicit Mapper(const Parameters& parameters = {}, int threads = 1);
  /// Goes on with a map, with the parameters it was made with. Throws likewise; the map then stays the
  /// caller's.
  explicit Mapper(Map&& map, int threads = 1);
  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;
  ~Mapper();

  /// Throws Error(data), and leaves the map as it was, if the pose is not rigid or outside the octree, and
  /// if the surfaces' ids could run out.
  /// A scan that is clearly off and not to be put right is not inserted, see AlignmentOutcome::set_aside.
  /// Its readings are in the octree and on the surfaces that are known when this returns; of new surfaces, as
  /// many are looked for as DetectionParameters::detection_budget allows: drain() finds the rest.
  ScanReport insert(const Scan& scan);

  /// Scans that have come while others were mapped: each goes into the octree by itself, in order. Surfaces
  /// are looked for in the first and then in all others at once, and are brought up to date once: ten cost
  /// little more than two, and some surfaces are found later than one by one. Each scan is aligned with the
  /// surfaces from before the first, and these alone are spared grazing rays; with `align` and
  /// `preserve_surfaces` off the octree is the one that as many insert() make.
  ///
  /// Takes as many as it can and returns a report for each that it took, at least one if any are given. Stops
  /// before a scan that insert() would refuse; if that is the first, throws its Error. After std::bad_alloc
  /// none of them is in the map. What became of surfaces (`born` to `gone`), and the time that took, is in
  /// the last one's report.
  std::vector<ScanReport> insert_all(std::span<const Scan> scans);
  /// The same; and while surfaces are brought up to date, the scan that comes after these goes through
  /// downsampling and rays in another thread, as if taken from where it says. If the next scan inserted is
  /// that one and its pose is left as it is, this has been done; the map is the same. `next` is asked once,
  /// in this thread, and only where that is of use: with `threads` over 1, poses lately not corrected. It
  /// gives the scan, which stays as it is until insert_all() returns, or null. Memory: a copy of the scan.
  /// What is done so counts in the stages' times and in `total_ms`, though nobody waits for it.
  std::vector<ScanReport> insert_all(std::span<const Scan> scans, const std::function<const Scan*()>& next);

  /// Looks for surfaces in all that waits because scans had brought more than
  /// DetectionParameters::detection_budget: after the last scan, and whenever there is time. After it nothing
  /// waits. Without effect, not even a new revision, if nothing does. Throws Error(data) if the surfaces' ids
  /// could run out; see 2 above. Cost: some 30 µs for each reading that waits.
  ScanReport drain();

  /// Surfaces of an existing occupancy map, without scans: where occupied voxels border on space a
  /// sensor can have been in, the middle of those that lie behind one another becomes a point, seen from
  /// there: readings' noise fills voxels in front of a surface and behind it. Such space is free space
  /// connected with a cube of 4³ free voxels; if there is none, any that is free; if none is, what is
  /// unknown. Used for .bt and .ot inputs.
  ScanReport detect_in_occupancy();

  /// Takes in another map of the same place or of one beside it, which stays as it is. `T_map_other`: the
  /// other map's frame to this one's, rigid; translation in m. It must be right to about a voxel:
  /// align_maps() (map_alignment.hpp) makes it so from a guess.
  ///
  /// 1. What the two know counts as independent readings: a voxel's log-odds are the sum of both, clamped as
  ///    in the octree; a voxel that one does not know has the other's. So occupancy is the same whichever
  ///    map takes in the other. Maps that share scans are not independent: those would count twice.
  /// 2. A voxel that becomes occupied takes the other map's point; where both have one, the one seen from
  ///    clearly nearer by stays. What both together say is free goes, from surfaces, too.
  /// 3. Surfaces that are here keep their ids, unless they merge with each other. The other map's go on in
  ///    those where they are one plane, else they get new ids, with the planes that they have there and what
  ///    later scans have told of them; then the stages of a scan run on what has changed.
  /// 4. An empty map changes nothing. Parameters are this map's, scans are counted together, the noise is
  ///    what both have seen.
  /// 5. In another frame voxels do not fall on voxels: points are moved, free space is looked up at the
  ///    centres of this map's voxels; some of a plane's points meet in one voxel, about a fifth. With the
  ///    identity, exactly that and not nearly, nothing is resampled.
  ///
  /// Throws, and leaves the map as it was: Error(data) if the maps' resolution, clamps or threshold of
  /// occupancy differ, if T_map_other is not rigid, or if the surfaces' ids could run out; Error(usage) if
  /// `other` is the map itself; Error(incomplete) if `other` is, see 4 above. Nothing may insert into `other`
  /// meanwhile. Cost: as scans of what the other map has, all at once: some 10 µs for each of its points; 0.5
  /// µs more for each voxel that is resampled.
  MergeReport merge(const Map& other, const Eigen::Isometry3d& T_map_other = Eigen::Isometry3d::Identity());

  /// Replaces all surfaces by those that the map's detector finds among all of the octree's points at once:
  /// what scan by scan is found around changes. A surface keeps its id in the one that has most of its
  /// points, unless that has more of another's; departures name who took whom in, and what later scans told
  /// of a surface's plane goes on in the one that has its points. Octree and poses stay as they are.
  ///
  /// Looks at every point, so it is for the end of a run. Throws Error(data), and leaves the map as it was,
  /// if the surfaces' ids could run out; see 2 above. `born`, `merged` and `gone` of the report say what
  /// became of surfaces.
  ScanReport resegment();

  /// From now on snapshots have an `octree` of the same scan, or no longer. Costs a scan the copying of what
  /// of the octree it writes to (docs/design.md §5): some tenths of a millisecond for a camera's.
  void share_octree(bool on = true);

  /// From now on the map remembers which scans it takes, see Map::holds(): 8 bytes each, saved with it.
  void remember_scans();

  std::shared_ptr<const Snapshot> snapshot() const;  ///< of the last whole scan
  const Map& map() const;                            ///< throws std::bad_alloc after a failure, see 4
  Map release() &&;                                  ///< likewise

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The shipped invariant checker (docs/design.md §3): one line per violation, empty if all hold.
/// Cost: one pass over octree and surfaces; for tests, `info --check` and the suspicious.
std::vector<std::string> check_invariants(const Map& map);

}  // namespace octosurf
