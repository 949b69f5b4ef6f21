#include "export_fixture.hpp"

#include <cstdlib>
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

Picture load(const std::filesystem::path& file) {
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
      std::filesystem::copy_file(path(name), std::filesystem::path(keep) / name,
                                 std::filesystem::copy_options::overwrite_existing);
    }
    return load(path(name));
  }
};

TEST_F(PictureTest, OneLooksPastWhatIsSeenFromBehind) {
  PictureOptions options;
  options.width = 600;
  options.height = 400;
  const auto shows = [&](ViewFrom from, bool cut, double x, double y, std::size_t surface) {
    options.from = from;
    options.cut = cut;
    const Picture image =
        render(room_, options,
               std::string(view_names[static_cast<std::size_t>(from)]) + (cut ? ".png" : "_uncut.png"));
    EXPECT_EQ(image.width, 600u);
    EXPECT_EQ(image.height, 400u);
    EXPECT_TRUE(has_color_of(image.at(x, y), *room_.surfaces[surface])) << surface;
  };
  // +y is up in the picture: the floor's corner by the origin is below and to the left of its middle.
  shows(ViewFrom::top, true, 0.3, 0.7, 0);
  shows(ViewFrom::top, true, 0.42, 0.52, 6);    // the table
  shows(ViewFrom::top, false, 0.5, 0.5, 1);     // the ceiling
  shows(ViewFrom::front, true, 0.35, 0.45, 3);  // along +y
  shows(ViewFrom::left, true, 0.5, 0.45, 5);    // along +x
  shows(ViewFrom::left, false, 0.5, 0.45, 4);
}

TEST_F(PictureTest, StraySurfaceDoesNotShrinkTheRest) {
  SnapshotBuilder builder;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  builder.add({0, 0, 0}, x, z, {{box_ring(0, 0, 4, 4), {}}}, 16);
  builder.add({500, 0, 0}, x, z, {{box_ring(0, 0, 0.1, 0.1), {}}}, 0.01);
  const Snapshot snapshot = builder.take();
  PictureOptions options = square(200, ViewFrom::top);
  const Picture image = render(snapshot, options);
  EXPECT_TRUE(has_color_of(image.at(0.1, 0.1), *snapshot.surfaces[0]));
  EXPECT_TRUE(has_color_of(image.at(0.9, 0.9), *snapshot.surfaces[0]));
}

/// Of what has a colour, in shares of the picture: paper, grid, outlines and scale bar have none.
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
    for (const ViewFrom from : {ViewFrom::iso, ViewFrom::top, ViewFrom::front, ViewFrom::left}) {
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

TEST_F(PictureTest, TheScaleBarIsAsLongAsTheMapSays) {
  SnapshotBuilder builder;
  builder.add({7, -3, 2}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), {{box_ring(0, 0, 4, 4), {}}},
              16);
  PictureOptions options = square(400, ViewFrom::top);
  const Picture image = render(builder.take(), options);
  // A fifth of the picture is 0.9 m of it: the bar is 0.5 m.
  const double pixels_per_m = 400 * colored(image).sizes().x() / 4;
  int longest = 0;
  for (std::uint32_t row = 350; row < 400; ++row)
    for (std::uint32_t column = 0, run = 0; column < 200; ++column) {
      run = image.at((column + 0.5) / 400, (row + 0.5) / 400).maxCoeff() < 0.2 ? run + 1 : 0;
      longest = std::max(longest, static_cast<int>(run));
    }
  EXPECT_NEAR(longest, 0.5 * pixels_per_m, 1.5);
}

TEST_F(PictureTest, IsoShowsFloorAndDefaultSize) {
  const Picture image = render(room_, {}, "iso.png");
  EXPECT_EQ(image.width, 1280u);
  EXPECT_EQ(image.height, 960u);
  std::size_t floor = 0;
  for (double px = 0.05; px < 1; px += 0.05) {
    for (double py = 0.05; py < 1; py += 0.05) floor += has_color_of(image.at(px, py), *room_.surfaces[0]);
  }
  EXPECT_GT(floor, 20u);  // of 361 places
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
  for (const ViewFrom from : {ViewFrom::iso, ViewFrom::top, ViewFrom::left})
    for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 0, 0),
                                      Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.2, -0.9, -0.4)}) {
      PictureOptions options;
      options.from = from;
      options.width = 320;
      options.height = 240;
      const Eigen::Matrix3d R = upright(up).toRotationMatrix().transpose();
      options.points = {Eigen::Vector3d(3, 2, 1.5)};
      const Picture straight = render(room_, options, "straight.png");
      options.points[0] = R * options.points[0];
      EXPECT_GT(pixel_difference(straight, render(turned(room_, R), options)), 0.2) << "z is not up here";
      options.up = up;
      const Picture image = render(turned(room_, R), options, "turned.png");
      EXPECT_LT(pixel_difference(straight, image), 0.002) << up.transpose();  // rays that meet an edge
    }
}

TEST_F(PictureTest, EyeAndTargetAreInTheMapsFrameWhateverIsUp) {
  const Eigen::Vector3d up(0.2, -0.9, -0.4), eye(3, 2, 1.5), target(0, 2, 1.2);
  const Eigen::Matrix3d R = upright(up).toRotationMatrix().transpose();
  PictureOptions options = square(300);
  options.eye = eye;
  options.target = target;
  const Picture straight = render(room_, options);
  EXPECT_TRUE(has_color_of(straight.at(0.5, 0.4), *room_.surfaces[4]));
  options.eye = R * eye;
  options.target = R * target;
  options.up = up;
  EXPECT_LT(pixel_difference(straight, render(turned(room_, R), options)), 0.002);
}

TEST_F(PictureTest, PointsAreDrawnUnlessHidden) {
  PictureOptions options = square(201, ViewFrom::top);
  Snapshot floor;
  floor.surfaces.push_back(room_.surfaces[0]);
  const Picture plain = render(floor, options);
  options.points = {room_.surfaces[0]->to_map({3, 2})};
  const Picture dotted = render(floor, options);
  EXPECT_NE(plain.rgb, dotted.rgb);
  options.points = {Eigen::Vector3d(3.05, 2.05, -1)};
  EXPECT_EQ(plain.rgb, render(floor, options).rgb);
}

TEST_F(PictureTest, EdgesAreDrawnInTheirKindsColours) {
  Snapshot only_floor;  // nothing hides its hole
  only_floor.surfaces.push_back(room_.surfaces[0]);
  const Surface& floor = *room_.surfaces[0];
  PictureOptions options = square(401, ViewFrom::top);
  const auto pixels_of = [&](EdgeKind kind, const Picture& image) {
    const std::array<float, 3>& wanted = edge_colors[static_cast<std::size_t>(kind)];
    int count = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      bool same = true;
      for (std::size_t c = 0; c < 3; ++c)
        same = same && std::fabs(image.rgb[i + c] / 255.0 - wanted[c]) < 0.01;
      count += same;
    }
    return count;
  };
  EXPECT_EQ(pixels_of(EdgeKind::frontier, render(only_floor, options)), 0);
  PolygonEdges edges;
  edges.outer.assign(floor.polygons[0].outer.size(), EdgeKind::frontier);
  edges.holes.emplace_back(floor.polygons[0].holes[0].size(), EdgeKind::occluded);
  options.edges[floor.id] = {edges};
  const Picture image = render(only_floor, options);
  EXPECT_GT(pixels_of(EdgeKind::frontier, image), 200);
  EXPECT_GT(pixels_of(EdgeKind::occluded, image), 20);
  EXPECT_EQ(pixels_of(EdgeKind::sensor_limit, image), 0);
  options.edges[floor.id] = {edges, edges};
  EXPECT_THROW(render(only_floor, options), Error);
  options.edges = {{999999, {edges}}};  // of no surface
  EXPECT_EQ(pixels_of(EdgeKind::frontier, render(only_floor, options)), 0);
}

TEST_F(PictureTest, SamePictureTwiceAndOneOfNothing) {
  PictureOptions options = square(128);
  EXPECT_EQ(render(room_, options).rgb, render(make_room(), options).rgb);
  EXPECT_EQ(render(Snapshot{}, options).rgb.size(), 3u * 128 * 128);
}

TEST_F(PictureTest, NonsenseIsNamed) {
  const auto expect_refused = [&](Error::Kind kind, const auto& change, const char* name = "p.png") {
    PictureOptions options = square(64);
    change(options);
    failure(kind, [&] { render_png(room_, path(name), options); });
  };
  using O = PictureOptions;
  expect_refused(Error::Kind::usage, [](O& o) { o.width = 15; });
  expect_refused(Error::Kind::usage, [](O& o) { o.height = 1 << 20; });
  expect_refused(
      Error::Kind::output, [](O&) {}, "no/folder.png");
  expect_refused(Error::Kind::usage, [](O& o) { o.eye = o.target = Eigen::Vector3d(1, 1, 1); });
  expect_refused(Error::Kind::usage, [](O& o) { o.eye = Eigen::Vector3d::Constant(std::nan("")); });
  expect_refused(Error::Kind::usage, [](O& o) { o.up.setZero(); });
  std::ofstream(path("p.png")) << "precious";
  expect_refused(Error::Kind::usage, [](O&) {});
}

}  // namespace
}  // namespace octosurf::test
