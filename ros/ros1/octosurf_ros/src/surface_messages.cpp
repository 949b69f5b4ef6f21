#include "surface_messages.hpp"

#include <algorithm>

#include <octosurf/planning.hpp>

namespace octosurf::ros1 {
namespace {

constexpr double line_width = 0.01;  // m, of outlines in viewers

std_msgs::ColorRGBA color_message(const std::array<float, 3>& color, float alpha) {
  std_msgs::ColorRGBA message;
  message.r = color[0];
  message.g = color[1];
  message.b = color[2];
  message.a = alpha;
  return message;
}

octosurf_msgs::Ring ring_message(const Ring2& ring, const Surface& surface) {
  octosurf_msgs::Ring message;
  message.points.reserve(ring.size());
  for (const Eigen::Vector2d& uv : ring) message.points.push_back(point_message(surface.to_map(uv)));
  return message;
}

octosurf_msgs::Surface surface_message(const Surface& surface) {
  octosurf_msgs::Surface message;
  message.id = surface.id;
  message.color = color_message(surface.color, 1);
  message.normal = vector_message(surface.plane.normal);
  message.offset = surface.plane.offset;
  message.pose = pose_message(surface.T_map_surface);
  for (const Polygon& polygon : surface.polygons)
    message.polygons.push_back(polygon_message(polygon, surface));
  message.area = surface.area_m2;
  message.inliers = static_cast<std::uint32_t>(surface.inliers);
  message.rms = surface.rms_m;
  for (Eigen::Index row = 0; row < 3; ++row)
    for (Eigen::Index column = 0; column < 3; ++column)
      message.covariance[static_cast<std::size_t>(3 * row + column)] = surface.covariance(row, column);
  message.born = surface.born;
  message.revision = surface.revision;
  message.parents = surface.parents;
  return message;
}

octosurf_msgs::Cylinder cylinder_message(const Cylinder& cylinder) {
  octosurf_msgs::Cylinder message;
  message.id = cylinder.id;
  message.axis_point = point_message(cylinder.axis_point);
  message.axis = vector_message(cylinder.axis);
  message.radius = cylinder.radius_m;
  message.length = cylinder.length_m;
  message.start = vector_message(cylinder.start);
  message.span = cylinder.span_rad;
  message.inliers = static_cast<std::uint32_t>(cylinder.inliers);
  message.rms = cylinder.rms_m;
  message.born = cylinder.born;
  message.revision = cylinder.revision;
  return message;
}

visualization_msgs::Marker marker(const Surface& surface, const std_msgs::Header& header, const char* space,
                                  int type) {
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = space;
  marker.id = static_cast<int>(surface.id);
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1;
  return marker;
}

visualization_msgs::Marker area_marker(const Surface& surface, const std::vector<ConvexPiece>& pieces,
                                       const std_msgs::Header& header) {
  auto area = marker(surface, header, "surfaces", visualization_msgs::Marker::TRIANGLE_LIST);
  area.scale.x = area.scale.y = area.scale.z = 1;
  area.color = color_message(surface.color, 0.8F);
  for (const ConvexPiece& piece : pieces)
    for (std::size_t i = 2; i < piece.vertices.size(); ++i)
      for (const std::size_t corner : {std::size_t{0}, i - 1, i})
        area.points.push_back(point_message(piece.vertices[corner]));
  return area;
}

void add_lines(const Ring2& ring, const Surface& surface, visualization_msgs::Marker& lines) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    lines.points.push_back(point_message(surface.to_map(ring[i])));
    lines.points.push_back(point_message(surface.to_map(ring[(i + 1) % ring.size()])));
  }
}

visualization_msgs::Marker outline_marker(const Surface& surface, const std_msgs::Header& header) {
  auto lines = marker(surface, header, "outlines", visualization_msgs::Marker::LINE_LIST);
  lines.scale.x = line_width;
  lines.color = color_message(surface.color, 1);
  for (const Polygon& polygon : surface.polygons) {
    add_lines(polygon.outer, surface, lines);
    for (const Ring2& hole : polygon.holes) add_lines(hole, surface, lines);
  }
  return lines;
}

}  // namespace

geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond rotation(pose.linear());
  geometry_msgs::Pose message;
  message.position = point_message(pose.translation());
  message.orientation.x = rotation.x();
  message.orientation.y = rotation.y();
  message.orientation.z = rotation.z();
  message.orientation.w = rotation.w();
  return message;
}

octosurf_msgs::Ring ring_message(const std::vector<Eigen::Vector3d>& points) {
  octosurf_msgs::Ring message;
  std::transform(points.begin(), points.end(), std::back_inserter(message.points), point_message);
  return message;
}

octosurf_msgs::Polygon polygon_message(const Polygon& polygon, const Surface& surface) {
  octosurf_msgs::Polygon message;
  message.outer = ring_message(polygon.outer, surface);
  for (const Ring2& hole : polygon.holes) message.holes.push_back(ring_message(hole, surface));
  return message;
}

octosurf_msgs::Surfaces surfaces_message(const Snapshot& snapshot, const std_msgs::Header& header) {
  octosurf_msgs::Surfaces message;
  message.header = header;
  message.revision = snapshot.revision;
  message.resolution = snapshot.resolution;
  for (const SurfacePtr& surface : snapshot.surfaces) message.surfaces.push_back(surface_message(*surface));
  for (const CylinderPtr& cylinder : snapshot.cylinders)
    message.cylinders.push_back(cylinder_message(*cylinder));
  return message;
}

void PieceCache::update(const Snapshot& snapshot) {
  std::erase_if(pieces_, [&](const auto& entry) { return snapshot.find(entry.first) == nullptr; });
  for (const SurfacePtr& surface : snapshot.surfaces) {
    Entry& entry = pieces_[surface->id];
    if (entry.surface != surface) entry = {surface, convex_pieces(*surface)};
  }
}

visualization_msgs::MarkerArray markers_message(const Snapshot& snapshot, const PieceCache& pieces,
                                                const std_msgs::Header& header) {
  visualization_msgs::MarkerArray message;
  visualization_msgs::Marker clear;
  clear.header = header;
  clear.action = visualization_msgs::Marker::DELETEALL;
  message.markers.push_back(clear);
  for (const SurfacePtr& surface : snapshot.surfaces) {
    message.markers.push_back(area_marker(*surface, pieces.of(*surface), header));
    message.markers.push_back(outline_marker(*surface, header));
  }
  return message;
}

jsk_recognition_msgs::PolygonArray polygons_message(const Snapshot& snapshot, const PieceCache& pieces,
                                                    const std_msgs::Header& header) {
  jsk_recognition_msgs::PolygonArray message;
  message.header = header;
  for (const SurfacePtr& surface : snapshot.surfaces)
    for (const ConvexPiece& piece : pieces.of(*surface)) {
      geometry_msgs::PolygonStamped polygon;
      polygon.header = header;
      for (const Eigen::Vector3d& vertex : piece.vertices)
        polygon.polygon.points.push_back(xyz_message<geometry_msgs::Point32>(vertex));
      message.polygons.push_back(polygon);
      message.labels.push_back(surface->id);
      message.likelihood.push_back(1);
    }
  return message;
}

}  // namespace octosurf::ros1
