// What lies beyond a surface's edges, on scenes and cameras for which that can be worked out.
#include "support/checked_mapper.hpp"
#include "support/scene.hpp"

#include <unistd.h>

#include <octosurf/boundary.hpp>

namespace octosurf::diagnosis {
namespace {

using test::Camera;
using test::camera_scan;
using test::look_at;
using test::mapped;
using test::Scene;

const Camera fine{480, 360, 400, 0.002};
const double h = Parameters{}.max_hole_size();

/// An edge as a test judges it, map frame: its middle, the way out, and what it was called.
struct Edge {
  Eigen::Vector3d middle, outward;
  EdgeKind kind;
  bool of_hole;
};

std::vector<Edge> edges_of(const Map& map, const Surface& surface) {
  std::vector<Edge> edges;
  const std::vector<PolygonEdges> labels = label_edges(map, surface);
  EXPECT_EQ(labels.size(), surface.polygons.size());
  const auto add = [&](const Ring2& ring, const std::vector<EdgeKind>& kinds, bool of_hole) {
    ASSERT_EQ(kinds.size(), ring.size());
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Eigen::Vector3d a = surface.to_map(ring[k]), b = surface.to_map(ring[(k + 1) % ring.size()]);
      edges.push_back({(a + b) / 2, (b - a).cross(surface.plane.normal).normalized(), kinds[k], of_hole});
    }
  };
  for (std::size_t p = 0; p < labels.size(); ++p) {
    add(surface.polygons[p].outer, labels[p].outer, false);
    EXPECT_EQ(labels[p].holes.size(), surface.polygons[p].holes.size());
    for (std::size_t k = 0; k < labels[p].holes.size(); ++k)
      add(surface.polygons[p].holes[k], labels[p].holes[k], true);
  }
  return edges;
}

/// The surface with this normal at this place; far from a sensor, where its rows are more than h apart, there
/// may be others beside it, and it is the largest.
const Surface& surface_at(const Snapshot& snapshot, const Eigen::Vector3d& normal,
                          const Eigen::Vector3d& place) {
  const Surface* found = nullptr;
  for (const SurfacePtr& s : snapshot.surfaces)
    if (s->plane.normal.dot(normal) > 0.99 && std::fabs(s->plane.signed_distance(place)) < 0.02 &&
        (found == nullptr || found->area_m2 < s->area_m2))
      found = s.get();
  if (found == nullptr) throw std::runtime_error("the surface is missing");
  return *found;
}

/// The share of edges that are called as expected, of those for which something is expected.
double agreement(const std::vector<Edge>& edges,
                 const std::function<std::optional<EdgeKind>(const Edge&)>& expected, std::size_t at_least) {
  std::size_t judged = 0, right = 0;
  for (const Edge& edge : edges) {
    const std::optional<EdgeKind> truth = expected(edge);
    if (!truth) continue;
    ++judged;
    right += *truth == edge.kind;
  }
  EXPECT_GE(judged, at_least);
  return static_cast<double>(right) / static_cast<double>(std::max<std::size_t>(judged, 1));
}

/// How far inside the image a point is, in pixels; negative outside.
double inside_image(const Eigen::Isometry3d& T_map_camera, const Camera& camera,
                    const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = T_map_camera.inverse() * point;
  if (p.z() <= 0) return -1e9;
  const double u = std::fabs(p.x() / p.z() * camera.focal), v = std::fabs(p.y() / p.z() * camera.focal);
  return std::min(camera.width / 2.0 - u, camera.height / 2.0 - v);
}

/// A floor without end, seen by a camera 1.2 m above it whose image reaches beyond the range.
struct FarFloor {
  Scene scene = Scene().rectangle({-15, -15, 0.01}, {30, 0, 0}, {0, 30, 0});
  Eigen::Vector3d eye{0, 0, 1.2};
  Eigen::Isometry3d pose = look_at(eye, {2.6, 0, 0});

  Scan scan() const {
    std::mt19937_64 rng = test::rng();
    return camera_scan(scene, pose, rng, fine);
  }
  std::vector<Edge> edges(const Mapper& mapper) const {
    return edges_of(mapper.map(), surface_at(*mapper.snapshot(), {0, 0, 1}, {2, 0, 0.01}));
  }
  std::optional<EdgeKind> expected(const Edge& edge, double max_range) const {
    const Eigen::Vector3d beyond = edge.middle + h * edge.outward;
    const double margin = inside_image(pose, fine, beyond);
    if (margin < 0) return EdgeKind::frontier;
    // Beyond the corners of what was seen, both hold.
    if (margin < 10 || (beyond - eye).norm() < max_range) return {};
    return EdgeKind::sensor_limit;
  }
};

TEST(Boundary, AFloorEndsWhereTheSensorsRangeDoes) {
  const FarFloor floor;
  for (const std::optional<double> max_range : {std::optional<double>(), std::optional<double>(2.5)}) {
    Parameters parameters;
    parameters.occupancy.max_range = max_range;
    const std::vector<Edge> edges = floor.edges(mapped({floor.scan()}, parameters));
    const double limit = max_range.value_or(4);
    EXPECT_GE(agreement(
                  edges, [&](const Edge& e) { return floor.expected(e, limit); }, 100),
              0.95);
    EXPECT_GT(std::count_if(edges.begin(), edges.end(),
                            [](const Edge& e) { return e.kind == EdgeKind::sensor_limit; }),
              30);
  }
}

TEST(Boundary, ALidarHasNoLimitOfACameras) {
  const FarFloor floor;
  Scan scan = floor.scan();
  scan.sensor = SensorKind::lidar;
  for (const Edge& edge : floor.edges(mapped({scan})))
    EXPECT_NE(edge.kind, EdgeKind::sensor_limit) << edge.middle.transpose();
}

TEST(Boundary, WhatIsTooNearIsTheSensorsLimit) {
  Scene scene;
  scene.rectangle({-4, -4, 0.01}, {8, 0, 0}, {0, 8, 0});
  Parameters parameters;
  parameters.occupancy.min_range = 1.3;
  std::mt19937_64 rng = test::rng();
  const Eigen::Isometry3d pose = look_at({0, 0, 1.2}, {0, 0, 0});
  const Mapper mapper = mapped({camera_scan(scene, pose, rng, {480, 480, 200, 0.002})}, parameters);
  const auto snapshot = mapper.snapshot();
  const double radius = std::sqrt(1.3 * 1.3 - 1.19 * 1.19);
  const auto expected = [&](const Edge& edge) -> std::optional<EdgeKind> {
    return edge.middle.head<2>().norm() < radius + 0.1 ? EdgeKind::sensor_limit : EdgeKind::frontier;
  };
  const std::vector<Edge> edges = edges_of(mapper.map(), surface_at(*snapshot, {0, 0, 1}, {1, 0, 0.01}));
  EXPECT_GE(agreement(edges, expected, 150), 0.97);
  EXPECT_GT(std::count_if(edges.begin(), edges.end(), [](const Edge& e) { return e.of_hole; }), 20);
}

/// A room of rectangles with boxes on its floor, looked at by cameras: a slow oracle of what they can know.
struct Room {
  Scene scene;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> boxes;  // low, high
  std::vector<Eigen::Isometry3d> poses;
  Camera camera = fine;

  Room(std::mt19937_64& rng, int cameras) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    scene.box({-4.1, -2.2, 0.013}, {4.1, 2.2, 2.5});
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d low(1.6 * uniform(rng) - 0.2, 1.3 * uniform(rng) - 0.2, 0.013);
      boxes.emplace_back(low, low + Eigen::Vector3d(0.5 + 0.15 * uniform(rng), 0.5 + 0.15 * uniform(rng),
                                                    0.4 + 0.2 * uniform(rng)));
      scene.box(boxes.back().first, boxes.back().second);
    }
    for (int i = 0; i < cameras; ++i) {
      const double a = std::numbers::pi * uniform(rng);
      Eigen::Vector3d eye(0.6 * uniform(rng), 0.6 * uniform(rng), 1.5 + 0.2 * uniform(rng));
      poses.push_back(look_at(eye, eye + Eigen::Vector3d(std::cos(a), std::sin(a), -0.7)));
    }
  }

  bool in_a_box(const Eigen::Vector3d& p) const {
    return std::any_of(boxes.begin(), boxes.end(), [&](const auto& box) {
      return ((p - box.first).array() > -0.005).all() && ((box.second - p).array() > -0.005).all();
    });
  }
  /// Of the rectangle that the surface lies on.
  bool on_face(const Surface& surface, const Eigen::Vector3d& place, const Eigen::Vector3d& inside) const {
    const auto holds = [&](const test::Rectangle& r, const Eigen::Vector3d& p) {
      const Eigen::Vector3d at = p - r.corner;
      const double a = at.dot(r.edge_u) / r.edge_u.squaredNorm(),
                   b = at.dot(r.edge_v) / r.edge_v.squaredNorm();
      return a >= -0.001 && a <= 1.001 && b >= -0.001 && b <= 1.001;
    };
    for (const test::Rectangle& r : scene.rectangles) {
      const Eigen::Vector3d n = r.edge_u.cross(r.edge_v).normalized();
      if (std::fabs(n.dot(surface.plane.normal)) < 0.999 || std::fabs(n.dot(inside - r.corner)) > 0.02)
        continue;
      if (holds(r, inside)) return holds(r, place);
    }
    return false;
  }
  bool visible(std::size_t k, const Eigen::Vector3d& p, double margin) const {
    if (inside_image(poses[k], camera, p) < margin) return false;
    const Eigen::Vector3d sight = p - poses[k].translation();
    const auto met = scene.cast(poses[k].translation(), sight.normalized());
    return sight.norm() < 3.9 && (!met || *met > sight.norm() - 0.03);
  }

  /// Nothing where the answer is a matter of voxels, or of which camera is asked.
  std::optional<EdgeKind> expected(const Surface& surface, const Edge& edge) const {
    const Eigen::Vector3d inside = edge.middle - 0.04 * edge.outward;
    const auto goes_on = [&](double x) {
      const Eigen::Vector3d place = edge.middle + x * edge.outward;
      return on_face(surface, place, inside) && !in_a_box(place + 0.02 * surface.plane.normal);
    };
    if (!goes_on(0.04)) {  // known if somebody looks there with room to spare, and faces what stands there
      const Eigen::Vector3d seen = edge.middle + 0.02 * surface.plane.normal - 0.02 * edge.outward;
      const auto met = scene.cast(inside + 0.03 * surface.plane.normal, edge.outward);
      const bool obstacle = met && *met < 0.1;
      for (std::size_t k = 0; k < poses.size(); ++k) {
        const bool faced = (seen - poses[k].translation()).normalized().dot(edge.outward) > 0.15;
        if (visible(k, seen, 25) && (faced || !obstacle)) return EdgeKind::real;
      }
      return {};
    }
    if (!goes_on(h + 0.04)) return {};
    std::optional<EdgeKind> answer;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Eigen::Vector3d place = edge.middle + h * edge.outward, eye = poses[k].translation();
      const Eigen::Vector3d sight = place - eye;
      const double margin = inside_image(poses[k], camera, place);
      EdgeKind kind = EdgeKind::frontier;
      if (margin >= 0 && margin < 15) return {};
      if (margin >= 0) {
        const auto met = scene.cast(eye, sight.normalized());
        if (met && *met < sight.norm() - 0.05)
          kind = EdgeKind::occluded;
        else if (sight.norm() > 4)
          kind = EdgeKind::sensor_limit;
        else
          return {};
      }
      if (answer && *answer != kind) return {};
      answer = kind;
    }
    return answer;
  }
};

TEST(Boundary, AgreesWithWhatTheCamerasCouldSee) {
  std::mt19937_64 rng = test::rng();
  struct Count {
    std::size_t judged = 0, right = 0;
  };
  std::map<EdgeKind, Count> kinds;
  for (int round = 0; round < 6; ++round) {
    const Room room(rng, 1 + round % 2);
    std::vector<Scan> scans;
    for (const Eigen::Isometry3d& pose : room.poses)
      scans.push_back(camera_scan(room.scene, pose, rng, room.camera));
    const Mapper mapper = mapped(scans);
    const auto snapshot = mapper.snapshot();
    for (const SurfacePtr& surface : snapshot->surfaces)
      for (const Edge& edge : edges_of(mapper.map(), *surface)) {
        const std::optional<EdgeKind> truth = room.expected(*surface, edge);
        if (!truth) continue;
        ++kinds[*truth].judged;
        kinds[*truth].right += *truth == edge.kind;
      }
  }
  EXPECT_EQ(kinds.size(), edge_kind_names.size());
  for (const auto& [kind, count] : kinds) {
    SCOPED_TRACE(edge_kind_names[static_cast<std::size_t>(kind)]);
    EXPECT_GE(count.judged, 20U);
    EXPECT_GE(static_cast<double>(count.right), 0.95 * static_cast<double>(count.judged)) << count.right;
  }
}

/// All labels of all surfaces, in order.
std::vector<EdgeKind> labels_of(const Map& map) {
  std::vector<EdgeKind> all;
  const auto snapshot = map.snapshot();
  for (const SurfacePtr& surface : snapshot->surfaces)
    for (const Edge& edge : edges_of(map, *surface)) {
      EXPECT_LT(static_cast<std::size_t>(edge.kind), edge_kind_names.size());
      all.push_back(edge.kind);
    }
  return all;
}

TEST(Boundary, LabelsDependNeitherOnThreadsNorOnSaving) {
  std::mt19937_64 rng = test::rng();
  const Room room(rng, 3);
  std::vector<Scan> scans;
  for (const Eigen::Isometry3d& pose : room.poses)
    scans.push_back(camera_scan(room.scene, pose, rng, room.camera));
  const Mapper one = mapped(scans), three = mapped(scans, {}, 3);
  const std::vector<EdgeKind> labels = labels_of(one.map());
  EXPECT_GT(labels.size(), 200U);
  EXPECT_EQ(labels_of(three.map()), labels);
  const auto stem =
      std::filesystem::temp_directory_path() / ("octosurf_boundary_" + std::to_string(::getpid()));
  save_map(one.map(), stem);
  EXPECT_EQ(labels_of(load_map(stem).map), labels);
  for (const char* ending : {".surfaces", ".bt"}) std::filesystem::remove(stem.string() + ending);
}

TEST(Boundary, AnEdgeOfAMapThatForgotItIsAFrontier) {
  const FarFloor floor;
  const Mapper mapper = mapped({floor.scan()});
  const Map empty;
  const auto snapshot = mapper.snapshot();
  for (const Edge& edge : edges_of(empty, surface_at(*snapshot, {0, 0, 1}, {2, 0, 0.01})))
    EXPECT_EQ(edge.kind, EdgeKind::frontier);
}

}  // namespace
}  // namespace octosurf::diagnosis
