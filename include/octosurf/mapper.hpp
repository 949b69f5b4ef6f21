#pragma once

#include <array>
#include <concepts>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::detection {
class Detector;
}  // namespace octosurf::detection

/// Builds one map, and its contact surfaces, from posed depth or lidar scans.
namespace octosurf {

struct SpacePart;

/// Stages of processing a scan (docs/design.md §4), in order.
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

/// Result of one scan.
struct ScanReport {
  std::size_t points_raw = 0;           ///< input points
  std::size_t points_not_finite = 0;    ///< not finite: no reading
  std::size_t points_too_near = 0;      ///< dropped: nearer than min_range
  std::size_t points_beyond_range = 0;  ///< not mapped, but their rays free space up to max_range
  std::size_t points_out_of_map = 0;    ///< dropped: outside the octree's 2¹⁶ voxels
  std::size_t voxels = 0;               ///< distinct end voxels
  std::size_t appeared = 0;             ///< voxels that became occupied
  std::size_t vanished = 0;             ///< voxels that are no longer occupied
  std::size_t categorized = 0;          ///< appeared voxels on a surface when insert returned
  std::size_t added = 0;                ///< new inliers inside or at the boundary of existing surfaces
  std::size_t expanded = 0;             ///< points gained by expansion over boundaries
  std::size_t detected = 0;             ///< points gained by detection
  std::size_t waiting = 0;              ///< new readings in blocks not yet processed, see Mapper::drain()
  Alignment alignment;                  ///< alignment.T_map_sensor is the pose used for the insertion
  std::vector<SurfaceId> born;          ///< new surfaces
  std::vector<SurfaceId> grown;         ///< surfaces that gained points
  std::vector<SurfaceId> shrunk;        ///< surfaces that lost points and are left
  std::vector<SurfaceId> merged;        ///< surfaces absorbed by others
  std::vector<SurfaceId> gone;          ///< dissolved surfaces: their remaining points are pending
  std::array<double, stage_names.size()> stage_ms{};  ///< milliseconds, by Stage
  double total_ms = 0;                                ///< milliseconds, all of insert()
};

/// A scan with the part of its processing that does not depend on what is in the map: downsampling and rays
/// at its stated pose. Its memory grows with the voxels that the rays meet.
class PreparedScan {
 public:
  /// The scan alone, for Mapper::insert_all().
  explicit PreparedScan(Scan scan) : scan_(std::move(scan)) {}
  const Scan& scan() const { return scan_; }  ///< at its stated pose

 private:
  friend class Mapper;
  struct Rays;
  Scan scan_;
  std::shared_ptr<const Rays> rays_;
};

/// Updates a map and its surfaces scan by scan (the paper's system).
///
/// 1. Same scans and parameters give the same map, byte for byte, for any `threads`.
/// 2. All or nothing: if a change of the map throws, from insert() to clear() below (an Error on rejected
///    input, or std::bad_alloc), the map is byte for byte as before the call and remains usable: free memory
///    and insert the scan again, or skip it.
/// 3. snapshot() may be called from any thread at any time and never waits for insert(), nor insert() for it.
///    It makes the outlines that changed since it was last called, each once: after three scans of a camera
///    in a kitchen in 5 ms at 2 cm, 20 ms at 1 cm. Another reader waits for that. Throws std::bad_alloc if
///    memory does not suffice; it can be called again.
/// 4. The rollback itself may run out of memory. The next call of the mapper then completes it, or throws
///    std::bad_alloc again; until then save_map() and all other uses of the Map throw Error(incomplete).
///    snapshot() still returns the last complete state.
///
/// One thread at a time may call insert(); meanwhile others may prepare() the next scans. If the system
/// cannot start all threads, fewer are used.
class Mapper {
 public:
  /// `threads` in [1, 256] share a scan's points and rays, the parts in which surfaces are found, and the
  /// outlines of changed surfaces. `paper`: paper_detector() (adapters/paper_detector.hpp), used if the
  /// parameters' detector is `paper`. Throws Error(usage), also if it is and `paper` is null.
  explicit Mapper(const Parameters& parameters = {}, int threads = 1,
                  const detection::Detector* paper = nullptr);
  /// Continues a map with its own parameters. Throws likewise; the map then stays with the caller.
  template <std::same_as<Map> Start>  // deduced, so that {} are parameters
  explicit Mapper(Start&& map, int threads = 1, const detection::Detector* paper = nullptr)
      : Mapper(threads, paper, map) {}
  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;
  ~Mapper();

  /// Throws Error(data), and leaves the map as it was, if the pose is not rigid or outside the octree, and
  /// if the surfaces' ids run out.
  /// A scan whose pose is wrong and cannot be corrected is rejected, see AlignmentOutcome::rejected.
  /// Its readings are in the octree and on surfaces, new ones among them, when this returns. With a
  /// DetectionParameters::detection_budget the search for new ones ends there: drain() finds the rest.
  ScanReport insert(const Scan& scan);
  /// The same result in less time: the work of prepare() is used if the scan is inserted at its stated pose
  /// and the mapper that prepared it had the same resolution and ranges; else it is repeated.
  ScanReport insert(const PreparedScan& prepared);
  /// May be called from any thread, also during insert(): with two threads, one prepares a scan while the
  /// other inserts the previous one. Its time is included in the insertion's report. Returns the scan without
  /// its rays if alignment corrected the last scan's pose (they would be traced anew), if insert() would
  /// reject the scan, or if memory runs out.
  PreparedScan prepare(Scan scan) const;

  /// Inserts a backlog of scans: each updates the octree separately, in order. Surfaces are searched for in
  /// the first scan and then in all others at once, and updated once: ten scans cost little more than two,
  /// but some surfaces are found later than by single insertions. Each scan is aligned with the surfaces from
  /// before the first, and only these are protected from grazing rays; with `align` and `preserve_surfaces`
  /// off the octree equals that of single insertions.
  ///
  /// Returns a report for each inserted scan, at least one if any are given. Stops before a scan that
  /// insert() would reject; if that is the first, throws its Error. After std::bad_alloc none of them is in
  /// the map. Changes of surfaces (`born` to `gone`) and their time are in the last report.
  std::vector<ScanReport> insert_all(std::span<const Scan> scans);
  /// The same for prepared scans.
  std::vector<ScanReport> insert_all(std::span<const PreparedScan> scans);

  /// Searches for surfaces in everything left over by DetectionParameters::detection_budget: call it after
  /// the last scan, or when idle. Afterwards nothing waits. No effect, not even a new revision, if nothing
  /// waits. Throws Error(data) if surface ids run out; see 2 above. Cost: some 30 µs for each waiting
  /// reading.
  ScanReport drain();

  /// Detects surfaces in an occupancy map without scans (.bt and .ot inputs). Where occupied voxels border on
  /// space that a sensor can have been in, the middle of the occupied voxels along the line of sight becomes
  /// a point seen from there, because noise fills voxels in front of a surface and behind it. Sensor space is
  /// free space connected with a cube of 4³ free voxels; if there is none, any free space; if there is none
  /// either, unknown space.
  ScanReport detect_in_occupancy();

  /// Gives the map the occupancy of another octree of the same frame, such as this map's own .bt after
  /// another tool has edited it: map_from_octomap(), map_from_octree(). Every voxel becomes unknown, free or
  /// occupied as there; log-odds stay where the other's are saturated, as all of a .bt, and say nothing new.
  /// Points stay where both are occupied, and with them surfaces and ids; those that vanished leave their
  /// surfaces, and voxels that became occupied get points as in detect_in_occupancy(), which surfaces claim
  /// whose planes they lie on, before new ones are detected. The map's own octree changes nothing. Throws
  /// Error(data), and leaves the map unchanged, if the resolutions differ by more than 1e-5 of it; see 2
  /// above. O(nodes of both).
  ScanReport replace_occupancy(const Map& other);

  /// Merges another map of the same or an adjacent place, which is not changed. `T_map_other`: the other
  /// map's frame to this one's, rigid; translation in m. It must be accurate to about a voxel: align_maps()
  /// (map_alignment.hpp) refines a guess.
  ///
  /// 1. Readings of the two maps count as independent: a voxel's log-odds are the clamped sum of both; a
  ///    voxel unknown in one gets the other's. So occupancy does not depend on which map takes in the other.
  ///    Scans contained in both maps would count twice.
  /// 2. A voxel that becomes occupied takes the other map's point; where both have one, the one seen from
  ///    clearly nearer wins. Voxels that are free in the sum lose their points, also from surfaces.
  /// 3. Surfaces of this map keep their ids, unless they merge with each other. The other map's surfaces
  ///    continue in those on the same plane, else they get new ids and keep their planes and evidence; then
  ///    the stages of a scan run on all changes.
  /// 4. An empty map changes nothing. Parameters are this map's, scan counts add up, the noise estimates are
  ///    combined.
  /// 5. In another frame voxels do not coincide: points are moved, free space is sampled at the centres of
  ///    this map's voxels; about a fifth of a plane's points share a voxel with another. Only an exact
  ///    identity avoids resampling.
  ///
  /// Throws, and leaves the map unchanged: Error(data) if the maps' resolution, clamps or threshold of
  /// occupancy differ, if T_map_other is not rigid, or if surface ids run out; Error(usage) if `other`
  /// is the map itself; Error(incomplete) if `other` is incomplete, see 4 above. Do not insert into `other`
  /// during the call. Cost: as inserting all of the other map's points in one scan, some 10 µs each; 0.5 µs
  /// more for each resampled voxel.
  /// In the report, points_raw is the number of the other map's points.
  ScanReport merge(const Map& other, const Eigen::Isometry3d& T_map_other = Eigen::Isometry3d::Identity());

  /// Clears a region: its voxels become unknown, or as after one free reading, and leave their surfaces,
  /// which readers see as after a scan; `shrunk` and `gone` of the report list them. Later scans map it
  /// again. Throws Error(usage) for a part that is empty or not finite; see 2 above.
  /// O(nodes and surfaces in it).
  ScanReport clear(const SpacePart& part, bool as_free = false);

  /// Turns on or off the `octree` of the same scan in snapshots. Costs copying the blocks that a scan writes
  /// to (docs/design.md §5): some tenths of a millisecond for a camera's.
  void share_octree(bool on = true);

  /// From now on the map records which scans were inserted, for Map::holds(): 8 bytes each, saved with it.
  void remember_scans();

  std::shared_ptr<const Snapshot> snapshot() const;  ///< of the last complete scan
  const Map& map() const;                            ///< throws std::bad_alloc after a failure, see 4
  Map release() &&;                                  ///< likewise

 private:
  Mapper(int threads, const detection::Detector* paper, Map& taken_over);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
