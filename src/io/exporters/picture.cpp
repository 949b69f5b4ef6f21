#include "geometry/directions.hpp"
#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/scale_bar.hpp"
#include "io/new_file.hpp"
#include "io/png_file.hpp"
#include "io/readers/camera.hpp"

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr int oversampling = 2;  // samples per pixel and axis
constexpr std::uint32_t background = std::numeric_limits<std::uint32_t>::max();
const Eigen::Vector3d light = Eigen::Vector3d(-0.45, -0.25, 0.85).normalized();

// One polygon in the map frame, or another flat mesh.
struct DrawnPolygon {
  std::array<float, 3> color;
  Plane plane;
  Mesh mesh;
};

Plane plane_of(const Mesh& mesh) {
  if (mesh.triangles.empty()) return {};
  const auto& [a, b, c] = mesh.triangles.front();
  Plane plane;
  plane.normal =
      (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalized();
  plane.offset = plane.normal.dot(mesh.vertices[a]);
  return plane;
}

std::vector<DrawnPolygon> make_patches(const Snapshot& snapshot, const std::vector<NamedMesh>& meshes) {
  std::vector<DrawnPolygon> patches;
  std::vector<Eigen::Vector2d> vertices;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    for (const Polygon& polygon : surface->polygons) {
      DrawnPolygon patch{surface->color, surface->plane, {}};
      patch.mesh.triangles = geometry::triangulate(polygon, vertices);
      for (const Eigen::Vector2d& uv : vertices) patch.mesh.vertices.push_back(surface->to_map(uv));
      if (!patch.mesh.triangles.empty()) patches.push_back(std::move(patch));
    }
  }
  for (const NamedMesh& more : meshes) patches.push_back({more.color, plane_of(more.mesh), more.mesh});
  return patches;
}

// A point of a patch.
struct Sample {
  Eigen::Vector3d at;
  const DrawnPolygon* patch;
};

// Points spread evenly over the surfaces, so that their quantiles are quantiles of area.
std::vector<Sample> spread(const std::vector<DrawnPolygon>& patches) {
  constexpr double count = 20000;
  struct Triangle {
    std::array<Eigen::Vector3d, 3> corners;
    double area;
    const DrawnPolygon* patch;
  };
  std::vector<Triangle> triangles;
  double total = 0;
  for (const DrawnPolygon& patch : patches) {
    for (const auto& t : patch.mesh.triangles) {
      const auto& v = patch.mesh.vertices;
      const double area = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).norm() / 2;
      triangles.push_back({{v[t[0]], v[t[1]], v[t[2]]}, area, &patch});
      total += area;
    }
  }
  std::vector<Sample> points;
  double due = 0, s = 0, t = 0;
  for (const auto& [corners, area, patch] : triangles) {
    for (due += count * area / total; due >= 1; due -= 1) {
      s = std::fmod(s + 0.7548776662466927, 1);  // the R2 sequence: even and deterministic
      t = std::fmod(t + 0.5698402909980532, 1);
      const double a = 1 - std::sqrt(s), b = std::sqrt(s) * t;
      points.push_back(
          {corners[0] + (1 - a - b) * (corners[1] - corners[0]) + b * (corners[2] - corners[0]), patch});
    }
  }
  return points;
}

using Corners = boost::container::static_vector<Eigen::Vector2d, 4>;

// Calls visit(row, first column, end) for the whole coordinates in a convex polygon. What lies between two
// that share a side is in one of them.
template <typename Visit>
void for_each_row(const Corners& corners, int columns, int rows, const Visit& visit) {
  const auto first_from = [](double at, int end) {
    return static_cast<int>(std::clamp<double>(std::ceil(at), 0, end));
  };
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : corners) box.extend(corner);
  for (int row = first_from(box.min().y(), rows), end = first_from(box.max().y(), rows); row < end; ++row) {
    double left = std::numeric_limits<double>::max(), right = -left;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const auto [a, b] = std::minmax(corners[k], corners[(k + 1) % corners.size()],
                                      [](const auto& p, const auto& q) { return p.y() < q.y(); });
      if (row < a.y() || row >= b.y()) continue;
      const double at = a.x() + (row - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, at);
      right = std::max(right, at);
    }
    visit(row, first_from(left, columns), first_from(right, columns));
  }
}

// The picture at `oversampling` times its size, by a depth buffer.
class Canvas {
 public:
  Canvas(const io::Camera& camera, const std::vector<DrawnPolygon>& patches, const Eigen::AlignedBox3d& box,
         bool cut)
      : camera_(camera), columns_(camera.width * oversampling), rows_(camera.height * oversampling) {
    hits_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    std::vector<Eigen::Vector3f> shades;
    for (std::uint32_t i = 0; i < patches.size(); ++i) {
      const DrawnPolygon& patch = patches[i];
      shades.push_back(shade(patch, camera.eye));
      if (cut && patch.plane.signed_distance(camera.eye) < 0) continue;
      const auto& v = patch.mesh.vertices;
      for (const auto& t : patch.mesh.triangles) fill({v[t[0]], v[t[1]], v[t[2]]}, i);
    }
    colors_.reserve(hits_.size());
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        const std::uint32_t patch = hits_[index(column, row)].patch;
        colors_.push_back(patch == background ? ground(ray(column, row), box) : shades[patch]);
      }
  }

  // Dark lines at the borders of polygons.
  void outline() {
    for (int row = 0; row + 1 < rows_; ++row) {
      for (int column = 0; column + 1 < columns_; ++column) {
        const std::uint32_t here = hits_[index(column, row)].patch;
        if (hits_[index(column + 1, row)].patch != here || hits_[index(column, row + 1)].patch != here) {
          colors_[index(column, row)] *= 0.35f;
        }
      }
    }
  }

  // Lines two pixels wide.
  void edges(const Surface& surface, const Ring2& ring, const std::vector<EdgeKind>& kinds) {
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Eigen::Vector3d from = surface.to_map(ring[k]), to = surface.to_map(ring[(k + 1) % ring.size()]);
      const auto start = camera_.project(from), end = camera_.project(to);
      if (!start || !end) continue;
      const double length = std::hypot(end->x - start->x, end->y - start->y);
      const int steps = static_cast<int>(std::min(2 * length, 4.0 * camera_.width)) + 1;
      const std::array<float, 3>& rgb = edge_colors[static_cast<std::size_t>(kinds[k])];
      for (int i = 0; i < steps; ++i) {
        const Eigen::Vector3d at = from + (i + 0.5) / steps * (to - from);
        for (const int shift : {0, 1}) dot(at, {rgb[0], rgb[1], rgb[2]}, shift);
      }
    }
  }

  // A pixel, or the one `shift` to the right of and below it.
  void dot(const Eigen::Vector3d& point, const Eigen::Vector3f& color, int shift = 0) {
    auto pixel = camera_.project(point);
    if (!pixel) return;
    pixel->x += shift;
    pixel->y += shift;
    if (!(pixel->x >= 0 && pixel->x < camera_.width && pixel->y >= 0 && pixel->y < camera_.height)) return;
    const int column = static_cast<int>(pixel->x) * oversampling,
              row = static_cast<int>(pixel->y) * oversampling;
    for (int i = 0; i < oversampling * oversampling; ++i) {
      const std::size_t at = index(column + i % oversampling, row + i / oversampling);
      // Points on a surface scatter about it, so a little behind still counts as in front.
      if (pixel->depth < 1 / hits_[at].nearness * 1.002 + 0.02) colors_[at] = color;
    }
  }

  std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height));
    for (int row = 0; row < rows_; row += oversampling) {
      for (int column = 0; column < columns_; column += oversampling) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        for (int i = 0; i < oversampling * oversampling; ++i) {
          sum += colors_[index(column + i % oversampling, row + i / oversampling)];
        }
        sum = (sum / (oversampling * oversampling)).cwiseMax(0).cwiseMin(1);
        for (int c = 0; c < 3; ++c) rgb.push_back(static_cast<std::uint8_t>(std::lround(255 * sum[c])));
      }
    }
    return rgb;
  }

 private:
  struct Hit {
    std::uint32_t patch = background;
    float nearness = 0;  // 1 / depth: linear in the picture
  };

  // Through the middle of a sample.
  Eigen::Vector3d ray(int column, int row) const {
    return camera_.direction((column + 0.5) / oversampling, (row + 0.5) / oversampling);
  }

  void fill(const std::array<Eigen::Vector3d, 3>& triangle, std::uint32_t patch) {
    const Eigen::Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    const double offset = normal.dot(triangle[0] - camera_.eye);
    if (std::abs(offset) <= 1e-9 * normal.norm()) return;  // seen edge-on
    Corners corners;
    double least = std::numeric_limits<double>::max(), greatest = 0;  // nearness
    const auto add = [&](const Eigen::Vector3d& point) {
      const io::Camera::Pixel pixel = *camera_.project(point);
      corners.push_back(Eigen::Vector2d(pixel.x, pixel.y) * oversampling - Eigen::Vector2d(0.5, 0.5));
      least = std::min(least, 1 / pixel.depth);
      greatest = std::max(greatest, 1 / pixel.depth);
    };
    const auto ahead = [&](const Eigen::Vector3d& p) {
      return (p - camera_.eye).dot(camera_.forward) - 1e-3;
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d &a = triangle[k], &b = triangle[(k + 1) % 3];
      const double at_a = ahead(a), at_b = ahead(b);
      if (at_a >= 0) add(a);
      // From the same end whichever way round, so that neighbours meet.
      if (at_a < 0 && at_b >= 0) add(a + at_a / (at_a - at_b) * (b - a));
      if (at_a >= 0 && at_b < 0) add(b + at_b / (at_b - at_a) * (a - b));
    }
    for_each_row(corners, columns_, rows_, [&](int row, int first, int end) {
      const Eigen::Vector3d start = ray(0, row), step = ray(1, row) - start;
      const double at_start = normal.dot(start) / offset, per_column = normal.dot(step) / offset;
      for (int column = first; column < end; ++column) {
        const double nearness = std::clamp(at_start + column * per_column, least, greatest);
        Hit& hit = hits_[index(column, row)];
        if (static_cast<float>(nearness) > hit.nearness) hit = {patch, static_cast<float>(nearness)};
      }
    });
  }

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  // Wrapped Lambert shading, so that a room's walls differ and none is black.
  static Eigen::Vector3f shade(const DrawnPolygon& patch, const Eigen::Vector3d& eye) {
    const double side = patch.plane.signed_distance(eye) < 0 ? -1 : 1;
    const double lit = 0.5 + 0.5 * side * patch.plane.normal.dot(light);
    const Eigen::Vector3f color(patch.color[0], patch.color[1], patch.color[2]);
    return color * static_cast<float>(0.45 + 0.55 * lit);
  }

  // A grid of 1 m that extends beyond the map.
  Eigen::Vector3f ground(const Eigen::Vector3d& ray, const Eigen::AlignedBox3d& box) const {
    const Eigen::Vector3f paper(0.96f, 0.96f, 0.95f);
    if (camera_.eye.z() <= box.min().z() || ray.z() >= 0) return paper;
    const double depth = (box.min().z() - camera_.eye.z()) / ray.z();
    const Eigen::Vector3d at = camera_.eye + depth * ray;
    const double around = 1 + 0.15 * box.diagonal().norm();
    if (((at - box.min()).head<2>().array() < -around).any()) return paper;
    if (((at - box.max()).head<2>().array() > around).any()) return paper;
    const double pixel = depth * 2 * camera_.half_height / camera_.height;
    if (pixel > 0.1) return paper;  // lines would run together
    const Eigen::Array2d off = (at.head<2>().array() - at.head<2>().array().round()).abs();
    return off.minCoeff() < 0.6 * pixel ? Eigen::Vector3f(0.82f, 0.83f, 0.84f) : paper;
  }

  const io::Camera& camera_;
  int columns_, rows_;
  std::vector<Hit> hits_;
  std::vector<Eigen::Vector3f> colors_;
};

void draw_edges(Canvas& canvas, const Snapshot& snapshot, const PictureOptions& options,
                const Eigen::Vector3d& eye) {
  for (const auto& [id, edges] : options.edges) {
    const Surface* surface = snapshot.find(id);
    if (surface == nullptr) continue;
    io::require_labels_of(*surface, edges);
    if (options.cut && surface->plane.signed_distance(eye) < 0) continue;
    for (std::size_t p = 0; p < edges.size(); ++p) {
      canvas.edges(*surface, surface->polygons[p].outer, edges[p].outer);
      for (std::size_t k = 0; k < edges[p].holes.size(); ++k)
        canvas.edges(*surface, surface->polygons[p].holes[k], edges[p].holes[k]);
    }
  }
}

Snapshot turned(const Snapshot& snapshot, const Eigen::Quaterniond& rotation) {
  Snapshot result{snapshot.revision, snapshot.resolution, {}};
  for (const SurfacePtr& surface : snapshot.surfaces) {
    auto copy = std::make_shared<Surface>(*surface);
    copy->plane.normal = rotation * surface->plane.normal;
    copy->T_map_surface = rotation * surface->T_map_surface;
    result.surfaces.push_back(std::move(copy));
  }
  return result;
}

PictureOptions turned(PictureOptions options, const Eigen::Quaterniond& rotation) {
  if (options.eye) options.eye = rotation * *options.eye;
  if (options.target) options.target = rotation * *options.target;
  for (Eigen::Vector3d& point : options.points) point = rotation * point;
  for (NamedMesh& more : options.meshes)
    for (Eigen::Vector3d& vertex : more.mesh.vertices) vertex = rotation * vertex;
  return options;
}

/// Samples to show with `camera`: no strays, no omitted surfaces.
std::vector<Eigen::Vector3d> worth_showing(const std::vector<Sample>& samples, const Eigen::AlignedBox3d& box,
                                           const io::Camera* camera) {
  const double around = 0.15 * box.diagonal().norm();
  const Eigen::AlignedBox3d reach(box.min().array() - around, box.max().array() + around);
  std::vector<Eigen::Vector3d> shown;
  for (const auto& [at, patch] : samples) {
    const bool drawn =
        camera == nullptr || patch == nullptr || patch->plane.signed_distance(camera->eye) >= 0;
    if (drawn && reach.contains(at)) shown.push_back(at);
  }
  return shown;
}

/// The nearest camera position. Which surfaces are seen from behind depends on it: this is determined from
/// where all would be in the picture.
io::Camera camera_for(const std::vector<Sample>& samples, const Eigen::AlignedBox3d& box,
                      const PictureOptions& options) {
  const io::Camera camera = io::make_camera(worth_showing(samples, box, nullptr), options);
  if (!options.cut || options.eye) return camera;
  const std::vector<Eigen::Vector3d> shown = worth_showing(samples, box, &camera);
  return shown.empty() ? camera : io::make_camera(shown, options);
}

/// z is up.
std::vector<std::uint8_t> draw(const Snapshot& snapshot, const PictureOptions& options) {
  const std::vector<DrawnPolygon> patches = make_patches(snapshot, options.meshes);
  std::vector<Sample> samples = spread(patches);
  if (samples.empty())
    for (const Eigen::Vector3d& point : options.points) samples.push_back({point, nullptr});
  std::vector<Eigen::Vector3d> places;
  for (const Sample& sample : samples) places.push_back(sample.at);
  const Eigen::AlignedBox3d box = io::robust_box(places);
  const io::Camera camera = camera_for(samples, box, options);
  Canvas canvas(camera, patches, box, options.cut);
  canvas.outline();
  for (const Eigen::Vector3d& point : options.points) canvas.dot(point, {0.3f, 0.3f, 0.32f});
  draw_edges(canvas, snapshot, options, camera.eye);
  std::vector<std::uint8_t> rgb = canvas.pixels();
  if (!samples.empty())
    io::draw_scale_bar(rgb, camera.width, camera.height,
                       camera.height / (2 * camera.half_height * camera.middle_depth));
  return rgb;
}

}  // namespace

void render_png(const Snapshot& snapshot, const std::filesystem::path& file, const PictureOptions& options) {
  for (const int side : {options.width, options.height}) {
    if (side < 16 || side > 16384) {
      throw Error(Error::Kind::usage, "picture", std::to_string(side) + " pixels is not in 16 … 16384",
                  "give another size");
    }
  }
  geometry::require_direction(options.up, "up");
  io::NewFile output(file, options.force);
  const Eigen::Quaterniond rotation = upright(options.up);
  const bool is_upright = rotation.w() == 1;
  const std::vector<std::uint8_t> rgb =
      is_upright ? draw(snapshot, options) : draw(turned(snapshot, rotation), turned(options, rotation));
  output.write([&](std::ostream& out) { io::write_png(rgb, options.width, options.height, out); });
  output.commit();
}

}  // namespace octosurf
