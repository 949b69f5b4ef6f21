#include "io/readers/depth_image.hpp"
#include "io/readers/scan_files.hpp"
#include "io/readers/sensor_messages.hpp"

namespace octosurf::test {
namespace {

class DepthImages : public ScanFiles {
 protected:
  static std::string refusal(const std::filesystem::path& file) {
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
  for (int i = 0; i < 2000; ++i) {  // no byte does harm
    std::string damaged = whole;
    damaged[8 + random() % (damaged.size() - 8)] = static_cast<char>(random());
    try {
      EXPECT_EQ(io::read_rvl(damaged, most_bytes).pixels.size(), pixels.size());
    } catch (const std::runtime_error&) {  // refused
    }
  }
}

}  // namespace
}  // namespace octosurf::test
