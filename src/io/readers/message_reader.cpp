#include "io/readers/message_reader.hpp"

#include "io/readers/bounded_file.hpp"

#include <bit>
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <stdexcept>

namespace octosurf::io {
namespace {

namespace cdr = eprosima::fastcdr;

/// ROS 2's, of either byte order.
class CdrReader : public MessageReader {
 public:
  explicit CdrReader(std::string_view bytes)
      : size_(bytes.size()),
        buffer_(const_cast<char*>(bytes.data()), bytes.size()),  // read only
#if FASTCDR_VERSION_MAJOR >= 2
        cdr_(buffer_, cdr::Cdr::DEFAULT_ENDIAN, cdr::CdrVersion::XCDRv1)
#else
        cdr_(buffer_, cdr::Cdr::DEFAULT_ENDIAN, cdr::Cdr::DDS_CDR)
#endif
  {
    // Little-endian or big-endian plain CDR; the other encapsulations are parameter lists.
    if (bytes.size() < 4 || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
      fail_reading(bytes.starts_with("\x28\xb5\x2f\xfd")
                       ? "compressed message by message (unpack the bag by ros2 bag convert)"
                       : "not CDR as ROS 2 writes it");
    checked([&] { cdr_.read_encapsulation(); });
  }

  std::uint8_t u8() override { return number<std::uint8_t>(); }
  std::uint32_t u32() override { return number<std::uint32_t>(); }
  std::uint64_t u64() override { return number<std::uint64_t>(); }
  double f64() override { return number<double>(); }
  std::string text() override {
    std::string value;
    checked([&] { cdr_ >> value; });
    return value;
  }
  std::string_view bytes() override {
    const std::uint32_t size = u32();
    if (size > left()) fail_reading("ends too early");
#if FASTCDR_VERSION_MAJOR >= 2
    const char* begin = cdr_.get_current_position();
#else
    const char* begin = cdr_.getCurrentPosition();
#endif
    checked([&] {
      if (!cdr_.jump(size)) fail_reading("ends too early");
    });
    return {begin, size};
  }
  bool numbers_headers() const override { return false; }
  std::size_t left() const override {
#if FASTCDR_VERSION_MAJOR >= 2
    return size_ - cdr_.get_serialized_data_length();
#else
    return size_ - cdr_.getSerializedDataLength();
#endif
  }

 private:
  template <class Number>
  Number number() {
    Number value{};
    checked([&] { cdr_ >> value; });
    return value;
  }
  template <class Work>
  static void checked(const Work& work) {
    try {
      work();
    } catch (const cdr::exception::Exception&) {
      fail_reading("ends too early");
    }
  }

  std::size_t size_;
  cdr::FastBuffer buffer_;
  cdr::Cdr cdr_;
};

/// ROS 1's: little-endian, nothing aligned.
class PackedReader : public MessageReader {
 public:
  explicit PackedReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint8_t u8() override {
    return checked([&] { return bytes_.u8(); });
  }
  std::uint32_t u32() override {
    return checked([&] { return bytes_.u32(); });
  }
  std::uint64_t u64() override {
    return checked([&] { return bytes_.u64(); });
  }
  double f64() override { return std::bit_cast<double>(u64()); }
  std::string text() override { return std::string(bytes()); }
  std::string_view bytes() override {
    return checked([&] { return bytes_.text(); });
  }
  bool numbers_headers() const override { return true; }
  std::size_t left() const override { return bytes_.rest().size(); }

 private:
  template <class Work>
  static auto checked(const Work& work) -> decltype(work()) {
    try {
      return work();
    } catch (const std::out_of_range&) {
      fail_reading("ends too early");
    }
  }

  RecordBytes bytes_;
};

}  // namespace

std::unique_ptr<MessageReader> message_reader(std::string_view bytes, MessageEncoding encoding) {
  if (encoding == MessageEncoding::cdr) return std::make_unique<CdrReader>(bytes);
  if (encoding == MessageEncoding::ros1) return std::make_unique<PackedReader>(bytes);
  fail_reading("is not serialised as ROS 1 or ROS 2 do");
}

}  // namespace octosurf::io
