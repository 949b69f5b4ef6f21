#include "geometry/directions.hpp"
#include "io/exporters/camera.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <spng.h>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr int oversampling = 2;  // samples per pixel and axis
constexpr std::uint32_t background = std::numeric_limits<std::uint32_t>::max();
const Eigen::Vector3d light = Eigen::Vector3d(-0.45, -0.25, 0.85).normalized();

/// A surface or another flat mesh, turned so that z is up.
struct Drawn {
  Eigen::Vector3f color;
  Plane plane;
  Mesh mesh;

  bool faces(const Eigen::Vector3d& eye) const { return plane.signed_distance(eye) >= 0; }
};

std::vector<Drawn> drawn_of(const Snapshot& snapshot, const std::vector<NamedMesh>& meshes,
                            const Eigen::Quaterniond& turn) {
  std::vector<Drawn> all;
  const auto add = [&](const std::array<float, 3>& color, const Eigen::Vector3d& normal, Mesh mesh) {
    if (mesh.triangles.empty()) return;
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = turn * vertex;
    Plane plane;
    plane.normal = turn * normal;
    plane.offset = plane.normal.dot(mesh.vertices.front());
    all.push_back({Eigen::Vector3f(color.data()), plane, std::move(mesh)});
  };
  for (const SurfacePtr& surface : snapshot.surfaces)
    for (const Polygon& polygon : surface->polygons)
      add(surface->color, surface->plane.normal, io::flat(*surface, {polygon}));
  for (const auto& [name, color, mesh] : meshes) {
    if (mesh.triangles.empty()) continue;
    const auto& [a, b, c] = mesh.triangles.front();
    const auto& v = mesh.vertices;
    add(color, (v[b] - v[a]).cross(v[c] - v[a]).normalized(), mesh);
  }
  return all;
}

/// A corner of a triangle, with its share of the area.
struct Sample {
  Eigen::Vector3d at;
  double area;
  const Drawn* of;
};

std::vector<Sample> samples_of(const std::vector<Drawn>& all, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Sample> samples;
  for (const Drawn& drawn : all)
    for (const auto& t : drawn.mesh.triangles) {
      const auto& v = drawn.mesh.vertices;
      const double area = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).norm() / 2;
      for (const std::uint32_t corner : t) samples.push_back({v[corner], area / 3, &drawn});
    }
  if (samples.empty())
    for (const Eigen::Vector3d& point : points) samples.push_back({point, 1, nullptr});
  return samples;
}

/// Per axis from 2 to 98 % of the area; the unit cube without any.
Eigen::AlignedBox3d robust_box(std::vector<Sample> samples) {
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  double total = 0;
  for (const Sample& sample : samples) total += sample.area;
  for (int axis = 0; axis < 3 && total > 0; ++axis) {
    std::sort(samples.begin(), samples.end(),
              [axis](const Sample& a, const Sample& b) { return a.at[axis] < b.at[axis]; });
    double below = 0;
    for (const Sample& sample : samples) {
      if (below <= 0.02 * total) box.min()[axis] = sample.at[axis];
      if (below < 0.98 * total) box.max()[axis] = sample.at[axis];
      below += sample.area;
    }
  }
  return box;
}

/// As near as possible to what is to be seen: no strays, and with a `cut` no surface that is seen from
/// behind, for which the camera decides that is best for all.
io::Camera camera_for(const std::vector<Sample>& samples, const Eigen::AlignedBox3d& box,
                      const io::View& view, bool cut) {
  const double around = 0.15 * box.diagonal().norm();
  const Eigen::AlignedBox3d reach(box.min().array() - around, box.max().array() + around);
  const auto camera_on = [&](const auto& shown) {
    std::vector<Eigen::Vector3d> points;
    for (const Sample& sample : samples)
      if (reach.contains(sample.at) && shown(sample)) points.push_back(sample.at);
    return io::make_camera(points, view);
  };
  const auto any = [](const Sample&) { return true; };
  const io::Camera camera = camera_on(any);
  const auto seen = [&](const Sample& sample) {
    return sample.of == nullptr || sample.of->faces(camera.eye);
  };
  const bool some = std::any_of(samples.begin(), samples.end(), seen);
  return cut && !view.eye && some ? camera_on(seen) : camera;
}

/// The picture at `oversampling` times its size, by a depth buffer.
class Canvas {
 public:
  Canvas(const io::Camera& camera, const std::vector<Drawn>& all, const Eigen::AlignedBox3d& box, bool cut)
      : camera_(camera), columns_(camera.width * oversampling), rows_(camera.height * oversampling) {
    hits_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    std::vector<Eigen::Vector3f> shades;
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      shades.push_back(shade(all[i], camera.eye));
      if (cut && !all[i].faces(camera.eye)) continue;
      const auto& v = all[i].mesh.vertices;
      for (const auto& t : all[i].mesh.triangles) fill({v[t[0]], v[t[1]], v[t[2]]}, i);
    }
    colors_.reserve(hits_.size());
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        const std::uint32_t of = hits_[index(column, row)].of;
        colors_.push_back(of == background ? ground(ray(column, row), box) : shades[of]);
      }
    outline();
  }

  /// A line two pixels wide.
  void line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3f& color) {
    const auto start = camera_.project(from), end = camera_.project(to);
    if (!start || !end) return;
    const double length = std::hypot(end->x - start->x, end->y - start->y);
    const int steps = static_cast<int>(std::min(2 * length, 4.0 * camera_.width)) + 1;
    for (int i = 0; i < steps; ++i)
      for (const int shift : {0, 1}) dot(from + (i + 0.5) / steps * (to - from), color, shift);
  }

  /// A pixel, or the one `shift` to the right of and below it.
  void dot(const Eigen::Vector3d& point, const Eigen::Vector3f& color, int shift = 0) {
    const auto pixel = camera_.project(point);
    if (!pixel) return;
    const double x = pixel->x + shift, y = pixel->y + shift;
    if (!(x >= 0 && x < camera_.width && y >= 0 && y < camera_.height)) return;
    for (int i = 0; i < oversampling * oversampling; ++i) {
      const std::size_t at = index(static_cast<int>(x) * oversampling + i % oversampling,
                                   static_cast<int>(y) * oversampling + i / oversampling);
      // Points on a surface scatter about it, so a little behind still counts as in front.
      if (pixel->depth < 1 / hits_[at].nearness * 1.002 + 0.02) colors_[at] = color;
    }
  }

  std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> rgb;
    for (int row = 0; row < rows_; row += oversampling)
      for (int column = 0; column < columns_; column += oversampling) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        for (int i = 0; i < oversampling * oversampling; ++i)
          sum += colors_[index(column + i % oversampling, row + i / oversampling)];
        sum = (sum / (oversampling * oversampling)).cwiseMax(0).cwiseMin(1);
        for (const float channel : sum) rgb.push_back(static_cast<std::uint8_t>(std::lround(255 * channel)));
      }
    return rgb;
  }

 private:
  struct Hit {
    std::uint32_t of = background;
    float nearness = 0;  // 1 / depth: linear in the picture
  };

  /// Through the middle of a sample.
  Eigen::Vector3d ray(int column, int row) const {
    return camera_.direction((column + 0.5) / oversampling, (row + 0.5) / oversampling);
  }

  /// A ray is inside where its coordinates by the three corners, seen from the eye, are not negative. They
  /// are linear in the picture, and their sum is the nearness (Olano and Greer, "Triangle scan conversion
  /// using 2D homogeneous coordinates", 1997): no triangle needs clipping.
  void fill(const std::array<Eigen::Vector3d, 3>& triangle, std::uint32_t of) {
    Eigen::Matrix3d corners;
    double top = std::numeric_limits<double>::max(), bottom = -top;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& corner = triangle[static_cast<std::size_t>(k)];
      corners.col(k) = corner - camera_.eye;
      const auto pixel = camera_.project(corner);
      top = std::min(top, pixel ? oversampling * pixel->y - 1 : 0);
      bottom = std::max(bottom, pixel ? oversampling * pixel->y + 1 : rows_);
    }
    const Eigen::Matrix3d inverse = corners.inverse();
    if (!inverse.allFinite()) return;  // seen edge-on
    const Eigen::Vector3d step = inverse * (ray(1, 0) - ray(0, 0));
    const int last_row = static_cast<int>(std::clamp<double>(bottom, -1, rows_ - 1));
    for (int row = static_cast<int>(std::clamp<double>(top, 0, rows_)); row <= last_row; ++row) {
      const Eigen::Vector3d start = inverse * ray(0, row);
      double first = 0, last = columns_ - 1;
      for (int k = 0; k < 3; ++k) {
        if (step[k] > 0) first = std::max(first, -start[k] / step[k]);
        if (step[k] < 0) last = std::min(last, -start[k] / step[k]);
        if (step[k] == 0 && start[k] < 0) last = -1;
      }
      constexpr double exact = 1e-6;  // of a sample: neighbours leave no gap
      if (!(first - exact <= last + exact)) continue;
      for (int column = static_cast<int>(std::ceil(first - exact)); column <= last + exact; ++column) {
        const auto nearness = static_cast<float>((start + column * step).sum());
        Hit& hit = hits_[index(column, row)];
        if (nearness > hit.nearness) hit = {of, nearness};
      }
    }
  }

  /// Dark lines at the borders of polygons.
  void outline() {
    for (int row = 0; row + 1 < rows_; ++row)
      for (int column = 0; column + 1 < columns_; ++column) {
        const std::uint32_t here = hits_[index(column, row)].of;
        if (hits_[index(column + 1, row)].of != here || hits_[index(column, row + 1)].of != here)
          colors_[index(column, row)] *= 0.35F;
      }
  }

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  /// Wrapped Lambert shading, so that a room's walls differ and none is black.
  static Eigen::Vector3f shade(const Drawn& drawn, const Eigen::Vector3d& eye) {
    const double lit = 0.5 + (drawn.faces(eye) ? 0.5 : -0.5) * drawn.plane.normal.dot(light);
    return drawn.color * static_cast<float>(0.45 + 0.55 * lit);
  }

  /// A grid of 1 m that extends beyond the map.
  Eigen::Vector3f ground(const Eigen::Vector3d& ray, const Eigen::AlignedBox3d& box) const {
    const Eigen::Vector3f paper(0.96F, 0.96F, 0.95F);
    if (camera_.eye.z() <= box.min().z() || ray.z() >= 0) return paper;
    const double depth = (box.min().z() - camera_.eye.z()) / ray.z();
    const Eigen::Vector3d at = camera_.eye + depth * ray;
    const double around = 1 + 0.15 * box.diagonal().norm();
    if (((at - box.min()).head<2>().array() < -around).any()) return paper;
    if (((at - box.max()).head<2>().array() > around).any()) return paper;
    const double pixel = depth * 2 * camera_.half_height / camera_.height;
    if (pixel > 0.1) return paper;  // lines would run together
    const Eigen::Array2d off = (at.head<2>().array() - at.head<2>().array().round()).abs();
    return off.minCoeff() < 0.6 * pixel ? Eigen::Vector3f(0.82F, 0.83F, 0.84F) : paper;
  }

  const io::Camera& camera_;
  int columns_, rows_;
  std::vector<Hit> hits_;
  std::vector<Eigen::Vector3f> colors_;
};

void draw_edges(Canvas& canvas, const Snapshot& snapshot, const PictureOptions& options,
                const Eigen::Quaterniond& turn, const Eigen::Vector3d& eye) {
  for (const auto& [id, edges] : options.edges) {
    const Surface* surface = snapshot.find(id);
    if (surface == nullptr) continue;
    io::require_labels_of(*surface, edges);
    if (options.cut && surface->plane.signed_distance(turn.conjugate() * eye) < 0) continue;
    const auto draw = [&](const Ring2& ring, const std::vector<EdgeKind>& kinds) {
      for (std::size_t k = 0; k < ring.size(); ++k)
        canvas.line(turn * surface->to_map(ring[k]), turn * surface->to_map(ring[(k + 1) % ring.size()]),
                    Eigen::Vector3f(edge_colors[static_cast<std::size_t>(kinds[k])].data()));
    };
    for (std::size_t p = 0; p < edges.size(); ++p) {
      draw(surface->polygons[p].outer, edges[p].outer);
      for (std::size_t k = 0; k < edges[p].holes.size(); ++k)
        draw(surface->polygons[p].holes[k], edges[p].holes[k]);
    }
  }
}

constexpr int glyph_width = 5, glyph_height = 7;
/// All that such lengths need; five pixels a row, the leftmost is the highest bit.
constexpr std::string_view glyphs = "0125m.";
constexpr std::array<std::array<std::uint8_t, glyph_height>, glyphs.size()> font{{
    {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e},
    {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e},
    {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f},
    {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e},
    {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15},
    {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c},
}};

/// Draws a bar of 1, 2 or 5 times a power of ten metres, the longest within a fifth of the width, with its
/// length into the lower left corner of a picture of 3 bytes a pixel. Does nothing if the picture is too
/// small.
void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m) {
  constexpr std::uint8_t paper = 245, ink = 30;
  const double most_m = 0.2 * width / pixels_per_m, power = std::pow(10, std::floor(std::log10(most_m)));
  double length_m = power;
  for (const int times : {2, 5})
    if (times * power <= most_m) length_m = times * power;
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*f m",
                std::max(0, static_cast<int>(std::lround(-std::log10(power)))), length_m);
  const std::string_view text = buffer.data();

  const int dot = std::max(1, (std::min(width, height) + 160) / 320);  // of letters, pixels
  const int bar = static_cast<int>(std::lround(length_m * pixels_per_m)), edge = 4 * dot, line = 3 * dot;
  const int wide = std::max(bar, static_cast<int>(text.size()) * (glyph_width + 1) * dot) + 2 * edge;
  const int high = glyph_height * dot + line + 3 * edge, left = 2 * dot, top = height - high - 2 * dot;
  if (!(bar >= 8) || 2 * wide > width || 4 * high > height) return;
  const auto fill = [&](int x, int y, int columns, int rows, std::uint8_t grey) {  // within the frame
    for (int row = top + y; row < top + y + rows; ++row)
      std::fill_n(rgb.begin() + 3 * (std::ptrdiff_t{row} * width + left + x), 3 * columns, grey);
  };
  fill(0, 0, wide, high, paper);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t glyph = glyphs.find(text[i]);
    for (int k = 0; k < glyph_height * glyph_width && glyph < font.size(); ++k)
      if ((font[glyph][static_cast<std::size_t>(k / glyph_width)] >> (glyph_width - 1 - k % glyph_width)) & 1)
        fill(edge + (static_cast<int>(i) * (glyph_width + 1) + k % glyph_width) * dot,
             edge + k / glyph_width * dot, dot, dot, ink);
  }
  fill(edge, 2 * edge + glyph_height * dot, bar, line, ink);
}

std::vector<std::uint8_t> draw(const Snapshot& snapshot, const PictureOptions& options) {
  const Eigen::Quaterniond turn = upright(options.up);
  io::View view{options.from, options.eye, options.target, options.width, options.height};
  for (auto* const place : {&view.eye, &view.target})
    if (*place) **place = turn * **place;
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : options.points) points.push_back(turn * point);
  const std::vector<Drawn> all = drawn_of(snapshot, options.meshes, turn);
  const std::vector<Sample> samples = samples_of(all, points);
  const Eigen::AlignedBox3d box = robust_box(samples);
  const io::Camera camera = camera_for(samples, box, view, options.cut);
  Canvas canvas(camera, all, box, options.cut);
  for (const Eigen::Vector3d& point : points) canvas.dot(point, {0.3F, 0.3F, 0.32F});
  draw_edges(canvas, snapshot, options, turn, camera.eye);
  std::vector<std::uint8_t> rgb = canvas.pixels();
  if (!samples.empty())
    draw_scale_bar(rgb, camera.width, camera.height,
                   camera.height / (2 * camera.half_height * camera.middle_depth));
  return rgb;
}

/// An 8-bit RGB image, rows from the top.
void write_png(const std::vector<std::uint8_t>& rgb, int width, int height, std::ostream& out) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER),
                                                                    &spng_ctx_free);
  if (!context) throw std::bad_alloc();
  const auto require = [](int status) {
    if (status != 0) throw Error(Error::Kind::output, "picture", spng_strerror(status));
  };
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = 8;
  header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
  require(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1));
  require(spng_set_ihdr(context.get(), &header));
  require(spng_encode_image(context.get(), rgb.data(), rgb.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, decltype(&std::free)> png(spng_get_png_buffer(context.get(), &size, &status),
                                                        &std::free);
  require(status);
  out.write(static_cast<const char*>(png.get()), static_cast<std::streamsize>(size));
}

}  // namespace

void render_png(const Snapshot& snapshot, const std::filesystem::path& file, const PictureOptions& options) {
  for (const int side : {options.width, options.height})
    if (side < 16 || side > 16384)
      throw Error(Error::Kind::usage, "picture", std::to_string(side) + " pixels is not in 16 … 16384",
                  "give another size");
  geometry::require_direction(options.up, "up");
  io::NewFile output(file, options.force);
  const std::vector<std::uint8_t> rgb = draw(snapshot, options);
  output.write([&](std::ostream& out) { write_png(rgb, options.width, options.height, out); });
  output.commit();
}

}  // namespace octosurf
