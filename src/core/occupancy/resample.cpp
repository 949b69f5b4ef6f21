// Resampling of an octree onto the grid of another frame.
#include "occupancy/key_box.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace octosurf::occupancy {
namespace {

using Node = VoxelTree::Node;

/// Whether a box of voxels is uniform, and its value.
class Uniform {
 public:
  /// `beyond`: part of the box is outside the octree and so unknown.
  explicit Uniform(bool beyond) : any_(beyond) {}

  /// False if two of the voxels differ.
  bool take(const Node& node, const Key3& corner, const KeyBox& box) {
    const KeyBox cube = KeyBox::cube(corner, node.level());
    if (!box.meets(cube)) return true;
    if (!node.exists()) return agree({});
    if (!node.has_children()) return node.payload() == nullptr && agree(node.log_odds());
    // A divided cube is not uniform, and it lies in the box entirely.
    if (box.holds(cube)) return false;
    for (unsigned c = 0; c < 8; ++c)
      if (!take(node.child(c), child_corner(corner, c, node.level() - 1), box)) return false;
    return true;
  }
  std::optional<float> log_odds() const { return value_; }

 private:
  bool agree(std::optional<float> value) {
    if (!any_) value_ = value;
    any_ = true;
    return value_ == value;
  }
  bool any_;
  std::optional<float> value_;  // empty: unknown
};

/// Fills a tree with another's values at its voxels' centres, cube by cube: voxels deep in a uniform cube are
/// not sampled one by one.
class Resampling {
 public:
  Resampling(const VoxelTree& from, const geometry::VoxelGrid& grid, const Eigen::Isometry3d& T_from_to,
             VoxelTree& to)
      : from_(from), grid_(grid), T_from_to_(T_from_to), to_(to) {}

  void below(const Key3& corner, int level) {
    if (level == 0) return voxel(key_of(corner));
    const KeyBox box = box_of(corner, level);
    Uniform uniform(!KeyBox{}.holds(box));
    if (uniform.take(from_.root(), {0, 0, 0}, box)) {
      if (uniform.log_odds()) to_.set_leaf(key_of(corner), level, *uniform.log_odds());
      return;
    }
    for (unsigned c = 0; c < 8; ++c) below(child_corner(corner, c, level - 1), level - 1);
  }

 private:
  Eigen::Vector3d centre_in_from(const Key3& corner, double half) const {
    const Eigen::Vector3d at(corner[0], corner[1], corner[2]);
    return T_from_to_ * ((at.array() + half - geometry::VoxelGrid::origin) * grid_.resolution()).matrix();
  }

  void voxel(geometry::VoxelKey key) {
    geometry::VoxelKey there;
    if (!grid_.key_of(centre_in_from({key.x, key.y, key.z}, 0.5).cast<float>(), there)) return;
    const VoxelTree::Lookup found = from_.find(there);
    if (found.known && found.payload == nullptr) to_.set_leaf(key, 0, found.log_odds);
  }

  /// Range of voxels that the cube's centres can fall into.
  KeyBox box_of(const Key3& corner, int level) const {
    const double edge = 1 << level;
    const Eigen::Vector3d centre = centre_in_from(corner, edge / 2) / grid_.resolution();
    constexpr double rounding = 0.01;  // voxels: a float's, at the octree's edge, in key_of()
    const Eigen::Vector3d half =
        (T_from_to_.linear().cwiseAbs() * Eigen::Vector3d::Constant((edge - 1) / 2)).array() + rounding;
    KeyBox box;
    for (int i = 0; i < 3; ++i) {
      const auto key = [](double voxels) {
        const double at = std::floor(voxels) + geometry::VoxelGrid::origin;
        return static_cast<int>(std::clamp(at, -1.0, geometry::VoxelGrid::last + 1.0));
      };
      box.low[static_cast<std::size_t>(i)] = key(centre[i] - half[i]);
      box.high[static_cast<std::size_t>(i)] = key(centre[i] + half[i]);
    }
    return box;
  }

  const VoxelTree& from_;
  const geometry::VoxelGrid& grid_;
  const Eigen::Isometry3d& T_from_to_;
  VoxelTree& to_;
};

}  // namespace

OccupancyMap OccupancyMap::resampled(const OccupancyMap& other, const Eigen::Isometry3d& T_here_other,
                                     const OccupancyParameters& parameters, std::size_t& lost) {
  OccupancyMap here(parameters);
  const VoxelTree& from = *other.tree_;
  VoxelTree& to = *here.tree_;
  to.numbers = from.numbers;
  const Eigen::Isometry3d T_other_here = T_here_other.inverse();
  Resampling(from, here.grid_, T_other_here, to).below({0, 0, 0}, VoxelTree::top_level);
  from.visit_points({}, VoxelTree::top_level,
                    [&](const VoxelPayload& payload, geometry::VoxelKey k, PayloadPlace, float log_odds) {
                      const Eigen::Vector3f point =
                          (T_here_other * load_point(payload, other.grid_, k)).cast<float>();
                      geometry::VoxelKey key;
                      if (!here.grid_.key_of(point, key)) {
                        ++lost;
                        return;
                      }
                      const VoxelTree::Lookup found = to.find(key);
                      const bool taken = found.payload != nullptr;
                      const unsigned range_class = taken ? found.payload->range_class : 0;
                      to.set_leaf(key, 0, taken ? std::max(log_odds, found.log_odds) : log_odds);
                      if (taken && payload.range_class >= range_class) return;
                      VoxelPayload& moved = to.make_payload(key) = payload;
                      store_place(moved, here.grid_, key, point);
                      const Eigen::Vector3d view = sensing::decode_view(payload.view).cast<double>();
                      moved.view = sensing::encode_view((T_here_other.linear() * view).cast<float>()) & 0xfff;
                    });
  return here;
}

}  // namespace octosurf::occupancy
