#pragma once

#include "simulation/mesh.hpp"
#include "simulation/random.hpp"
#include "simulation/scene.hpp"

#include <vector>

namespace octosurf::simulation {

/// How a walking robot would see a terrain: key views of one lap, walked in order.
///
/// 1. Lanes along the terrain's longer side, 0.75 m or less apart and half of that from its rims, are walked
/// there
///    and back one after the other, so that what a step hides on the way up is seen on the way down.
/// 2. The camera is carried 0.5 to 0.6 m (by `random`) above the ground under the body, looks 30 to 40° down
///    and goes where it looks. The ground is the median of what lies highest within 0.3 m, averaged
///    over 0.6 m of the way: a leg's and a body's length, so that a single pole does not lift it.
/// 3. Where there is no ground it goes on at the height between; it never comes nearer than 0.25 m to what is
/// under it.
/// 4. At most 200,000 views, 10 km: of a larger terrain only the first lanes are walked.
/// It does not walk around what is too high to be stepped on, it is carried over it: a wall or a roof is
/// ground. Throws Error(data) if nothing lies under any lane.
std::vector<View> walk_over(const TriangleMesh& mesh, Random random);

}  // namespace octosurf::simulation
