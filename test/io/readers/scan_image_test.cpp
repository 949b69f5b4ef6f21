// Depth images as files and messages, and what is taken back of them: flying pixels, and a lens' distortion,
// against the forward projection, which is OpenCV's formula written out.
#include "io/readers/depth_image.hpp"
#include "io/readers/lens.hpp"
#include "io/readers/scan_files.hpp"
#include "io/readers/sensor_messages.hpp"

namespace octosurf::test {
namespace {

class DepthImages : public ScanFiles {
 protected:
  static std::string refusal(const fs::path& file) {
    const std::string message = failure(Error::Kind::data, [&] { io::read_depth_image(file); });
    EXPECT_THAT(message, says(file.string()));
    return message;
  }
  std::string refused_camera(std::string_view text) const {
    return failure(Error::Kind::data, [&] { io::read_intrinsics(write("camera.txt", text)); });
  }
};

const std::vector<std::uint16_t> six{1, 2, 258, 65535, 0, 4};

TEST_F(DepthImages, PngAndPgmGiveTheSamePixels) {
  const std::string p5 =
      std::string("P5\n# by hand\n3 2\n65535\n") + std::string("\0\1\0\2\1\2\377\377\0\0\0\4", 12);
  for (const auto& file : {write_png("a.png", 3, 2, six), write("a.pgm", p5)}) {
    const io::DepthImage image = io::read_depth_image(file);
    EXPECT_EQ(image.width, 3) << file;
    EXPECT_EQ(image.height, 2) << file;
    EXPECT_EQ(image.pixels, six) << file;
  }
}

TEST_F(DepthImages, PixelsAreBackProjectedAlongTheOpticalAxis) {
  // fx = 2, fy = -4 (y up), cx = 1, cy = 0.5; 1000 units per metre; 0 and 65535 give no point.
  const io::DepthImage image{3, 2, {1000, 0, 2000, 65535, 4000, 500}};
  const auto points = io::back_project(image, {2, -4, 1, 0.5}, 1000);
  const std::vector<Eigen::Vector3f> expected{
      {-0.5f, 0.125f, 1}, {1, 0.25f, 2}, {0, -0.5f, 4}, {0.25f, -0.0625f, 0.5f}};
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT((points[i] - expected[i]).norm(), 1e-6) << i;
}

TEST_F(DepthImages, OthersThanWhole16BitGrayImagesAreRefused) {
  EXPECT_THAT(refusal(write("empty.png", "")), says("is empty"));
  const std::string png = read_file(write_png("whole.png", 3, 2, six));
  for (std::size_t length = 1; length < png.size() - 4; ++length)  // the last 4 check an empty chunk
    refusal(write("cut.png", png.substr(0, length)));
  std::string damaged = png;
  damaged[png.size() - 20] = static_cast<char>(damaged[png.size() - 20] ^ 0x55);
  EXPECT_THAT(refusal(write("damaged.png", damaged)), says("damaged PNG"));
  EXPECT_THAT(refusal(write("cut.pgm", "P5 3 2 65535\n123")), says("truncated PGM"));
  EXPECT_THAT(refusal(write("head.pgm", "P5 3")), says("PGM header"));
  EXPECT_THAT(refusal(write("no.png", "hello")), says("neither PNG nor PGM"));
  EXPECT_THAT(refusal(folder / "missing.png"), says("cannot be read"));
  EXPECT_THAT(refusal(write_picture("gray.png", false)), says("8 bits; depth images are 16-bit gray"));
  EXPECT_THAT(refusal(write_picture("colour.png", true)), says("8 bits in colour"));
  EXPECT_THAT(refusal(write("gray.pgm", "P5 2 1 255\nab")), says("PGM of 8 bits"));
  // Announced sizes are not believed.
  EXPECT_THAT(refusal(write("huge.pgm", "P5 4000000000 4000000000 65535\n")), says("pixels"));
  EXPECT_THAT(refusal(write("large.pgm", "P5 8000 8000 65535\n")), says("truncated"));
  // The header of a real file, its width (bytes 16 … 19) made 8000; the check sum no longer holds,
  // but nothing may be allocated in any case.
  std::string large = png;
  large[18] = 0x1f;
  large[19] = 0x40;
  refusal(write("large.png", large));
}

TEST_F(DepthImages, IntrinsicsAreAMatrixOrFourNumbers) {
  for (const auto* text :
       {"500 510 320 240", "500 0 320\n0 510 240\n0 0 1", "5.0e+02 0. 3.2e+02\n0. 510 2.4e2\n0. 0. 1.",
        "500,0,320,0,510,240,0,0,1", "# fx fy cx cy\r\n500, 510, 320, 240\r\n"}) {
    const io::Intrinsics camera = io::read_intrinsics(write("camera.txt", text));
    EXPECT_EQ(camera.fx, 500) << text;
    EXPECT_EQ(camera.fy, 510) << text;
    EXPECT_EQ(camera.cx, 320) << text;
    EXPECT_EQ(camera.cy, 240) << text;
  }
  EXPECT_THAT(refused_camera("500 510 320"), says("camera.txt", "3 numbers"));
  EXPECT_THAT(refused_camera("500 1 320 0 510 240 0 0 1"), says("not a matrix"));  // skew
  EXPECT_THAT(refused_camera("0 510 320 240"), says("focal length"));
  EXPECT_THAT(refused_camera("500 nan 320 240"), says("not finite"));
  EXPECT_THAT(refused_camera("fx fy cx cy"), says("camera.txt:1: 'fx' is not a number"));
}

/// RVL of these pixels, as its author describes it: numbers of zeros, of others, and each other's difference
/// to the one before, its sign last; in nibbles of three bits and whether more follow, eight to a word.
std::string rvl_of(std::uint32_t width, std::uint32_t height, const std::vector<std::uint16_t>& pixels) {
  std::vector<std::uint32_t> nibbles;
  const auto put = [&](std::ptrdiff_t value) {
    do {
      nibbles.push_back(static_cast<std::uint32_t>((value & 7) | (value > 7 ? 8 : 0)));
      value >>= 3;
    } while (value > 0);
  };
  int last = 0;
  for (std::size_t i = 0; i < pixels.size();) {
    const auto other = std::find_if(pixels.begin() + i, pixels.end(), [](auto p) { return p != 0; });
    const auto zero = std::find(other, pixels.end(), 0);
    put(other - pixels.begin() - static_cast<std::ptrdiff_t>(i));
    put(zero - other);
    for (auto p = other; p != zero; ++p) {
      const int step = *p - last;
      put(step >= 0 ? 2 * step : -2 * step - 1);
      last = *p;
    }
    i = static_cast<std::size_t>(zero - pixels.begin());
  }
  nibbles.resize((nibbles.size() + 7) / 8 * 8);
  std::string bytes = bytes_of(width, height);
  for (std::size_t first = 0; first < nibbles.size(); first += 8) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 8; ++k) word = word << 4 | nibbles[first + k];
    bytes += bytes_of(word);
  }
  return bytes;
}

constexpr std::size_t most_bytes = 1 << 20;

io::DepthImage depth_message(const std::string& format, const std::string& data) {
  return io::depth_of({format, data}, "message", most_bytes);
}

TEST_F(DepthImages, CompressedDepthIsReadFromPngAndRvlOfEitherEncoding) {
  const std::vector<std::uint16_t> pixels{0, 0, 1000, 1003, 990, 0, 65535, 1, 0, 0, 0, 7};
  const std::string rvl = rvl_of(4, 3, pixels), png = read_file(write_png("a.png", 4, 3, pixels));
  // quantA and quantB of the transport's defaults: depth_max 10 m, depth_quantization 100.
  const float a = 100 * 101, b = 1 - a / 10;
  const std::string unset = bytes_of(0, 0.0F, 0.0F), set = bytes_of(0, a, b);
  for (const auto& [word, data] : {std::pair("png", png), std::pair("rvl", rvl)}) {
    for (const std::string& format :
         {std::string("16UC1; compressedDepth ") + word, std::string("mono16; compressedDepth ") + word}) {
      for (const std::string& head : {unset, set}) {
        const io::DepthImage image = depth_message(format, head + data);
        EXPECT_EQ(image.width, 4);
        EXPECT_EQ(image.height, 3);
        EXPECT_EQ(image.pixels, pixels) << format;
        EXPECT_EQ(image.default_scale(), 1000);
      }
    }
  }
  for (const auto& [pixel, depth] : {std::pair(std::uint16_t{1000}, a / (1000 - b)), {1, 10.0F}}) {
    const std::vector<std::uint16_t> wall(12, pixel);  // of pixel 1 at depth_max
    for (const std::string& format :
         {std::string("32FC1; compressedDepth "), std::string("compressedDepth ")})
      for (const io::DepthImage& image :
           {depth_message(format + "rvl", set + rvl_of(4, 3, wall)),
            depth_message(format + "png", set + read_file(write_png("wall.png", 4, 3, wall)))}) {
        EXPECT_EQ(image.default_scale(), 1);
        const auto points = io::back_project(image, {1, 1, 0, 0}, 1);
        ASSERT_EQ(points.size(), 12U);
        EXPECT_NEAR(points[5].z(), depth, 1e-4);
      }
  }
  // Nothing but the name: the head's numbers tell.
  EXPECT_EQ(depth_message("compressedDepth", unset + png).default_scale(), 1000);
  EXPECT_EQ(depth_message("compressedDepth", set + png).default_scale(), 1);
  EXPECT_EQ(depth_message("16UC1; compressedDepth", unset + png).pixels, pixels);
  EXPECT_THROW(depth_message("32FC1; compressedDepth png", unset + png), std::runtime_error);
}

TEST_F(DepthImages, RvlIsReadToTheBitAndNeverBeyondItsEnd) {
  // 0 zeros, 2 others: 5 (+5: 10 = 2 + 8·1) and 4 (−1: 1), nibbles 0 2 a 1 1.
  const std::string by_hand = bytes_of(2U, 1U, 0x02a11000U);
  EXPECT_EQ(io::read_rvl(by_hand, most_bytes).pixels, (std::vector<std::uint16_t>{5, 4}));
  std::vector<std::uint16_t> pixels(64 * 48);
  auto random = test::rng();
  for (auto& pixel : pixels)
    pixel = static_cast<std::uint16_t>(random() % 3 == 0 ? 0 : 500 + random() % 4000);
  const std::string whole = rvl_of(64, 48, pixels);
  EXPECT_EQ(io::read_rvl(whole, most_bytes).pixels, pixels);
  for (std::size_t size = 0; size + 4 < whole.size(); size += 5)
    EXPECT_THROW(io::read_rvl(whole.substr(0, size), most_bytes), std::runtime_error) << size;
  EXPECT_THROW(io::read_rvl(bytes_of(8192U, 8192U, 0U), most_bytes), std::runtime_error);
  EXPECT_THROW(io::read_rvl(bytes_of(0U, 4U, 0U), most_bytes), std::runtime_error);
  EXPECT_THROW(io::read_rvl(bytes_of(2U, 1U, 0x31110000U), most_bytes), std::runtime_error);  // three zeros
  EXPECT_THROW(io::read_rvl(bytes_of(2U, 1U, ~0U, ~0U, ~0U), most_bytes), std::runtime_error);
}

constexpr std::size_t width = 40, height = 32;

/// depth(u, v): m.
template <class Depth>
std::vector<float> image(const Depth& depth) {
  std::vector<float> pixels;
  for (std::size_t v = 0; v < height; ++v)
    for (std::size_t u = 0; u < width; ++u) pixels.push_back(static_cast<float>(depth(u, v)));
  return pixels;
}

std::vector<float> cleaned(std::vector<float> depth) {
  io::erase_flying_pixels(depth, width);
  return depth;
}

/// A front at 1.5 m and a back at 2.3 m, with these depths between them.
std::vector<float> edge(const std::vector<double>& ramp, bool upright) {
  return image([&](std::size_t u, std::size_t v) {
    const std::size_t along = upright ? u : v, begin = 15;
    if (along < begin) return 1.5;
    return along < begin + ramp.size() ? ramp[along - begin] : 2.3;
  });
}

class FlyingPixels : public ::testing::TestWithParam<std::tuple<std::vector<double>, bool>> {};

TEST_P(FlyingPixels, OfARampAreErasedAndItsSurfacesStay) {
  const auto& [ramp, upright] = GetParam();
  const std::vector<float> depth = edge(ramp, upright), clean = cleaned(depth);
  std::size_t missing = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const bool flies = depth[i] != 1.5F && depth[i] != 2.3F;
    EXPECT_EQ(clean[i], flies ? 0 : depth[i]) << "column " << i % width << ", row " << i / width;
    missing += clean[i] == 0;
  }
  EXPECT_EQ(missing, ramp.size() * (upright ? height : width));
}
INSTANTIATE_TEST_SUITE_P(, FlyingPixels,
                         ::testing::Combine(::testing::Values(std::vector{1.9}, std::vector{1.7, 2.1},
                                                              std::vector{1.9, 1.9},
                                                              std::vector{1.7, 1.7, 2.1, 2.1}),
                                            ::testing::Bool()));

TEST(FlyingPixelsOf, SurfacesAreNone) {
  const auto expect_kept = [](const char* what, const std::vector<float>& depth) {
    EXPECT_EQ(cleaned(depth), depth) << what;
  };
  // A floor seen at 3° from 0.3 m above changes by decimetres a pixel.
  expect_kept("plane", image([](std::size_t, std::size_t v) { return 90 / (3.0 + static_cast<double>(v)); }));
  for (const double slant : {0.02, 0.05, 0.1})
    expect_kept("a slanted table up to its edge before a wall", image([&](std::size_t u, std::size_t) {
                  return u < 20 ? 1 / (0.8 - 0.1 * slant * (static_cast<double>(u) - 20)) : 4.0;
                }));
  expect_kept("pole", image([](std::size_t u, std::size_t) { return u == 20 ? 1.0 : 2.0; }));
  expect_kept("gap", image([](std::size_t u, std::size_t) { return u == 20 ? 2.0 : 1.0; }));
  // Stairs seen from below: each is between a nearer and a farther one.
  expect_kept("steps",
              image([](std::size_t, std::size_t v) { return 1 + 0.3 * static_cast<double>(v / 9); }));
}

TEST(FlyingPixelsOf, ImagesOfAnySizeAreRead) {
  for (const std::size_t size : {0, 1, 5, 12, 13}) {
    std::vector<float> depth(size * size, 1.F);
    io::erase_flying_pixels(depth, size);
    EXPECT_EQ(depth, std::vector<float>(size * size, 1.F));
  }
}

using Slopes = Eigen::Vector2d;

/// docs.opencv.org, calib3d: the distortion of the points (x, y) of the plane at depth 1.
Slopes seen_by_opencv(const io::Lens& lens, double x, double y) {
  const auto k = [&](std::size_t i) { return i < lens.d.size() ? lens.d[i] : 0; };
  const double r = std::hypot(x, y);
  if (lens.model == "equidistant") {
    const double t = std::atan(r);
    const double bent =
        t + k(0) * std::pow(t, 3) + k(1) * std::pow(t, 5) + k(2) * std::pow(t, 7) + k(3) * std::pow(t, 9);
    return Slopes(x, y) * (r == 0 ? 1 : bent / r);
  }
  const double above = 1 + k(0) * std::pow(r, 2) + k(1) * std::pow(r, 4) + k(4) * std::pow(r, 6);
  const double below = 1 + k(5) * std::pow(r, 2) + k(6) * std::pow(r, 4) + k(7) * std::pow(r, 6);
  return {x * above / below + 2 * k(2) * x * y + k(3) * (r * r + 2 * x * x),
          y * above / below + k(2) * (r * r + 2 * y * y) + 2 * k(3) * x * y};
}

/// Of a Kinect v1, an Azure Kinect and a RealSense T265.
const std::vector<io::Lens> lenses{
    {"plumb_bob", {0.0957, -0.2481, -0.0012, 0.0024, 0.1173}},
    {"plumb_bob", {-0.28, 0.09, 0.0005, -0.0003}},
    {"rational_polynomial", {5.55, 3.53, 0.00006, -0.00009, 0.17, 5.88, 5.31, 0.93}},
    {"equidistant", {-0.0078, 0.0424, -0.0396, 0.0067}}};

TEST(Lens, RaysAreFoundBackFromWhereTheyAreSeen) {
  auto random = rng();
  std::uniform_real_distribution<double> slope(-0.7, 0.7);
  for (const io::Lens& lens : lenses)
    for (int i = 0; i < 1000; ++i) {
      const Slopes ray(slope(random), slope(random));
      const Slopes seen = seen_by_opencv(lens, ray.x(), ray.y());
      EXPECT_LT((io::distorted(lens, ray) - seen).norm(), 1e-12) << lens.model;
      const auto found = io::undistorted(lens, seen, io::reach_of(lens));
      ASSERT_TRUE(found) << lens.model << ' ' << ray.transpose();
      EXPECT_LT((*found - ray).norm(), 1e-6) << lens.model;
    }
  const auto wide =
      io::undistorted(lenses.back(), seen_by_opencv(lenses.back(), 4, -1), io::reach_of(lenses.back()));
  ASSERT_TRUE(wide) << "of a field of view of 150 degrees";
  EXPECT_LT((*wide - Slopes(4, -1)).norm(), 1e-6);
}

/// Its radius grows to 0.667 at a slope of 1, and falls again: the ray of a place has a twin farther out.
TEST(Lens, RaysAreNotSoughtWhereTheFormulaTurnsBack) {
  const io::Lens lens{"plumb_bob", {-1.0 / 3, 0, 0, 0, 0}};
  EXPECT_NEAR(io::reach_of(lens), 1, 0.011);
  for (const double ray : {0.5, 0.9, 0.98})
    EXPECT_NEAR(io::undistorted(lens, seen_by_opencv(lens, ray, 0), 1).value().x(), ray, 1e-6);
  EXPECT_FALSE(io::undistorted(lens, {0.7, 0}, 1));
}

/// At depths and by cameras, too, for which x / z in float32 is another pixel's.
TEST(Lens, PointsOfAnImageComeToTheirRays) {
  for (const io::Intrinsics& camera : {io::Intrinsics{50, 55, 31.5, 23.5}, {5e7, 5e7, -3e7, -3e7}})
    for (const io::Lens& lens : lenses)
      for (const float depth : {2.F, io::nearest_depth, 1e38F}) {
        const auto pixel = [&](std::size_t u, std::size_t v) { return u % 2 + v % 3 == 0 ? depth : 0; };
        const auto points = io::back_project(64, 48, camera, 1, pixel, &lens);
        ASSERT_EQ(points.size(), 32U * 16);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Slopes seen((static_cast<double>(2 * (i % 32)) - camera.cx) / camera.fx,
                            (static_cast<double>(3 * (i / 32)) - camera.cy) / camera.fy);
          const auto ray = io::undistorted(lens, seen, io::reach_of(lens));
          ASSERT_EQ(ray.has_value(), points[i].allFinite()) << lens.model << i;
          EXPECT_EQ(points[i].z(), depth);
          if (!ray) continue;
          EXPECT_EQ(points[i].head<2>(), depth * ray->cast<float>());
          EXPECT_LT((seen_by_opencv(lens, ray->x(), ray->y()) - seen).norm(), 1e-6);
        }
      }
}

}  // namespace
}  // namespace octosurf::test
