#include "io/export_formats.hpp"
#include "io/new_file.hpp"

#include <array>
#include <cmath>
#include <exception>
#include <functional>
#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

std::array<std::uint8_t, 3> bytes(const std::array<float, 3>& color) {
  std::array<std::uint8_t, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) result[i] = static_cast<std::uint8_t>(std::lround(255 * color[i]));
  return result;
}

// PCL rather than assimp: PCL and most others do not read the faces of assimp's PLY files.
bool save_faces(const std::vector<Shape>& shapes, const std::string& file) {
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  pcl::PolygonMesh mesh;
  for (const Shape& shape : shapes) {
    const auto first = static_cast<pcl::index_t>(cloud.size());
    const auto [red, green, blue] = bytes(shape.color);
    for (const Eigen::Vector3d& vertex : shape.mesh.vertices) {
      const Eigen::Vector3f p = vertex.cast<float>();
      cloud.push_back({p.x(), p.y(), p.z(), red, green, blue});
    }
    for (const auto& t : shape.mesh.triangles) {
      pcl::Vertices face;
      for (const std::uint32_t corner : t) face.vertices.push_back(first + static_cast<pcl::index_t>(corner));
      mesh.polygons.push_back(std::move(face));
    }
  }
  pcl::toPCLPointCloud2(cloud, mesh.cloud);
  return pcl::io::savePLYFileBinary(file, mesh) == 0;
}

bool save_points(const std::vector<Shape>& shapes, const std::string& file) {
  pcl::PointCloud<pcl::PointXYZRGBL> cloud;
  for (const Shape& shape : shapes) {
    const auto [red, green, blue] = bytes(shape.color);
    for (const Eigen::Vector3d& point : shape.mesh.vertices) {
      const Eigen::Vector3f p = point.cast<float>();
      cloud.push_back({p.x(), p.y(), p.z(), red, green, blue, shape.id});
    }
  }
  return pcl::io::savePLYFileBinary(file, cloud) == 0;
}

}  // namespace

void write_ply(const ExportJob& job, const std::filesystem::path& file) {
  NewFile output(file, job.options.force);
  const ExportPart part = job.options.parts.front();
  const std::vector<Shape> shapes = make_shapes(job, part);
  if (shapes.empty()) throw nothing_to_write(file);
  output.write([](std::ostream&) {});  // PCL would not say why it cannot
  bool written = false;
  try {
    const std::string name = output.temporary().string();
    written = part == ExportPart::points ? save_points(shapes, name) : save_faces(shapes, name);
  } catch (const std::exception&) {  // PCL's own types
    written = false;
  }
  if (!written) {
    throw Error(Error::Kind::output, file.string(), "cannot be written", "check the space left on the disk");
  }
  output.commit();
}

}  // namespace octosurf
