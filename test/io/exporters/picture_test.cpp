#include "export_fixture.hpp"

#include <spng.h>

#include <octosurf/up.hpp>

namespace octosurf::test {
namespace {

struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  Eigen::Vector3d at(double x, double y) const {
    const auto column = static_cast<std::size_t>(x * width), row = static_cast<std::size_t>(y * height);
    const std::uint8_t* p = rgb.data() + 3 * (row * width + column);
    return Eigen::Vector3d(p[0], p[1], p[2]) / 255;
  }
};

Picture load(const fs::path& file) {
  const std::string bytes = read_file(file);
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), &spng_ctx_free);
  Picture image;
  spng_ihdr header{};
  std::size_t size = 0;
  EXPECT_EQ(spng_set_png_buffer(context.get(), bytes.data(), bytes.size()), 0);
  EXPECT_EQ(spng_get_ihdr(context.get(), &header), 0);
  EXPECT_EQ(spng_decoded_image_size(context.get(), SPNG_FMT_RGB8, &size), 0);
  image.rgb.resize(size);
  EXPECT_EQ(spng_decode_image(context.get(), image.rgb.data(), size, SPNG_FMT_RGB8, 0), 0);
  image.width = header.width;
  image.height = header.height;
  return image;
}

// Shading scales a surface's colour: the directions in colour space agree.
bool has_color_of(const Eigen::Vector3d& rgb, const Surface& surface) {
  const Eigen::Vector3d color(surface.color[0], surface.color[1], surface.color[2]);
  return rgb.normalized().dot(color.normalized()) > 0.999 && rgb.norm() > 0.3 * color.norm();
}

class PictureTest : public ExportTest {
 protected:
  static PictureOptions square(int size, ViewFrom from = PictureOptions().from) {
    PictureOptions options;
    options.width = options.height = size;
    options.from = from;
    return options;
  }
  Picture render(const Snapshot& snapshot, PictureOptions options, const std::string& name = "p.png") const {
    options.force = true;
    render_png(snapshot, path(name), options);
    if (const char* keep = std::getenv("OCTOSURF_KEEP_PICTURES")) {
      fs::copy_file(path(name), fs::path(keep) / name, fs::copy_options::overwrite_existing);
    }
    return load(path(name));
  }
};

TEST_F(PictureTest, OneLooksPastWhatIsSeenFromBehind) {
  PictureOptions options;
  options.width = 600;
  options.height = 400;
  options.from = ViewFrom::top;
  const Picture image = render(room_, options, "top.png");
  EXPECT_EQ(image.width, 600u);
  EXPECT_EQ(image.height, 400u);
  // +y is up in the picture: the floor's corner by the origin is below and to the left of its middle.
  EXPECT_TRUE(has_color_of(image.at(0.3, 0.7), *room_.surfaces[0]));
  EXPECT_TRUE(has_color_of(image.at(0.42, 0.52), *room_.surfaces[6])) << "the table, not the ceiling";
  Snapshot ceiling;
  ceiling.surfaces = {room_.surfaces[1]};
  EXPECT_TRUE(has_color_of(render(ceiling, options).at(0.5, 0.5), *room_.surfaces[1]))
      << "but if it is alone";
}

TEST_F(PictureTest, StraySurfaceDoesNotShrinkTheRest) {
  SnapshotBuilder builder;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  builder.add({0, 0, 0}, x, z, {{box_ring(0, 0, 4, 4), {}}}, 16);
  builder.add({500, 0, 0}, x, z, {{box_ring(0, 0, 0.1, 0.1), {}}}, 0.01);
  const Snapshot snapshot = builder.take();
  const Picture image = render(snapshot, square(200, ViewFrom::top));
  for (const double at : {0.1, 0.9}) EXPECT_TRUE(has_color_of(image.at(at, at), *snapshot.surfaces[0]));
}

/// Of what has a colour, in shares of the picture: paper, grid and outlines have none.
Eigen::AlignedBox2d colored(const Picture& image) {
  Eigen::AlignedBox2d box;
  for (std::uint32_t row = 0; row < image.height; ++row)
    for (std::uint32_t column = 0; column < image.width; ++column) {
      const Eigen::Vector2d place((column + 0.5) / image.width, (row + 0.5) / image.height);
      const Eigen::Vector3d rgb = image.at(place.x(), place.y());
      if (rgb.maxCoeff() - rgb.minCoeff() > 0.08) box.extend(place);
    }
  return box;
}

TEST_F(PictureTest, WhatIsMappedFillsThePictureButForAMargin) {
  PictureOptions options;
  for (const auto& [width, height] : {std::pair(300, 200), std::pair(400, 150), std::pair(150, 400)})
    for (const ViewFrom from : {ViewFrom::iso, ViewFrom::top}) {
      options.width = width;
      options.height = height;
      options.from = from;
      const Eigen::AlignedBox2d box = colored(render(room_, options));
      EXPECT_GT(box.sizes().maxCoeff(), 0.86)
          << width << " x " << height << " from " << static_cast<int>(from);
      EXPECT_GT(box.min().minCoeff(), 0.02);
      EXPECT_LT(box.max().maxCoeff(), 0.98);
      EXPECT_NEAR(box.center().x(), 0.5, 0.04) << "in the middle";
      EXPECT_NEAR(box.center().y(), 0.5, 0.04);
    }
}

TEST_F(PictureTest, IsoShowsFloorAndDefaultSize) {
  const Picture image = render(room_, {}, "iso.png");
  EXPECT_EQ(std::pair(image.width, image.height), std::pair(1280u, 960u));
  std::size_t floor = 0;
  for (int i = 0; i < 361; ++i)
    floor += has_color_of(image.at(0.05 + 0.05 * (i % 19), 0.05 + 0.05 * (i / 19)), *room_.surfaces[0]);
  EXPECT_GT(floor, 20u);
}

/// The room as a map would hold it whose frame is turned: R from the old frame to the new one.
Snapshot turned(const Snapshot& snapshot, const Eigen::Matrix3d& R) {
  Snapshot result = snapshot;
  for (SurfacePtr& surface : result.surfaces) {
    auto copy = std::make_shared<Surface>(*surface);
    copy->plane.normal = R * surface->plane.normal;
    copy->T_map_surface = Eigen::Isometry3d(Eigen::Quaterniond(R)) * surface->T_map_surface;
    surface = std::move(copy);
  }
  return result;
}

/// Share of the pixels that differ.
double pixel_difference(const Picture& a, const Picture& b) {
  std::size_t other = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3)
    other += !std::equal(
        a.rgb.begin() + static_cast<std::ptrdiff_t>(i), a.rgb.begin() + static_cast<std::ptrdiff_t>(i) + 3,
        b.rgb.begin() + static_cast<std::ptrdiff_t>(i), [](int p, int q) { return std::abs(p - q) <= 2; });
  return 3.0 * static_cast<double>(other) / static_cast<double>(a.rgb.size());
}

TEST_F(PictureTest, ATurnedMapWhoseUpIsGivenLooksTheSame) {
  for (const ViewFrom from : {ViewFrom::iso, ViewFrom::top})
    for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 0, 0),
                                      Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.2, -0.9, -0.4)}) {
      PictureOptions options;
      options.from = from;
      options.width = 320;
      options.height = 240;
      const Eigen::Matrix3d R = upright(up).toRotationMatrix().transpose();
      const Picture straight = render(room_, options, "straight.png");
      EXPECT_GT(pixel_difference(straight, render(turned(room_, R), options)), 0.2) << "z is not up here";
      options.up = up;
      const Picture image = render(turned(room_, R), options, "turned.png");
      EXPECT_LT(pixel_difference(straight, image), 0.002) << up.transpose();  // rays that meet an edge
    }
}

TEST_F(PictureTest, SamePictureTwiceAndOneOfNothing) {
  PictureOptions options = square(128);
  EXPECT_EQ(render(room_, options).rgb, render(make_room(), options).rgb);
  EXPECT_EQ(render(Snapshot{}, options).rgb.size(), 3u * 128 * 128);
}

TEST_F(PictureTest, NonsenseIsNamed) {
  using O = PictureOptions;
  std::ofstream(path("taken.png")) << "precious";
  for (const auto& [kind, name, change] :
       std::vector<std::tuple<Error::Kind, const char*, std::function<void(O&)>>>{
           {Error::Kind::usage, "p.png", [](O& o) { o.width = 15; }},
           {Error::Kind::usage, "p.png", [](O& o) { o.height = 1 << 20; }},
           {Error::Kind::usage, "p.png", [](O& o) { o.up.setZero(); }},
           {Error::Kind::output, "no/folder.png", [](O&) {}},
           {Error::Kind::usage, "taken.png", [](O&) {}}}) {
    PictureOptions options = square(64);
    change(options);
    failure(kind, [&] { render_png(room_, path(name), options); });
  }
}

}  // namespace
}  // namespace octosurf::test
