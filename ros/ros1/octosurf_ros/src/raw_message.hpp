#pragma once

#include <cstdint>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <string>

namespace octosurf::ros1 {

/// A Message as its bytes: to publishers, and to subscribers of it, the same. The library reads them itself
/// (octosurf/ros_messages.hpp), out of bags too, so that nothing is decoded twice.
template <class Message>
struct Raw {
  std::string bytes;
};

}  // namespace octosurf::ros1

namespace ros {
namespace message_traits {

template <class Message>
struct IsMessage<octosurf::ros1::Raw<Message>> : TrueType {};
template <class Message>
struct MD5Sum<octosurf::ros1::Raw<Message>> : MD5Sum<Message> {
  static const char* value(const octosurf::ros1::Raw<Message>&) { return MD5Sum<Message>::value(); }
  static const char* value() { return MD5Sum<Message>::value(); }
};
template <class Message>
struct DataType<octosurf::ros1::Raw<Message>> : DataType<Message> {
  static const char* value(const octosurf::ros1::Raw<Message>&) { return DataType<Message>::value(); }
  static const char* value() { return DataType<Message>::value(); }
};
template <class Message>
struct Definition<octosurf::ros1::Raw<Message>> : Definition<Message> {
  static const char* value(const octosurf::ros1::Raw<Message>&) { return Definition<Message>::value(); }
  static const char* value() { return Definition<Message>::value(); }
};

}  // namespace message_traits

namespace serialization {

template <class Message>
struct Serializer<octosurf::ros1::Raw<Message>> {
  template <class Stream>
  static void read(Stream& stream, octosurf::ros1::Raw<Message>& message) {
    const std::uint32_t size = stream.getLength();
    message.bytes.assign(reinterpret_cast<const char*>(stream.getData()), size);
    stream.advance(size);
  }
  template <class Stream>
  static void write(Stream& stream, const octosurf::ros1::Raw<Message>& message) {
    const auto size = static_cast<std::uint32_t>(message.bytes.size());
    std::memcpy(stream.advance(size), message.bytes.data(), size);
  }
  static std::uint32_t serializedLength(const octosurf::ros1::Raw<Message>& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros
