#include "io/exporters/export_formats.hpp"

#include <array>
#include <charconv>
#include <string>

namespace octosurf::io {
namespace {

// Shortest text that reads back as the same number, in any locale.
template <typename Number>
std::string text(Number value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string text(const Eigen::Vector3d& point, SurfaceId id) {
  const Eigen::Vector3d p = tidy(point, id);
  return text(p.x()).append(",").append(text(p.y())).append(",").append(text(p.z()));
}

void write_surfaces(const ExportJob& job, std::ostream& out) {
  out << "id,red,green,blue,nx,ny,nz,offset,area_m2,inliers,rms_m,revision,parents,polygons,holes\n";
  for (const SurfacePtr& pointer : job.snapshot.surfaces) {
    const Surface& s = *pointer;
    const Eigen::Vector3d& n = s.plane.normal;
    std::string parents;
    for (const SurfaceId parent : s.parents) parents.append(parents.empty() ? "" : " ").append(text(parent));
    std::size_t holes = 0;
    for (const Polygon& polygon : s.polygons) holes += polygon.holes.size();
    out << s.id;
    for (const float c : s.color) out << ',' << text(c);
    for (const double x : {n.x(), n.y(), n.z(), s.plane.offset, s.area_m2})
      out << ',' << text(finite(x, s.id));
    out << ',' << s.inliers << ',' << text(finite(s.rms_m, s.id)) << ',' << s.revision << ',' << parents
        << ',' << s.polygons.size() << ',' << holes << '\n';
  }
}

}  // namespace

void write_csv(const ExportJob& job, std::ostream& out) {
  if (job.wants(ExportPart::polygons)) return write_surfaces(job, out);
  const bool circles = job.wants(ExportPart::circles);
  out << (circles ? "surface,x,y,z,radius\n" : "surface,x,y,z\n");
  for (const SurfacePtr& surface : job.snapshot.surfaces) {
    const SurfaceId id = surface->id;
    if (circles) {
      for (const Circle& circle : job.circles(id)) {
        out << id << ',' << text(circle.center, id) << ',' << text(finite(circle.radius, id)) << '\n';
      }
    } else {
      for (const Eigen::Vector3d& point : job.points_of(id)) out << id << ',' << text(point, id) << '\n';
    }
  }
}

}  // namespace octosurf::io
