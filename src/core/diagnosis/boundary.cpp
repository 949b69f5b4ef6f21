#include "sensing/reading_code.hpp"
#include "sensing/reading_model.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <octosurf/boundary.hpp>

namespace octosurf {
namespace {

constexpr float class_spread = 1.19F;  // ⁴√2: half width of a range class

using Votes = std::array<int, edge_kind_names.size()>;

/// Labels the edges of one surface.
class EdgeLabeller {
 public:
  EdgeLabeller(const surfaces::MapState& state, const Surface& surface)
      : state_(state),
        surface_(surface),
        model_(state.noise, state.parameters.occupancy.resolution),
        d_(state.parameters.occupancy.resolution),
        h_(state.parameters.max_hole_size()),
        normal_(surface.plane.normal) {
    unsigned farthest = 1;
    if (const surfaces::SurfaceModel* model = state.surfaces.find(surface.id))
      model->for_each_inlier([&](const surfaces::Inlier& inlier) {
        farthest = std::max<unsigned>(farthest, inlier.range_class);
      });
    reach_off_plane_ = 1.5 * model_.reach(farthest, 1) + d_;
    const bool beyond_a_camera =
        farthest > sensing::range_class_of(static_cast<float>(sensing::depth_camera_max_range));
    max_range_ = state.parameters.occupancy.max_range.value_or(
        beyond_a_camera ? std::numeric_limits<double>::infinity() : sensing::depth_camera_max_range);
  }

  std::vector<EdgeKind> label(const Ring2& ring) const {
    const std::size_t n = ring.size();
    std::vector<std::optional<occupancy::VoxelPoint>> seen(n);
    for (std::size_t k = 0; k < n; ++k) seen[k] = inlier_at(surface_.to_map(ring[k]));
    std::vector<EdgeKind> kinds(n);
    for (std::size_t k = 0; k < n; ++k)
      kinds[k] = vote(ring[k], ring[(k + 1) % n], seen[k], seen[(k + 1) % n]);
    for (std::size_t k = 0; k < n; ++k) {
      const EdgeKind before = kinds[(k + n - 1) % n], after = kinds[(k + 1) % n];
      if (before == after && (ring[(k + 1) % n] - ring[k]).norm() < 2 * d_) kinds[k] = before;
    }
    return kinds;
  }

 private:
  occupancy::OccupancyMap::Lookup at(const Eigen::Vector3d& p) const { return state_.occupancy.at(p); }
  bool is_free(const Eigen::Vector3d& p) const { return at(p).state == occupancy::OccupancyMap::State::free; }
  double off_plane(const occupancy::VoxelPoint& p) const {
    return std::fabs(surface_.plane.signed_distance(p.position.cast<double>()));
  }

  /// The inlier whose projection a vertex is.
  std::optional<occupancy::VoxelPoint> inlier_at(const Eigen::Vector3d& vertex) const {
    std::optional<occupancy::VoxelPoint> best;
    double nearest = 2 * d_;
    for (double t = -reach_off_plane_; t <= reach_off_plane_; t += d_ / 2) {
      const std::optional<occupancy::VoxelPoint> found = at(vertex + t * normal_).point;
      if (!found || found->surface != surface_.id) continue;
      const Eigen::Vector3d offset = found->position.cast<double>() - vertex;
      const double aside = (offset - offset.dot(normal_) * normal_).norm();
      if (aside >= nearest) continue;
      nearest = aside;
      best = found;
    }
    return best;
  }

  /// Something other than this surface, against which it may end.
  bool obstacle_at(const Eigen::Vector3d& place, double tolerance) const {
    const double reach = tolerance + 1.5 * d_;
    for (double t = -reach; t <= reach; t += d_ / 2) {
      const std::optional<occupancy::VoxelPoint> found = at(place + t * normal_).point;
      if (!found || found->surface == surface_.id) continue;
      if (found->surface != 0 || off_plane(*found) > tolerance) return true;
    }
    return false;
  }

  /// Whether rays continued behind the plane: grazing ones free the voxels above an unseen floor, not those
  /// below.
  bool open_at(const Eigen::Vector3d& place, const Eigen::Vector3d& view, double tolerance) const {
    const double depth = tolerance + d_ / 2;
    const double cosine = std::max(sensing::ReadingModel::grazing_cosine, normal_.dot(view));
    if (is_free(place - depth / cosine * view)) return true;
    return is_free(place) && is_free(place - depth * normal_);
  }

  /// Why a place on the plane is unknown, beside the inlier `seen`.
  EdgeKind unknown_because(const Eigen::Vector3d& place, const occupancy::VoxelPoint& seen,
                           const Eigen::Vector3d& outward, double tolerance) const {
    const Eigen::Vector3d view = seen.view.cast<double>();
    const float range = sensing::range_of_class(seen.range_class);
    const Eigen::Vector3d to_sensor = seen.position.cast<double>() + range * view - place;
    const Eigen::Vector3d sight = to_sensor.normalized();
    const double farthest = to_sensor.norm() / class_spread;  // not beyond the sensor
    for (double t = d_; t < farthest; t += 0.7 * d_) {
      const std::optional<occupancy::VoxelPoint> found = at(place + t * sight).point;
      if (found && found->surface != surface_.id && off_plane(*found) > tolerance + d_)
        return EdgeKind::occluded;
    }
    const double away = -outward.dot(view), longest = range * class_spread, shortest = range / class_spread;
    const double min_range = state_.parameters.occupancy.min_range;
    if (away > 0 && longest >= max_range_ && free_in_front(place, sight, tolerance))
      return EdgeKind::sensor_limit;
    if (away < 0 && min_range > 0 && shortest <= min_range + h_) return EdgeKind::sensor_limit;
    return EdgeKind::frontier;
  }

  bool free_in_front(const Eigen::Vector3d& place, const Eigen::Vector3d& sight, double tolerance) const {
    constexpr int steps = 9;
    const double first = (tolerance + d_) / std::max(0.1, normal_.dot(sight));
    int freed = 0;
    for (int k = 0; k < steps; ++k) freed += is_free(place + (first + 1.5 * k * d_) * sight);
    return 2 * freed > steps;
  }

  EdgeKind vote(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                const std::optional<occupancy::VoxelPoint>& seen_from,
                const std::optional<occupancy::VoxelPoint>& seen_to) const {
    const Eigen::Vector2d along = to - from;
    // Rings run with the surface on their left.
    const Eigen::Vector3d outward =
        surface_.T_map_surface.linear() * Eigen::Vector3d(along.y(), -along.x(), 0).normalized();
    const int samples = std::max(2, static_cast<int>(std::ceil(along.norm() / d_)));
    Votes votes{};
    for (int k = 0; k < samples; ++k) {
      const double share = (k + 0.5) / samples;
      const std::optional<occupancy::VoxelPoint>& nearer = share < 0.5 ? seen_from : seen_to;
      cast_votes(surface_.to_map(from + share * along), outward,
                 nearer      ? nearer
                 : seen_from ? seen_from
                             : seen_to,
                 votes);
    }
    return static_cast<EdgeKind>(std::max_element(votes.begin(), votes.end()) - votes.begin());
  }

  /// Samples the edge at one point; adds two votes.
  void cast_votes(const Eigen::Vector3d& base, const Eigen::Vector3d& outward,
                  const std::optional<occupancy::VoxelPoint>& seen, Votes& votes) const {
    const double tolerance = model_.reach(seen ? seen->range_class : 1, 1);
    const Eigen::Vector3d view = seen ? Eigen::Vector3d(seen->view.cast<double>()) : normal_;
    const auto give = [&](EdgeKind kind, int count) { votes[static_cast<std::size_t>(kind)] += count; };
    for (int k = 0; k * d_ / 2 <= h_ + 1e-9; ++k) {  // a wall may be in the boundary's own voxels
      const Eigen::Vector3d place = base + k * d_ / 2 * outward;
      if (obstacle_at(place, tolerance) || (k >= 2 && open_at(place, view, tolerance)))
        return give(EdgeKind::real, 2);
    }
    for (const double x : {h_ / 2, h_})
      give(seen ? unknown_because(base + x * outward, *seen, outward, tolerance) : EdgeKind::frontier, 1);
  }

  const surfaces::MapState& state_;
  const Surface& surface_;
  sensing::ReadingModel model_;
  double d_, h_;
  Eigen::Vector3d normal_;
  double reach_off_plane_ = 0, max_range_ = 0;
};

}  // namespace

std::vector<PolygonEdges> label_edges(const Map& map, const Surface& surface) {
  const EdgeLabeller labeller(surfaces::state_of(map), surface);
  std::vector<PolygonEdges> edges;
  for (const Polygon& polygon : surface.polygons) {
    edges.push_back({labeller.label(polygon.outer), {}});
    for (const Ring2& hole : polygon.holes) edges.back().holes.push_back(labeller.label(hole));
  }
  return edges;
}

}  // namespace octosurf
