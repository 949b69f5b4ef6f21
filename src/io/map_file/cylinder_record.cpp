#include "io/map_file/cylinder_record.hpp"

#include "io/map_file/record_stream.hpp"
#include "map_file.pb.h"

#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr int shape_doubles = 7;
constexpr double length_slack = 1e-6;
constexpr double largest_radius = 10;  // m: far larger than any detected cylinder

/// Reads one record's numbers; errors name the cylinder.
class CylinderReader {
 public:
  CylinderReader(const map_file::Cylinder& record, const surfaces::MapState& state, const std::string& where)
      : record_(record), state_(state), where_(where) {}

  surfaces::CylinderModel operator()() const {
    surfaces::CylinderModel cylinder;
    cylinder.id = record_.id();
    cylinder.shape = shape();
    read_inliers(cylinder);
    require(record_.has_revision() && record_.revision() <= state_.revision,
            "has no revision, or one that is to come");
    require(record_.has_unchecked() && record_.unchecked() <= largest_count, "lacks numbers");
    cylinder.born = record_.born();
    cylinder.revision = record_.revision();
    require(cylinder.born <= cylinder.revision, "changed before it was there");
    cylinder.unchecked = record_.unchecked();
    return cylinder;
  }

 private:
  void require(bool holds, const char* what) const {
    if (!holds)
      throw Error(Error::Kind::data, where_,
                  "is damaged: cylinder " + std::to_string(record_.id()) + " " + what,
                  "restore it from a backup");
  }

  geometry::CylinderShape shape() const {
    require(record_.shape_size() == shape_doubles, "lacks numbers");
    for (const double value : record_.shape())
      require(std::isfinite(value), "has a number that is not finite");
    const auto vector = [&](int first) {
      return Eigen::Vector3d(record_.shape(first), record_.shape(first + 1), record_.shape(first + 2));
    };
    const geometry::CylinderShape shape{vector(0), vector(3), record_.shape(6)};
    require(std::fabs(shape.axis.norm() - 1) <= length_slack, "has an axis that is not of length 1");
    require(shape.radius > 0 && shape.radius <= largest_radius, "has a radius that makes no sense");
    require(shape.point.cwiseAbs().maxCoeff() <= std::ldexp(state_.parameters.occupancy.resolution, 18),
            "lies far outside the octree");
    return shape;
  }

  void read_inliers(surfaces::CylinderModel& cylinder) const {
    std::uint64_t last = 0;
    for (const std::uint64_t step : record_.steps()) {
      require((step > 0 || cylinder.inliers.empty()) && step < largest_count && last + step < largest_count,
              "has voxels outside the octree, or out of order");
      last += step;
      const geometry::VoxelKey key = geometry::VoxelKey::unpack(last);
      const auto point = state_.occupancy.at(key).point;
      require(point && point->surface == 0 && state_.cylinders.owner(key) == 0,
              "has a voxel that is not pending, or another's");
      const double misfit = std::fabs(cylinder.shape.distance(point->position.cast<double>()));
      require(misfit <= 1.5 * state_.noise.largest_tolerance(), "has a voxel off its mantle");
      cylinder.inliers[key] = {key, point->range_class, point->position};
    }
    require(cylinder.inliers.size() >= static_cast<std::size_t>(state_.parameters.min_surface_points()),
            "has fewer than n voxels");
  }

  const map_file::Cylinder& record_;
  const surfaces::MapState& state_;
  const std::string& where_;
};

}  // namespace

void write_cylinder(const surfaces::CylinderModel& cylinder, map_file::Cylinder& record) {
  record.set_id(cylinder.id);
  for (const double value : cylinder.shape.point) record.add_shape(value);
  for (const double value : cylinder.shape.axis) record.add_shape(value);
  record.add_shape(cylinder.shape.radius);
  std::uint64_t last = 0;
  for (const auto& [key, inlier] : cylinder.inliers) {
    record.add_steps(key.packed() - last);
    last = key.packed();
  }
  if (cylinder.born > 0) record.set_born(cylinder.born);
  record.set_revision(cylinder.revision);
  record.set_unchecked(cylinder.unchecked);
}

surfaces::CylinderModel read_cylinder(const map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where) {
  return CylinderReader(record, state, where)();
}

}  // namespace octosurf::io
