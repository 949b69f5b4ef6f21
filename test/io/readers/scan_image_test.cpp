#include "io/readers/depth_image.hpp"
#include "io/readers/scan_files.hpp"

#include <fstream>
#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class DepthImages : public ScanFiles {
 protected:
  std::string refusal(const std::filesystem::path& file) const {
    try {
      io::read_depth_image(file);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return {};
  }

  std::string refused_camera(std::string_view text) const {
    try {
      io::read_intrinsics(write("camera.txt", text));
    } catch (const Error& error) {
      return error.what();
    }
    ADD_FAILURE() << "not refused: " << text;
    return {};
  }
};

const std::vector<std::uint16_t> six{1, 2, 258, 65535, 0, 4};

TEST_F(DepthImages, PngAndPgmGiveTheSamePixels) {
  const std::string p5 =
      std::string("P5\n# by hand\n3 2\n65535\n") + std::string("\0\1\0\2\1\2\377\377\0\0\0\4", 12);
  for (const auto& file : {write_png("a.png", 3, 2, six), write("a.pgm", p5),
                           write("b.pgm", "P2 3 2 65535 # plain\n1 2 258\n65535 0 4")}) {
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

TEST_F(DepthImages, TruncatedEmptyAndDamagedImagesAreRefused) {
  EXPECT_THAT(refusal(write("empty.png", "")), HasSubstr("is empty"));
  const std::string png = test::content(write_png("whole.png", 3, 2, six));
  for (std::size_t length = 1; length < png.size() - 4; ++length)  // the last 4 check an empty chunk
    refusal(write("cut.png", png.substr(0, length)));
  std::string damaged = png;
  damaged[png.size() - 20] = static_cast<char>(damaged[png.size() - 20] ^ 0x55);
  EXPECT_THAT(refusal(write("damaged.png", damaged)), HasSubstr("damaged PNG"));
  EXPECT_THAT(refusal(write("cut.pgm", "P5 3 2 65535\n123")), HasSubstr("truncated PGM"));
  EXPECT_THAT(refusal(write("head.pgm", "P5 3")), HasSubstr("PGM header"));
  EXPECT_THAT(refusal(write("few.pgm", "P2 3 2 65535 100 20 30 40 50")),
              HasSubstr("truncated or damaged PGM"));
  EXPECT_THAT(refusal(write("no.png", "hello")), HasSubstr("neither PNG nor PGM"));
  EXPECT_THAT(refusal(folder / "missing.png"), HasSubstr("cannot be read"));
}

TEST_F(DepthImages, EightBitAndColourAreRefused) {
  EXPECT_THAT(refusal(write_picture("gray.png", false)), HasSubstr("8 bits; depth images are 16-bit gray"));
  EXPECT_THAT(refusal(write_picture("colour.png", true)), HasSubstr("8 bits in colour"));
  EXPECT_THAT(refusal(write("gray.pgm", "P5 2 1 255\nab")), HasSubstr("PGM of 8 bits"));
}

TEST_F(DepthImages, AnnouncedSizesAreNotBelieved) {
  EXPECT_THAT(refusal(write("huge.pgm", "P5 4000000000 4000000000 65535\n")), HasSubstr("pixels"));
  EXPECT_THAT(refusal(write("large.pgm", "P5 8000 8000 65535\n")), HasSubstr("truncated"));
  // The header of a real file, its width (bytes 16 … 19) made 8000; the check sum no longer holds,
  // but nothing may be allocated in any case.
  std::string png = test::content(write_png("whole.png", 3, 2, six));
  png[18] = 0x1f;
  png[19] = 0x40;
  refusal(write("large.png", png));
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
  EXPECT_THAT(refused_camera("500 510 320"), AllOf(HasSubstr("camera.txt"), HasSubstr("3 numbers")));
  EXPECT_THAT(refused_camera("500 1 320 0 510 240 0 0 1"), HasSubstr("not a matrix"));  // skew
  EXPECT_THAT(refused_camera("0 510 320 240"), HasSubstr("focal length"));
  EXPECT_THAT(refused_camera("500 nan 320 240"), HasSubstr("not finite"));
  EXPECT_THAT(refused_camera("fx fy cx cy"), HasSubstr("camera.txt:1: 'fx' is not a number"));
}

}  // namespace
}  // namespace octosurf::test
