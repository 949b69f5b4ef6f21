#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "map_file.pb.h"

#include <cmath>

namespace octosurf::io {
namespace {

constexpr double length_slack = 1e-6;
constexpr double largest_radius = 10;  // m: far larger than any detected cylinder

void visit(map_file::Cylinder& record, geometry::CylinderShape& shape, const Damage* damage) {
  visit_numbers(record.mutable_shape(), damage, finite_numbers, shape.point, shape.axis, shape.radius);
}

}  // namespace

void write_cylinder(surfaces::CylinderModel cylinder, map_file::Cylinder& record) {
  record.set_id(cylinder.id);
  visit(record, cylinder.shape, nullptr);
  KeySteps steps;
  for (const auto& [key, inlier] : cylinder.inliers) record.add_steps(steps.to(key));
  if (cylinder.born > 0) record.set_born(cylinder.born);
  record.set_revision(cylinder.revision);
  record.set_unchecked(cylinder.unchecked);
}

surfaces::CylinderModel read_cylinder(map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where) {
  const Damage damage{where, "cylinder " + std::to_string(record.id()) + " "};
  const auto require = [&](bool holds, const char* what) { damage.require(holds, what); };
  surfaces::CylinderModel cylinder;
  cylinder.id = record.id();
  visit(record, cylinder.shape, &damage);
  require(std::fabs(cylinder.shape.axis.norm() - 1) <= length_slack, "has an axis that is not of length 1");
  require(cylinder.shape.radius > 0 && cylinder.shape.radius <= largest_radius,
          "has a radius that makes no sense");
  require(cylinder.shape.point.cwiseAbs().maxCoeff() <= std::ldexp(state.parameters.occupancy.resolution, 18),
          "lies far outside the octree");
  KeySteps steps;
  for (const std::uint64_t step : record.steps()) {
    const auto key = steps.from(step);
    if (!key) damage.fail("has voxels outside the octree, or out of order");
    const auto point = state.occupancy.at(*key).point;
    const CylinderId owner = state.cylinders.owner(*key);
    require(point && point->surface == 0 && (owner == 0 || owner == cylinder.id),
            "has a voxel that is not pending, or another's");
    const double misfit = std::fabs(cylinder.shape.distance(point->position.cast<double>()));
    require(misfit <= 1.5 * state.noise.largest_tolerance(), "has a voxel off its lateral");
    cylinder.inliers[*key] = {*key, point->range_class, point->position};
  }
  require(cylinder.inliers.size() >= static_cast<std::size_t>(state.parameters.min_surface_points()),
          "has fewer than n voxels");
  require(record.has_revision() && record.revision() <= state.revision,
          "has no revision, or one that is to come");
  require(record.has_unchecked() && record.unchecked() <= largest_count, "lacks numbers");
  cylinder.born = record.born();
  cylinder.revision = record.revision();
  require(cylinder.born <= cylinder.revision, "changed before it was there");
  cylinder.unchecked = record.unchecked();
  return cylinder;
}

}  // namespace octosurf::io
