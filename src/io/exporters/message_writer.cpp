#include "io/exporters/message_writer.hpp"

#include <bit>

namespace octosurf::io {
namespace {

/// Aligned to its size, counted from behind the encapsulation header.
template <class One>
void put_aligned(std::string& bytes, One value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.resize((bytes.size() + sizeof value - 1) / sizeof value * sizeof value);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class One>
void put_list(std::string& bytes, std::span<const One> list) {
  put_aligned(bytes, static_cast<std::uint32_t>(list.size()));
  bytes.append(reinterpret_cast<const char*>(list.data()), list.size_bytes());
}

}  // namespace

void MessageWriter::begin_list(std::size_t size) { put_aligned(bytes_, static_cast<std::uint32_t>(size)); }

void MessageWriter::write(Number value) {
  std::visit([this](auto number) { put_aligned(bytes_, number); }, value);
}

void MessageWriter::write(std::string_view value) {
  put_aligned(bytes_, static_cast<std::uint32_t>(value.size() + 1));
  bytes_.append(value).push_back('\0');
}

void MessageWriter::write(std::span<const float> list) { put_list(bytes_, list); }

void MessageWriter::write(const Eigen::Vector3d& point) {
  message("x", point.x(), "y", point.y(), "z", point.z());
}

void MessageWriter::write(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  message("position", Eigen::Vector3d(pose.translation()), "orientation",
          message_of("x", turn.x(), "y", turn.y(), "z", turn.z(), "w", turn.w()));
}

std::string cdr_of(const std::function<void(MessageWriter&)>& message) {
  MessageWriter writer;
  message(writer);
  return std::string("\0\1\0\0", 4) + writer.bytes();
}

}  // namespace octosurf::io
