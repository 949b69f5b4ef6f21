#include "messages.hpp"

#include "io/exporters/grid_map_message.hpp"

#include <array>
#include <vector>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/planning.hpp>

namespace octosurf::dds {
namespace {

void write_pose(io::MessageWriter& out, const Eigen::Isometry3d& pose) {
  io::write_pose(out, pose.translation(), Eigen::Quaterniond(pose.linear()));
}

/// std_msgs/ColorRGBA.
void write_color(io::MessageWriter& out, const std::array<float, 3>& rgb, float alpha) {
  out.begin_message();
  out.field("r", rgb[0]);
  out.field("g", rgb[1]);
  out.field("b", rgb[2]);
  out.field("a", alpha);
  out.end_message();
}

/// octosurf_msgs/Ring.
void write_ring(io::MessageWriter& out, const std::vector<Eigen::Vector3d>& points) {
  out.begin_message();
  out.field("points");
  out.begin_list(points.size());
  for (const Eigen::Vector3d& point : points) io::write_point(out, point);
  out.end_list();
  out.end_message();
}

void write_ring(io::MessageWriter& out, const Ring2& ring, const Surface& surface) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(ring.size());
  for (const Eigen::Vector2d& uv : ring) points.push_back(surface.to_map(uv));
  write_ring(out, points);
}

/// octosurf_msgs/Polygon[].
void write_polygons(io::MessageWriter& out, const std::vector<Polygon>& polygons, const Surface& surface) {
  out.begin_list(polygons.size());
  for (const Polygon& polygon : polygons) {
    out.begin_message();
    out.field("outer");
    write_ring(out, polygon.outer, surface);
    out.field("holes");
    out.begin_list(polygon.holes.size());
    for (const Ring2& hole : polygon.holes) write_ring(out, hole, surface);
    out.end_list();
    out.end_message();
  }
  out.end_list();
}

/// octosurf_msgs/Surface.
void write_surface(io::MessageWriter& out, const Surface& surface) {
  out.begin_message();
  out.field("id", surface.id);
  out.field("color");
  write_color(out, surface.color, 1);
  out.field("normal");
  io::write_point(out, surface.plane.normal);
  out.field("offset", surface.plane.offset);
  out.field("pose");
  write_pose(out, surface.T_map_surface);
  out.field("polygons");
  write_polygons(out, surface.polygons, surface);
  out.field("area", surface.area_m2);
  out.field("inliers", static_cast<std::uint32_t>(surface.inliers));
  out.field("rms", surface.rms_m);
  out.field("covariance");  // of fixed length: without a length before it
  for (int i = 0; i < 9; ++i) out.write(surface.covariance(i / 3, i % 3));
  out.field("born", surface.born);
  out.field("revision", surface.revision);
  out.field("parents");
  out.begin_list(surface.parents.size());
  for (const SurfaceId parent : surface.parents) out.write(parent);
  out.end_list();
  out.end_message();
}

/// octosurf_msgs/Cylinder.
void write_cylinder(io::MessageWriter& out, const Cylinder& cylinder) {
  out.begin_message();
  out.field("id", cylinder.id);
  out.field("axis_point");
  io::write_point(out, cylinder.axis_point);
  out.field("axis");
  io::write_point(out, cylinder.axis);
  out.field("radius", cylinder.radius_m);
  out.field("length", cylinder.length_m);
  out.field("start");
  io::write_point(out, cylinder.start);
  out.field("span", cylinder.span_rad);
  out.field("inliers", static_cast<std::uint32_t>(cylinder.inliers));
  out.field("rms", cylinder.rms_m);
  out.field("born", cylinder.born);
  out.field("revision", cylinder.revision);
  out.end_message();
}

/// visualization_msgs/Marker, of which only this differs.
struct Marker {
  std::int32_t id = 0, type = 0, action = 0;
  std::array<float, 3> color{};
  std::vector<Eigen::Vector3d> points;
};

void write_marker(io::MessageWriter& out, const Marker& marker, const std::string& frame) {
  out.begin_message();
  out.field("header");
  io::write_header(out, frame);
  out.field("ns", std::string("surfaces"));
  out.field("id", marker.id);
  out.field("type", marker.type);
  out.field("action", marker.action);
  out.field("pose");
  write_pose(out, Eigen::Isometry3d::Identity());
  out.field("scale");
  io::write_point(out, Eigen::Vector3d::Ones());
  out.field("color");
  write_color(out, marker.color, 0.9F);
  out.field("lifetime");
  out.begin_message();
  out.field("sec", std::int32_t{0});
  out.field("nanosec", std::uint32_t{0});
  out.end_message();
  out.field("frame_locked", false);
  out.field("points");
  out.begin_list(marker.points.size());
  for (const Eigen::Vector3d& point : marker.points) io::write_point(out, point);
  out.end_list();
  out.field("colors");
  out.begin_list(0);
  out.end_list();
  out.field("texture_resource", std::string());
  out.field("texture");
  out.begin_message();
  out.field("header");
  io::write_header(out, "");
  out.field("format", std::string());
  out.field("data", std::span<const std::int8_t>());
  out.end_message();
  out.field("uv_coordinates");
  out.begin_list(0);
  out.end_list();
  out.field("text", std::string());
  out.field("mesh_resource", std::string());
  out.field("mesh_file");
  out.begin_message();
  out.field("filename", std::string());
  out.field("data", std::span<const std::int8_t>());
  out.end_message();
  out.field("mesh_use_embedded_materials", false);
  out.end_message();
}

Marker marker_of(const Surface& surface) {
  constexpr std::int32_t triangle_list = 11;
  Marker marker{static_cast<std::int32_t>(surface.id), triangle_list, 0, surface.color, {}};
  for (const ConvexPiece& piece : convex_pieces(surface))
    for (std::size_t i = 2; i < piece.vertices.size(); ++i)
      marker.points.insert(marker.points.end(),
                           {piece.vertices[0], piece.vertices[i - 1], piece.vertices[i]});
  return marker;
}

}  // namespace

void write_surfaces(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame,
                    std::int64_t stamp_ns) {
  out.begin_message();
  out.field("header");
  io::write_header(out, frame, stamp_ns);
  out.field("revision", snapshot.revision);
  out.field("resolution", snapshot.resolution);
  out.field("surfaces");
  out.begin_list(snapshot.surfaces.size());
  for (const SurfacePtr& surface : snapshot.surfaces) write_surface(out, *surface);
  out.end_list();
  out.field("cylinders");
  out.begin_list(snapshot.cylinders.size());
  for (const CylinderPtr& cylinder : snapshot.cylinders) write_cylinder(out, *cylinder);
  out.end_list();
  out.end_message();
}

void write_region(io::MessageWriter& out, const services::FoundRegion& found) {
  const ContactRegion& region = found.region;
  out.begin_message();
  out.field("surface", region.surface);
  out.field("revision", region.revision);
  out.field("area", region.area_m2);
  out.field("polygons");
  write_polygons(out, region.polygons, *found.surface);
  out.field("pieces");
  out.begin_list(found.pieces.size());
  for (const ConvexPiece& piece : found.pieces) write_ring(out, piece.vertices);
  out.end_list();
  out.field("refused");
  out.begin_list(region.refused.size());
  for (const ContactRefusal refusal : region.refused) out.write(std::string(contact_refusal_name(refusal)));
  out.end_list();
  out.end_message();
}

void write_footstep(io::MessageWriter& out, const Footstep& step) {
  out.begin_message();
  out.field("foot", std::string(foot_name(step.foot)));
  out.field("surface", step.surface);
  out.field("pose");
  write_pose(out, step.T_map_foot);
  out.field("yaw", step.yaw_rad);
  out.field("margin", step.margin_m);
  out.end_message();
}

void write_markers(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame) {
  constexpr std::int32_t delete_all = 3;
  out.begin_message();
  out.field("markers");
  out.begin_list(snapshot.surfaces.size() + 1);
  write_marker(out, {0, 0, delete_all, {}, {}}, frame);
  for (const SurfacePtr& surface : snapshot.surfaces) write_marker(out, marker_of(*surface), frame);
  out.end_list();
  out.end_message();
}

void write_octomap(io::MessageWriter& out, const octomap::OcTree& tree, const std::string& frame) {
  const std::string bytes = octomap_message_data(tree);
  out.begin_message();
  out.field("header");
  io::write_header(out, frame);
  out.field("binary", true);
  out.field("id", tree.getTreeType());
  out.field("resolution", tree.getResolution());
  out.field("data", std::span(reinterpret_cast<const std::int8_t*>(bytes.data()), bytes.size()));
  out.end_message();
}

}  // namespace octosurf::dds
