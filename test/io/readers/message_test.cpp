// Messages of every layout, and such as no driver sends.
#include "io/readers/bag_files.hpp"
#include "io/readers/sensor_messages.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>

namespace octosurf::test {
namespace {

namespace cdr = eprosima::fastcdr;

constexpr std::uint64_t plenty = std::uint64_t{64} << 20;

/// What Fast CDR, by whose library ROS 2 serialises, makes of the same values.
class FastCdr {
 public:
  explicit FastCdr(cdr::Cdr::Endianness order = cdr::Cdr::LITTLE_ENDIANNESS)
      :
#if FASTCDR_VERSION_MAJOR >= 2
        cdr_(buffer_, order, cdr::CdrVersion::XCDRv1) {
    cdr_.set_encoding_flag(cdr::EncodingAlgorithmFlag::PLAIN_CDR);
#else
        cdr_(buffer_, order, cdr::Cdr::DDS_CDR) {
#endif
    cdr_.serialize_encapsulation();
  }
  template <class Value>
  FastCdr& operator<<(const Value& value) {
    cdr_ << value;
    return *this;
  }
  std::string all() {
#if FASTCDR_VERSION_MAJOR >= 2
    return {buffer_.getBuffer(), cdr_.get_serialized_data_length()};
#else
    return {buffer_.getBuffer(), cdr_.getSerializedDataLength()};
#endif
  }

 private:
  std::string zeros_ = std::string(1000, '\0');  // it leaves what it skips to align as it was
  cdr::FastBuffer buffer_{zeros_.data(), zeros_.size()};
  cdr::Cdr cdr_;
};

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

/// The tests' writers of CDR, this one's and write_bag.py's, against Fast CDR's: what they made is of its
/// bytes.
TEST_F(BagFiles, WritersOfCdrAgreeWithFastCdr) {
  const auto sequence = [](const std::string& bytes) {
    return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
  };
  const std::string points = bytes_of(1.0F, 2.0F, 3.0F);
  FastCdr fast;
  fast << std::int32_t{5} << std::uint32_t{500000000} << std::string("lidar") << std::uint32_t{1}
       << std::uint32_t{1} << std::uint32_t{3};
  for (std::uint32_t axis = 0; axis < 3; ++axis)
    fast << std::string("xyz").substr(axis, 1) << 4 * axis << std::uint8_t{7} << std::uint32_t{1};
  fast << std::uint8_t{0} << std::uint32_t{12} << std::uint32_t{12} << sequence(points) << std::uint8_t{1};
  EXPECT_EQ(cloud(5.5).bytes, fast.all());

  const auto bag = io::open_bag({write_bag(write_clouds(), "a.db3", "poses=tf scans=1")});
  std::vector<std::string> written;
  bag->read_all([&](const io::BagMessage& message) { written.emplace_back(message.bytes); }, nullptr);
  ASSERT_EQ(written.size(), 2U);
  FastCdr transform;
  transform << std::uint32_t{1} << std::int32_t{1700000000} << std::uint32_t{0} << std::string("map")
            << std::string("lidar") << 0.0 << -0.3 << 1.0 / 3 << 0.0 << std::sin(0.1) * 0.6
            << std::sin(0.1) * 0.8 << std::cos(0.1);
  EXPECT_EQ(written[0], transform.all());
}

TEST(Messages, AreReadInEitherByteOrder) {
  FastCdr big(cdr::Cdr::BIG_ENDIANNESS);
  big << std::int32_t{5} << std::uint32_t{7} << std::string("/map");
  for (const double value : {1., 2., 3., 0., 0., 0., 1.}) big << value;
  const auto pose = io::read_pose_message(*io::message_reader(big.all(), MessageEncoding::cdr),
                                          "geometry_msgs/PoseStamped");
  EXPECT_EQ(pose.header.stamp_ns, 5000000007);
  EXPECT_EQ(pose.header.frame, "map");
  EXPECT_EQ(pose.translation, Eigen::Vector3d(1, 2, 3));
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
