#include "io/exporters/message_writer.hpp"

#include "io/new_file.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
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
  void write(std::span<const float> list) override { put_list(list); }
  void write(std::span<const std::int8_t> list) override { put_list(list); }

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

  template <class One>
  void put_list(std::span<const One> list) {
    open('[');
    for (const One value : list) put(value);
    close(']');
  }

  std::ostream& out_;
  bool first_ = true;  // of a message or list; or the value of a field
};

/// Values in sequence, without names.
class CdrWriter : public MessageWriter {
 public:
  void begin_list(std::size_t size) override { put(static_cast<std::uint32_t>(size)); }
  void write(Number value) override {
    std::visit([this](auto number) { put(number); }, value);
  }
  void write(std::string_view value) override {
    put(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.append(value).push_back('\0');
  }
  void write(std::span<const float> list) override { put_list(list); }
  void write(std::span<const std::int8_t> list) override { put_list(list); }

  std::string with_head() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  /// Aligned to its size, counted from behind the head.
  template <class One>
  void put(One value) {
    static_assert(std::endian::native == std::endian::little);
    bytes_.resize((bytes_.size() + sizeof value - 1) / sizeof value * sizeof value);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class One>
  void put_list(std::span<const One> list) {
    begin_list(list.size());  // aligns them, too
    bytes_.append(reinterpret_cast<const char*>(list.data()), list.size_bytes());
  }

  std::string bytes_;
};

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
  message(writer);
  return writer.with_head();
}

void write_message(const std::function<void(MessageWriter&)>& message, const std::filesystem::path& file,
                   bool force) {
  const std::string ending = ending_of(file);
  if (ending != ".json" && ending != ".cdr")
    throw Error(Error::Kind::usage, file.string(), "is neither JSON nor CDR by its ending",
                "end the name in .json or .cdr");
  write_file(file, force, [&](std::ostream& out) {
    if (ending == ".cdr") return void(out << cdr_of(message));
    JsonWriter writer(out);
    message(writer);
    out << '\n';
  });
}

}  // namespace octosurf::io
