#include "io/exporters/message_writer.hpp"

#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <new>
#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

/// Writes incrementally, so that a grid of millions of cells needs no document in memory.
class JsonWriter : public MessageWriter {
 public:
  explicit JsonWriter(std::ostream& out) : out_(out) {}

  void begin_message() override { open('{'); }
  void end_message() override { close('}'); }
  void field(const char* name) override {
    separate();
    out_ << '"' << name << "\":";
    first_ = true;
  }
  void begin_list(std::size_t) override { open('['); }
  void end_list() override { close(']'); }
  void write(Number value) override {
    std::visit([this](auto number) { put(number); }, value);
  }
  void write(std::string_view value) override {
    separate();
    // A frame's name may come from a command line or a bag: invalid UTF-8 must not stop the export.
    out_ << nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  void write(std::span<const float> list) override {
    begin_list(list.size());
    for (const float value : list) put(value);
    end_list();
  }
  void write(std::span<const std::int8_t> list) override {
    begin_list(list.size());
    for (const int value : list) put(value);
    end_list();
  }

 private:
  void separate() {
    if (!first_) out_ << ',';
    first_ = false;
  }
  void open(char bracket) {
    separate();
    out_ << bracket;
    first_ = true;
  }
  void close(char bracket) {
    out_ << bracket;
    first_ = false;
  }
  template <class One>
  void put(One value) {
    separate();
    if constexpr (std::is_same_v<One, bool>) {
      out_ << (value ? "true" : "false");
    } else if (std::isnan(static_cast<double>(value))) {
      out_ << "null";
    } else {
      std::array<char, 32> text{};
      const char* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
      out_.write(text.data(), end - text.data());
    }
  }

  std::ostream& out_;
  bool first_ = true;  // of a message or list; or the value of a field
};

namespace cdr = eprosima::fastcdr;

/// Values in sequence, without names.
class CdrWriter : public MessageWriter {
 public:
  CdrWriter()
      :
#if FASTCDR_VERSION_MAJOR >= 2  // Ubuntu and Debian after 2023; the bytes are the same
        cdr_(buffer_, cdr::Cdr::LITTLE_ENDIANNESS, cdr::CdrVersion::XCDRv1)
#else
        cdr_(buffer_, cdr::Cdr::LITTLE_ENDIANNESS, cdr::Cdr::DDS_CDR)
#endif
  {
#if FASTCDR_VERSION_MAJOR >= 2
    cdr_.set_encoding_flag(cdr::EncodingAlgorithmFlag::PLAIN_CDR);
#endif
    cdr_.serialize_encapsulation();
  }

  void begin_message() override {}
  void end_message() override {}
  void field(const char*) override {}
  void begin_list(std::size_t size) override { put(static_cast<std::uint32_t>(size)); }
  void end_list() override {}
  void write(Number value) override {
    std::visit([this](auto number) { put(number); }, value);
  }
  void write(std::string_view value) override {
    pad_to(sizeof(std::uint32_t));  // its length stands first
    cdr_ << std::string(value);
  }
  void write(std::span<const float> list) override { put_list(list); }
  void write(std::span<const std::int8_t> list) override { put_list(list); }

  std::span<const char> bytes() const {
#if FASTCDR_VERSION_MAJOR >= 2
    return {buffer_.getBuffer(), cdr_.get_serialized_data_length()};
#else
    return {buffer_.getBuffer(), cdr_.getSerializedDataLength()};
#endif
  }

 private:
  /// Fast CDR skips alignment bytes without writing them, which would leave uninitialised memory.
  void pad_to(std::size_t alignment) {
    constexpr std::size_t encapsulation = 4;  // not counted in the alignment
    while ((bytes().size() - encapsulation) % alignment != 0) cdr_ << '\0';
  }
  template <class One>
  void put(One value) {
    pad_to(sizeof value);
    cdr_ << value;
  }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  template <class One>
  void put_list(std::span<const One> list) {
    begin_list(list.size());
    if (!list.empty()) pad_to(sizeof(One));
#if FASTCDR_VERSION_MAJOR >= 2
    cdr_.serialize_array(list.data(), list.size());
#else
    cdr_.serializeArray(list.data(), list.size());
#endif
  }

  cdr::FastBuffer buffer_;
  cdr::Cdr cdr_;
};

void write_json(const std::function<void(MessageWriter&)>& message, std::ostream& out) {
  JsonWriter writer(out);
  message(writer);
  out << '\n';
}

}  // namespace

void MessageWriter::write(const Eigen::Vector3d& point) {
  message("x", point.x(), "y", point.y(), "z", point.z());
}

void MessageWriter::write(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  message("position", Eigen::Vector3d(pose.translation()), "orientation",
          message_of("x", turn.x(), "y", turn.y(), "z", turn.z(), "w", turn.w()));
}

std::string cdr_of(const std::function<void(MessageWriter&)>& message) {
  CdrWriter writer;
  try {
    message(writer);
  } catch (const cdr::exception::NotEnoughMemoryException&) {
    throw std::bad_alloc();
  }
  return {writer.bytes().begin(), writer.bytes().end()};
}

void write_message(const std::function<void(MessageWriter&)>& message, const std::filesystem::path& file,
                   bool force) {
  const std::string ending = ending_of(file);
  if (ending != ".json" && ending != ".cdr")
    throw Error(Error::Kind::usage, file.string(), "is neither JSON nor CDR by its ending",
                "end the name in .json or .cdr");
  NewFile output(file, force);
  output.write([&](std::ostream& out) {
    if (ending == ".cdr")
      out << cdr_of(message);
    else
      write_json(message, out);
  });
  output.commit();
}

}  // namespace octosurf::io
