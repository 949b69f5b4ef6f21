#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::bench {

using Json = nlohmann::json;

/// One side of a comparison; lives in a process of its own (contest.hpp).
class Contestant {
 public:
  virtual ~Contestant() = default;
  /// Takes the scan over in the form the contestant works on. Not timed.
  virtual void prepare(const Scan& /*scan*/) {}
  /// The work that is compared. Timed.
  virtual void run() = 0;
  /// Milliseconds of run()'s stages, if it knows them.
  virtual Json stages() const { return nullptr; }
  /// Answers what is asked about its state. Not timed.
  virtual Json tell(const Json& /*question*/) { return nullptr; }
};

/// By name:
///
/// | kind | run() | settings |
/// |---|---|---|
/// | `octomap` | insertPointCloud, lazy, discretised, and updateInnerOccupancy | resolution, max_range |
/// | `plain` | insert_point_cloud of adapters/octomap.hpp on an octomap::OcTree | the same, threads |
/// | `occupancy` | Downsampler and OccupancyMap::insert | the same, threads |
/// | `mapper` | Mapper::insert | the same; fresh: an empty map for every scan |
/// | `paper` | PaperPipeline::insert | resolution, small_radius |
/// | `region_growing`, `ransac` | CGAL's normals and shape detection | resolution, accumulate |
/// | `normal_field`, `mls` | all normals of a scan's voxels | resolution, radius |
/// | `derive_grown`, `derive_fresh`, `derive_reference` | a surface's outline after it grew | resolution,
/// inliers, step | | `load_map`, `read_binary` | reading a saved map | file |
///
/// A `max_range` that is null is unlimited. Throws Error(usage) for an unknown kind.
std::unique_ptr<Contestant> make_contestant(const std::string& kind, const Json& settings);

std::unique_ptr<Contestant> make_octomap(const Json& settings);
std::unique_ptr<Contestant> make_plain(const Json& settings);
std::unique_ptr<Contestant> make_occupancy(const Json& settings);
std::unique_ptr<Contestant> make_read_binary(const Json& settings);
std::unique_ptr<Contestant> make_load_map(const Json& settings);
std::unique_ptr<Contestant> make_mapper(const Json& settings);
std::unique_ptr<Contestant> make_paper(const Json& settings);
std::unique_ptr<Contestant> make_region_growing(const Json& settings);
std::unique_ptr<Contestant> make_ransac(const Json& settings);
std::unique_ptr<Contestant> make_normal_field(const Json& settings);
std::unique_ptr<Contestant> make_mls(const Json& settings);
std::unique_ptr<Contestant> make_derive_grown(const Json& settings);
std::unique_ptr<Contestant> make_derive_fresh(const Json& settings);
std::unique_ptr<Contestant> make_derive_reference(const Json& settings);

// What several of them need.

/// Default parameters with the settings' resolution and max_range.
Parameters parameters_from(const Json& settings);
/// The settings' max_range, m; infinity where it is null or absent.
double max_range_of(const Json& settings);

/// {"faces", "correct", "noise", "area_m2", "unsafe_m2"} against the truth in the file
/// question["evaluate"] (evaluation/evaluate.hpp).
Json scores(const Snapshot& snapshot, const Json& question);

/// Bytes of heap in use: mallinfo2's uordblks + hblkhd, so what malloc rounds up and its chunk heads
/// are counted, what has been freed is not.
std::size_t heap_in_use();

}  // namespace octosurf::bench
