#pragma once

#include "simulation/scene.hpp"
#include "simulation/sensor.hpp"

#include <vector>

namespace octosurf::simulation {

/// `frames` head poses along the key views, walked `laps` times; scene frame. Between keys position,
/// yaw and pitch change evenly; a stretch takes the longer the further it leads and turns.
std::vector<HeadPose> walk_path(const std::vector<View>& keys, std::size_t frames, int laps);

/// How long one lap is, turning included, m.
double path_length_m(const std::vector<View>& keys);

}  // namespace octosurf::simulation
