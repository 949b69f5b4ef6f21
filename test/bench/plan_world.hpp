#pragma once

#include "evaluation/planar_region.hpp"
#include "planning/footsteps/swing.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::bench {

inline constexpr double within_m = 0.01;  ///< of true ground every part of a sole lies

/// What stands, as points, in columns of 10 cm: true faces, and noise-free readings for what has none.
class TruePoints {
 public:
  void add(const Eigen::Vector3d& p) { columns_[key(p.head<2>())].push_back(p); }

  /// One lies in the box by more than a centimetre: at that distance truth is sampled. Bottom and top of the
  /// box are at those heights over its middle, and rise by `rise`, m along x and y.
  bool in_box(const footsteps::SwingPose& pose, const Eigen::Vector2d& middle, double length, double width,
              double from_z, double to_z, const Eigen::Vector2d& rise = Eigen::Vector2d::Zero()) const;

 private:
  static constexpr double cell = 0.1;
  static std::uint64_t key(const Eigen::Vector2d& p) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(static_cast<int>(std::floor(p.x() / cell))))
               << 32 |
           static_cast<std::uint32_t>(static_cast<int>(std::floor(p.y() / cell)));
  }
  std::unordered_map<std::uint64_t, std::vector<Eigen::Vector3d>> columns_;
};

struct TrueGround {
  Plane plane;
  Eigen::Isometry3d T_face_map;
  evaluation::PlanarRegion region;
};

/// A scene, mapped and true.
struct World {
  std::string name;
  std::shared_ptr<const Snapshot> mapped, truth;
  OccupancyView octree, true_octree;
  std::vector<TrueGround> ground;
  TruePoints points;
  std::vector<Standing> candidates;  ///< seen level ground
};

/// A scene by its name, or of a terrain's `mesh` if that is not empty.
World make_world(const std::string& scene, const std::filesystem::path& mesh, std::uint64_t seed);

/// Every sample of the sole lies over a true face or within a centimetre beside it, and at most so far off
/// its plane.
bool supported(const World& world, const Footstep& step, const ContactShape& foot, double off_plane);

/// The body's box or a swinging leg meets a true point. A biped's body is upright; a quadruped's leans as the
/// plane through its four feet does, as that of its planner.
bool touches(const World& world, const FootstepPlan& plan, const Robot& robot);

}  // namespace octosurf::bench
