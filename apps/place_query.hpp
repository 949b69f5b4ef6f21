#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf {

/// Queries of a place with any number of answers: `--box`, `--sphere`, `--ray`, `--voxel`.
struct PlaceQuery {
  std::vector<double> box, sphere, ray, voxel;
  bool asked() const { return !box.empty() || !sphere.empty() || !ray.empty() || !voxel.empty(); }
};

void add_place_options(CLI::Option_group& question, PlaceQuery& query);
/// Prints the answer, which may be empty.
void answer(const Map& map, const PlaceQuery& query, const Eigen::Vector3d& up, bool json);

}  // namespace octosurf
