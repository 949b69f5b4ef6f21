#pragma once

#include "geometry/voxel_key.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/surface_numbers.hpp"
#include "surfaces/model_store.hpp"
#include "surfaces/surface_model.hpp"

#include <boost/container/small_vector.hpp>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>
#include <vector>

namespace octosurf::surfaces {

/// All surfaces, indexed by id and by place (8³-voxel blocks with inliers), so that a point is compared only
/// with nearby surfaces.
class SurfaceStore : public ModelStore<SurfaceModel, SurfaceModel::State>, public occupancy::PlaneLookup {
 public:
  using ModelStore::find;

  explicit SurfaceStore(double resolution) : resolution_(resolution) {}

  SurfaceModel& create(const Plane& plane, const Eigen::Vector3d& origin);
  SurfaceModel& restore(const SurfaceModel::State& state);
  /// Its inliers must have been removed; `into` is the surface that absorbed it, if any.
  void erase(SurfaceId id, SurfaceId into = 0);
  /// The first id from `first` on whose number (SurfaceNumbers) no surface here has. Throws Error(data) if
  /// there is none.
  SurfaceId free_id(SurfaceId first) const;
  bool has_number_of(SurfaceId id) const { return numbers_.contains(occupancy::SurfaceNumbers::of(id)); }

  /// Starts recording the previous state until commit() or roll_back(): O(1) for each surface accessed for
  /// modification.
  void begin_changes() { open(); }
  void commit() noexcept { close(); }
  /// Restores the state at begin_changes(). `points`: the octree of that time, which has the inliers;
  /// `published`: the snapshot of that time, which has the polygons. Changes nothing if it throws, and can be
  /// called again. O(points of the octree).
  void roll_back(const occupancy::OccupancyMap& points, const Snapshot& published);

  // Inliers are added and removed through the store, which updates the index by place.
  void add(SurfaceModel& surface, const Inlier& inlier);
  bool remove(SurfaceModel& surface, geometry::VoxelKey key, const Eigen::Vector3f& position);

  /// Ids with inliers in the blocks within `reach` voxels of `key`, ascending, each once.
  using Ids = boost::container::small_vector<SurfaceId, 8>;
  Ids near(geometry::VoxelKey key, int reach) const { return places_.blocks.near(key, reach); }
  static constexpr int block_bits = 3, region_bits = 6;  ///< of their edges in voxels
  /// The same for regions of 64³ voxels: a few look-ups where near() takes some forty.
  Ids in_regions_near(geometry::VoxelKey key, int reach) const { return places_.regions.near(key, reach); }

  bool find(SurfaceId id, Plane& plane, double& tolerance) const override;
  void set_erosion_tolerance(double tolerance) { erosion_tolerance_ = tolerance; }

 private:
  /// Which surfaces are in cubes of 2^bits voxels along each edge.
  class Residents {
   public:
    explicit Residents(int bits) : bits_(bits) {}
    /// True if it is the first of the surface there.
    bool count_in(geometry::VoxelKey key, SurfaceId id);
    /// True if it was the last of the surface there.
    bool count_out(geometry::VoxelKey key, SurfaceId id);
    Ids near(geometry::VoxelKey key, int reach) const;

   private:
    struct Resident {
      SurfaceId id;
      std::uint32_t count;  // inliers in a block, blocks in a region
    };
    std::uint64_t cube_of(geometry::VoxelKey key) const {
      return key.packed() >> bits_ & (0xffffULL >> bits_) * 0x100010001ULL;
    }
    int bits_;
    tsl::robin_map<std::uint64_t, std::vector<Resident>, geometry::PackedKeyHash> cubes_;
  };
  struct Places {
    void add(geometry::VoxelKey key, SurfaceId id) {
      if (blocks.count_in(key, id)) regions.count_in(key, id);
    }
    Residents blocks{block_bits}, regions{region_bits};
  };

  double resolution_;
  double erosion_tolerance_ = 0;
  tsl::robin_set<std::uint32_t> numbers_;  // of models_
  Places places_;
};

}  // namespace octosurf::surfaces
