#include "geometry/directions.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <memory>
#include <spng.h>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr int oversampling = 2;  // samples per pixel and axis
constexpr double margin = 0.9;   // part of the picture that the map fills
constexpr std::uint32_t background = std::numeric_limits<std::uint32_t>::max();
const Eigen::Vector3d light = Eigen::Vector3d(-0.45, -0.25, 0.85).normalized();

/// A surface or another flat mesh, turned so that z is up.
struct Drawn {
  Eigen::Vector3f color;
  Eigen::Vector3d normal;
  Mesh mesh;
};

/// All that is seen along `forward`: not what is seen from behind, to look past ceilings and near walls into
/// rooms. A picture of nothing else shows it.
std::vector<Drawn> drawn_of(const Snapshot& snapshot, const std::vector<NamedMesh>& meshes,
                            const Eigen::Quaterniond& turn, const Eigen::Vector3d& forward) {
  std::vector<Drawn> all;
  const auto add = [&](const std::array<float, 3>& color, const Eigen::Vector3d& normal, Mesh mesh) {
    if (mesh.triangles.empty()) return;
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = turn * vertex;
    all.push_back({Eigen::Vector3f(color.data()), turn * normal, std::move(mesh)});
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
  const auto behind = [&](const Drawn& drawn) { return drawn.normal.dot(forward) > 0; };
  if (!std::ranges::all_of(all, behind)) std::erase_if(all, behind);
  return all;
}

/// Along each of three axes from 2 to 98 % of the area, for stray surfaces not to shrink the rest; the unit
/// cube without any.
Eigen::AlignedBox3d robust_box(const std::vector<Drawn>& all, const Eigen::Matrix3d& axes) {
  struct Sample {
    Eigen::Vector3d at;
    double area;
  };
  std::vector<Sample> samples;
  double total = 0;
  for (const Drawn& drawn : all)
    for (const auto& t : drawn.mesh.triangles) {
      const auto& v = drawn.mesh.vertices;
      const double area = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).norm() / 2;
      for (const std::uint32_t corner : t) samples.push_back({axes * v[corner], area / 3});
      total += area;
    }
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  for (int axis = 0; axis < 3 && total > 0; ++axis) {
    std::ranges::sort(samples, [axis](const Sample& a, const Sample& b) { return a.at[axis] < b.at[axis]; });
    double below = 0;
    for (const Sample& sample : samples) {
      if (below <= 0.02 * total) box.min()[axis] = sample.at[axis];
      if (below < 0.98 * total) box.max()[axis] = sample.at[axis];
      below += sample.area;
    }
  }
  return box;
}

/// The axes of a picture, as rows: to the right, down, and ahead. Parallel lines stay parallel in it.
Eigen::Matrix3d axes_of(ViewFrom from) {
  const Eigen::Vector3d forward =
      from == ViewFrom::top ? -Eigen::Vector3d::UnitZ() : Eigen::Vector3d(0.55, 0.75, -0.75).normalized();
  const Eigen::Vector3d right =
      from == ViewFrom::top ? Eigen::Vector3d::UnitX() : forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d axes;
  axes << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  return axes;
}

/// The picture at `oversampling` times its size, by a depth buffer.
class Canvas {
 public:
  Canvas(const std::vector<Drawn>& all, const Eigen::Matrix3d& axes, int width, int height)
      : axes_(axes), columns_(width * oversampling), rows_(height * oversampling) {
    frame(all);
    hits_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (std::uint32_t i = 0; i < all.size(); ++i)
      for (const auto& t : all[i].mesh.triangles) {
        const auto& v = all[i].mesh.vertices;
        fill({v[t[0]], v[t[1]], v[t[2]]}, i);
      }
    const Eigen::AlignedBox3d box = robust_box(all, Eigen::Matrix3d::Identity());
    colors_.reserve(hits_.size());
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        const std::uint32_t of = hits_[index(column, row)].of;
        colors_.push_back(of == background ? ground(column, row, box) : shade(all[of]));
      }
    outline();
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
    double depth = std::numeric_limits<double>::max();
  };

  /// All but strays fill the picture.
  void frame(const std::vector<Drawn>& all) {
    const Eigen::AlignedBox3d core = robust_box(all, axes_);
    const double around = 0.15 * core.diagonal().norm();
    const Eigen::AlignedBox3d reach(core.min().array() - around, core.max().array() + around);
    Eigen::AlignedBox2d box;
    for (const Drawn& drawn : all)
      for (const Eigen::Vector3d& vertex : drawn.mesh.vertices)
        if (const Eigen::Vector3d at = axes_ * vertex; reach.contains(at)) box.extend(at.head<2>());
    if (box.isEmpty()) box = {core.min().head<2>(), core.max().head<2>()};
    const Eigen::Array2d size(columns_, rows_);
    sample_m_ = std::max((box.sizes().array() / size).maxCoeff() / margin, 1e-6);
    corner_ = box.center().array() - size * sample_m_ / 2;
  }

  /// A place's column, row and depth.
  Eigen::Vector3d seen(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d at = axes_ * place;
    return {(at.x() - corner_.x()) / sample_m_ - 0.5, (at.y() - corner_.y()) / sample_m_ - 0.5, at.z()};
  }

  /// A sample is inside where its barycentric coordinates, linear in the picture, are not negative.
  void fill(const std::array<Eigen::Vector3d, 3>& triangle, std::uint32_t of) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = seen(triangle[static_cast<std::size_t>(k)]);
    const Eigen::RowVector3d depths = corners.row(2);
    const double top = corners.row(1).minCoeff(), bottom = corners.row(1).maxCoeff();
    corners.row(2).setOnes();
    const Eigen::Matrix3d inverse = corners.inverse();
    if (!inverse.allFinite()) return;  // seen edge-on
    const Eigen::Vector3d step = inverse.col(0);
    const int last_row = static_cast<int>(std::clamp<double>(std::floor(bottom), -1, rows_ - 1));
    for (int row = static_cast<int>(std::clamp<double>(std::ceil(top), 0, rows_)); row <= last_row; ++row) {
      const Eigen::Vector3d start = inverse * Eigen::Vector3d(0, row, 1);
      double first = 0, last = columns_ - 1;
      for (int k = 0; k < 3; ++k) {
        if (step[k] > 0) first = std::max(first, -start[k] / step[k]);
        if (step[k] < 0) last = std::min(last, -start[k] / step[k]);
        if (step[k] == 0 && start[k] < 0) last = -1;
      }
      constexpr double exact = 1e-6;  // of a sample: neighbours leave no gap
      if (!(first - exact <= last + exact)) continue;
      for (int column = static_cast<int>(std::ceil(first - exact)); column <= last + exact; ++column) {
        const double depth = depths * (start + column * step);
        Hit& hit = hits_[index(column, row)];
        if (depth < hit.depth) hit = {of, depth};
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
  static Eigen::Vector3f shade(const Drawn& drawn) {
    return drawn.color * static_cast<float>(0.725 + 0.275 * drawn.normal.dot(light));
  }

  /// A grid of 1 m at the height of the lowest surfaces, that extends beyond the map.
  Eigen::Vector3f ground(int column, int row, const Eigen::AlignedBox3d& box) const {
    const Eigen::Vector3f paper(0.96F, 0.96F, 0.95F), line(0.82F, 0.83F, 0.84F);
    const Eigen::Vector2d at = corner_ + sample_m_ * Eigen::Vector2d(column + 0.5, row + 0.5);
    const Eigen::Vector3d here = axes_.topRows<2>().transpose() * at, forward = axes_.row(2);
    const Eigen::Array2d place = (here + (box.min().z() - here.z()) / forward.z() * forward).head<2>();
    const double around = 1 + 0.15 * box.diagonal().norm(), pixel = oversampling * sample_m_;
    if (pixel > 0.1) return paper;  // lines would run together
    const Eigen::Array2d low = box.min().head<2>().array() - around,
                         high = box.max().head<2>().array() + around;
    if ((place < low).any() || (place > high).any()) return paper;
    return (place - place.round()).abs().minCoeff() < 0.6 * pixel ? line : paper;
  }

  const Eigen::Matrix3d axes_;
  const int columns_, rows_;
  double sample_m_ = 1;                               // of a sample's side
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();  // upper left, along the first two axes
  std::vector<Hit> hits_;
  std::vector<Eigen::Vector3f> colors_;
};

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
  const Eigen::Matrix3d axes = axes_of(options.from);
  const Canvas canvas(drawn_of(snapshot, options.meshes, upright(options.up), axes.row(2)), axes,
                      options.width, options.height);
  output.write([&](std::ostream& out) { write_png(canvas.pixels(), options.width, options.height, out); });
  output.commit();
}

}  // namespace octosurf
