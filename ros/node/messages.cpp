#include "messages.hpp"

#include "io/exporters/export_formats.hpp"
#include "io/exporters/planner_messages.hpp"

#include <array>
#include <vector>

namespace octosurf::node {
namespace {

/// std_msgs/ColorRGBA.
auto color_of(const std::array<float, 3>& rgb, float alpha) {
  return [=](io::MessageWriter& out) { out.message("r", rgb[0], "g", rgb[1], "b", rgb[2], "a", alpha); };
}

/// octosurf_msgs/Polygon[].
auto polygons_of(const std::vector<Polygon>& polygons, const Surface& surface) {
  const auto write_vertex = [&surface](io::MessageWriter& out, const Eigen::Vector2d& uv) {
    out.write(surface.to_map(uv));
  };
  const auto write_ring = [=](io::MessageWriter& out, const Ring2& ring) {
    out.message("points", io::each(ring, write_vertex));
  };
  return io::each(polygons, [=](io::MessageWriter& out, const Polygon& polygon) {
    out.message("outer", io::one(polygon.outer, write_ring), "holes", io::each(polygon.holes, write_ring));
  });
}

/// octosurf_msgs/Surface.
void write_surface(io::MessageWriter& out, const Surface& surface) {
  const auto covariance = [&surface](io::MessageWriter& to) {  // of fixed length: without a length before it
    for (int i = 0; i < 9; ++i) to.write(surface.covariance(i / 3, i % 3));
  };
  out.message("id", surface.id, "color", color_of(surface.color, 1), "normal", surface.plane.normal, "offset",
              surface.plane.offset, "pose", surface.T_map_surface, "polygons",
              polygons_of(surface.polygons, surface), "area", surface.area_m2, "inliers",
              static_cast<std::uint32_t>(surface.inliers), "rms", surface.rms_m, "covariance", covariance,
              "born", surface.born, "revision", surface.revision, "parents", surface.parents);
}

/// octosurf_msgs/Cylinder.
void write_cylinder(io::MessageWriter& out, const Cylinder& cylinder) {
  out.message("id", cylinder.id, "axis_point", cylinder.axis_point, "axis", cylinder.axis, "radius",
              cylinder.radius_m, "length", cylinder.length_m, "start", cylinder.start, "span",
              cylinder.span_rad, "inliers", static_cast<std::uint32_t>(cylinder.inliers), "rms",
              cylinder.rms_m, "born", cylinder.born, "revision", cylinder.revision);
}

/// octosurf_msgs/Step.
void write_step(io::MessageWriter& out, const Step& step) {
  out.message("lower", step.lower, "upper", step.upper, "riser", step.riser_m, "width", step.width_m,
              "heading", step.heading_rad, "left", step.edge[0], "right", step.edge[1]);
}

/// octosurf_msgs/Stair.
void write_stair(io::MessageWriter& out, const Stair& stair) {
  out.message("id", stair.id, "kind", stair_kind_names[static_cast<std::size_t>(stair.kind)], "steps",
              io::each(stair.steps, write_step), "treads", stair.treads, "landing_below", stair.landing_below,
              "landing_above", stair.landing_above, "riser", stair.riser.mean_m, "riser_std",
              stair.riser.std_m, "tread", stair.tread.mean_m, "tread_std", stair.tread.std_m, "width",
              stair.width_m, "heading", stair.heading_rad, "turn", stair.turn_rad);
}

/// visualization_msgs/Marker, of which only this differs.
struct Marker {
  std::int32_t id = 0, type = 0, action = 0;
  std::array<float, 3> color{};
  std::vector<Eigen::Vector3d> points;
};

void write_marker(io::MessageWriter& out, const Marker& marker, const std::string& frame,
                  std::int64_t stamp_ns) {
  const auto none = [](io::MessageWriter& to) { to.begin_list(0); };
  const std::span<const std::int8_t> no_bytes;
  out.message("header", io::header(frame, stamp_ns), "ns", "surfaces", "id", marker.id, "type", marker.type,
              "action", marker.action, "pose", Eigen::Isometry3d::Identity(), "scale",
              Eigen::Vector3d(1, 1, 1), "color", color_of(marker.color, 0.9F), "lifetime",
              io::message_of("sec", std::int32_t{0}, "nanosec", std::uint32_t{0}), "frame_locked", false,
              "points", marker.points, "colors", none, "texture_resource", "", "texture",
              io::message_of("header", io::header(""), "format", "", "data", no_bytes), "uv_coordinates",
              none, "text", "", "mesh_resource", "", "mesh_file",
              io::message_of("filename", "", "data", no_bytes), "mesh_use_embedded_materials", false);
}

Marker marker_of(const Surface& surface) {
  constexpr std::int32_t triangle_list = 11;
  Marker marker{static_cast<std::int32_t>(surface.id), triangle_list, 0, surface.color, {}};
  const Mesh mesh = io::flat(surface, simplified(surface));
  for (const auto& corners : mesh.triangles)
    for (const std::uint32_t corner : corners) marker.points.push_back(mesh.vertices[corner]);
  return marker;
}

}  // namespace

void write_surfaces(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame,
                    std::int64_t stamp_ns) {
  out.message("header", io::header(frame, stamp_ns), "revision", snapshot.revision, "resolution",
              snapshot.resolution, "surfaces", io::each(snapshot.surfaces, write_surface), "cylinders",
              io::each(snapshot.cylinders, write_cylinder));
}

void write_stairs(io::MessageWriter& out, const Stairs& stairs, const Snapshot& snapshot,
                  const std::string& frame, std::int64_t stamp_ns) {
  out.message("header", io::header(frame, stamp_ns), "revision", snapshot.revision, "stairs",
              io::each(stairs.stairs, write_stair), "single_steps",
              io::each(stairs.single_steps, write_step));
}

void write_region(io::MessageWriter& out, const planning::FoundRegion& found) {
  const ContactRegion& region = found.region;
  const auto write_piece = [](io::MessageWriter& to, const ConvexPiece& piece) {
    to.message("points", piece.vertices);
  };
  const auto write_refusal = [](io::MessageWriter& to, ContactRefusal refusal) {
    to.write(contact_refusal_name(refusal));
  };
  out.message("surface", region.surface, "revision", region.revision, "area", region.area_m2, "polygons",
              polygons_of(region.polygons, *found.surface), "pieces", io::each(found.pieces, write_piece),
              "refused", io::each(region.refused, write_refusal));
}

void write_footstep(io::MessageWriter& out, const Footstep& step) {
  out.message("foot", foot_name(step.foot), "surface", step.surface, "pose", step.T_map_foot, "yaw",
              step.yaw_rad, "margin", step.margin_m);
}

void write_markers(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame,
                   std::int64_t stamp_ns) {
  constexpr std::int32_t delete_all = 3;
  out.message("markers", [&](io::MessageWriter& to) {
    to.begin_list(snapshot.surfaces.size() + 1);
    write_marker(to, {0, 0, delete_all, {}, {}}, frame, stamp_ns);
    for (const SurfacePtr& surface : snapshot.surfaces)
      write_marker(to, marker_of(*surface), frame, stamp_ns);
  });
}

void write_octomap(io::MessageWriter& out, const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                   const std::string& frame, std::int64_t stamp_ns) {
  const std::string bytes = octree.octomap_data(box);
  out.message("header", io::header(frame, stamp_ns), "binary", true, "id", "OcTree", "resolution",
              octree.resolution(), "data",
              std::span(reinterpret_cast<const std::int8_t*>(bytes.data()), bytes.size()));
}

void write_heights(io::MessageWriter& out, const std::vector<float>& heights, std::size_t rows,
                   std::size_t columns) {
  const auto dimensions = [&](io::MessageWriter& to) {
    const auto write = [&to](const char* label, std::size_t size, std::size_t stride) {
      to.message("label", label, "size", static_cast<std::uint32_t>(size), "stride",
                 static_cast<std::uint32_t>(stride));
    };
    to.begin_list(2);
    write("x", rows, rows * columns);
    write("y", columns, columns);
  };
  out.message("layout", io::message_of("dim", dimensions, "data_offset", std::uint32_t{0}), "data",
              std::span<const float>(heights));
}

}  // namespace octosurf::node
