#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace octosurf::io {

class MessageWriter;

/// A function of the writer. Excludes Eigen types: their operator() accepts any argument.
template <class Value>
concept WritesItself =
    (!requires { typename Value::Scalar; }) && std::is_invocable_v<const Value&, MessageWriter&>;

/// Serialises a ROS message field by field, in the order of its definition: XCDR1, little-endian.
class MessageWriter {
 public:
  /// Of the types that messages have: others do not convert to it.
  using Number = std::variant<double, float, std::uint32_t, std::int32_t, std::uint16_t, std::uint8_t,
                              std::uint64_t, bool>;

  void begin_list(std::size_t size);
  void write(Number value);
  void write(std::string_view value);
  void write(std::span<const float> list);
  void write(const char* value) { write(std::string_view(value)); }  // not its address, which would be a bool
  /// geometry_msgs/Point, Vector3.
  void write(const Eigen::Vector3d& point);
  /// geometry_msgs/Pose.
  void write(const Eigen::Isometry3d& pose);
  template <class Element>
  void write(const std::vector<Element>& list) {
    begin_list(list.size());
    for (const Element& element : list) write(element);
  }

  /// Of fields: name, value, name, value, …, where a value is one that write() takes, or that writes itself.
  template <class Value, class... More>
  void message(const char* /*name*/, const Value& value, const More&... more) {
    if constexpr (WritesItself<Value>)
      value(*this);
    else
      write(value);
    if constexpr (sizeof...(more) > 0) message(more...);
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// A field's value that is a message of these fields, in the same expression.
template <class... Fields>
auto message_of(const Fields&... fields) {
  return [&fields...](MessageWriter& out) { out.message(fields...); };
}

/// A field's value as `write` writes it.
template <class Value, class Write>
auto one(const Value& value, Write write) {
  return [&value, write](MessageWriter& out) { write(out, value); };
}

/// A field's value that is a list: `write` takes the writer and an element, or what it points to.
template <class List, class Write>
auto each(const List& list, Write write) {
  return [&list, write](MessageWriter& out) {
    out.begin_list(list.size());
    for (const auto& element : list)
      if constexpr (std::is_invocable_v<Write, MessageWriter&, decltype(element)>)
        write(out, element);
      else
        write(out, *element);
  };
}

/// The message as ROS 2 serialises it: XCDR1, little-endian, behind its encapsulation header.
std::string cdr_of(const std::function<void(MessageWriter&)>& message);

}  // namespace octosurf::io
