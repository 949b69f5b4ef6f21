// Messages of every layout, and such as no driver sends.
#include "io/readers/bag_files.hpp"
#include "io/readers/sensor_messages.hpp"

namespace octosurf::test {
namespace {

constexpr std::uint64_t plenty = std::uint64_t{64} << 20;

/// The message of the exception that reading throws.
template <class Read>
std::string refusal(const std::string& bytes, MessageEncoding encoding, const Read& read) {
  try {
    read(*io::message_reader(bytes, encoding));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "not refused";
}

std::string cloud_refusal(const std::string& bytes, std::uint64_t limit = plenty) {
  return refusal(bytes, MessageEncoding::cdr,
                 [&](io::MessageReader& message) { io::read_cloud_message(message, limit); });
}

CdrBytes cloud_of(std::uint32_t height, std::uint32_t width, std::uint32_t step, std::uint32_t row_step,
                  std::size_t bytes, const std::string& names = "xyz", std::uint8_t type = 7) {
  CdrBytes message;
  message.header(1, "lidar").u32(height).u32(width).u32(static_cast<std::uint32_t>(names.size()));
  for (std::uint32_t i = 0; i < names.size(); ++i)
    message.text(names.substr(i, 1)).u32(4 * i).u8(type).u32(1);
  return message.u8(0).u32(step).u32(row_step).bytes(std::string(bytes, '\0')).u8(1);
}

TEST(Messages, OfEveryLengthAreReadOrRefused) {
  const std::string point = cloud(1).bytes, moved = tf(1, "map", "lidar", 3).bytes;
  const auto short_or_foreign = ::testing::AnyOf(says("ends too early"), says("not CDR"));
  const auto read_tf = [](io::MessageReader& message) {
    io::for_each_transform(message, [](const io::TransformMessage&) {});
  };
  for (std::size_t n = 0; n < point.size() - 1; ++n)  // whether it is dense is not asked
    EXPECT_THAT(cloud_refusal(point.substr(0, n)), short_or_foreign) << n;
  for (std::size_t n = 0; n < moved.size(); ++n)
    EXPECT_THAT(refusal(moved.substr(0, n), MessageEncoding::cdr, read_tf), short_or_foreign) << n;
  for (std::size_t n = 0; n < moved.size() - 4; ++n)
    EXPECT_THAT(refusal(moved.substr(4, n), MessageEncoding::ros1, read_tf), says("ends too early")) << n;
}

TEST(Messages, OfSizesThatTheyDoNotHaveAreRefused) {
  constexpr std::uint32_t huge = 4000000000;
  for (const auto& [message, words] : std::vector<std::pair<CdrBytes, const char*>>{
           {cloud_of(1, huge, 12, 12, 12), "says it has 4000000000x1 points"},
           {cloud_of(huge, huge, 12, 12, 24), "says it has"},
           {cloud_of(huge, 1, 12, 12, 24), "says it has"},
           {cloud_of(2, 1, 12, 11, 24), "says it has"},
           {cloud_of(2, 1, 12, 0, 24), "says it has"},
           {cloud_of(1, 1, 11, 12, 24), "lies outside"},
           {cloud_of(1, huge, 0, 0, 0), "lies outside"},
           {cloud_of(1, 1, 12, 12, 12, "xyy"), "one each of x, y and z"},
           {cloud_of(1, 1, 12, 12, 12, "xyz", 5), "no float32 or float64"}})
    EXPECT_THAT(cloud_refusal(message.all()), says(words));
  EXPECT_THAT(cloud_refusal(cloud_of(1, 1000, 12, 12000, 12000).all(), 11999),
              says("far more than its bag's size"));
  EXPECT_TRUE(io::read_cloud_message(
                  *io::message_reader(cloud_of(1, 0, 12, 0, 0).all(), MessageEncoding::cdr), plenty)
                  .points.empty());
}

TEST(Messages, ImagesOfSizesThatTheyDoNotHaveAreRefused) {
  struct Image {
    std::uint32_t height, width;
    const char* encoding;
    std::uint32_t step;
    std::size_t bytes;
    const char* words;
  };
  for (const auto& [height, width, encoding, step, bytes, words] :
       {Image{4, 6, "16UC1", 12, 47, "says it has 6x4 pixels"}, Image{4, 6, "16UC1", 11, 48, "says it has"},
        Image{4, 6, "16UC1", 0, 48, "says it has"}, Image{4, 6, "32FC1", 12, 48, "says it has"},
        Image{4, 6, "rgb8", 18, 72, "no depth image"}, Image{0, 6, "16UC1", 12, 48, "image of 6x0"},
        Image{8000, 8000, "16UC1", 16000, 48, "says it has"},
        Image{4000000000, 4000000000, "16UC1", 4, 48, "image of"}}) {
    CdrBytes image;
    image.header(1, "camera").u32(height).u32(width).text(encoding).u8(0).u32(step);
    image.bytes(std::string(bytes, '\0'));
    const auto read = [](io::MessageReader& message) {
      io::points_of(io::read_image_message(message), {1, 1, 0, 0}, {}, plenty);
    };
    EXPECT_THAT(refusal(image.all(), MessageEncoding::cdr, read), says(words));
  }
}

}  // namespace
}  // namespace octosurf::test
