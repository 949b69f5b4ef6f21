#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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

/// Takes a ROS message field by field, in the order of its definition. One description of a message so gives
/// all its encodings.
class MessageWriter {
 public:
  /// Of the types that messages have: others do not convert to it.
  using Number = std::variant<double, float, std::uint32_t, std::int32_t, std::uint16_t, std::uint8_t,
                              std::uint64_t, bool>;

  virtual ~MessageWriter() = default;

  virtual void begin_message() {}
  virtual void end_message() {}
  virtual void field(const char* /*name*/) {}  ///< the next value written is the field's
  virtual void begin_list(std::size_t size) = 0;
  virtual void end_list() {}
  virtual void write(Number value) = 0;
  virtual void write(std::string_view value) = 0;
  virtual void write(std::span<const float> list) = 0;
  virtual void write(std::span<const std::int8_t> list) = 0;

  void write(const char* value) { write(std::string_view(value)); }  // not its address, which would be a bool
  /// geometry_msgs/Point, Vector3.
  void write(const Eigen::Vector3d& point);
  /// geometry_msgs/Pose.
  void write(const Eigen::Isometry3d& pose);
  template <class Element>
  void write(const std::vector<Element>& list) {
    begin_list(list.size());
    for (const Element& element : list) write(element);
    end_list();
  }

  /// Of values that write() takes, or that write themselves.
  template <class Value, class... More>
  void fields(const char* name, const Value& value, const More&... more) {
    field(name);
    if constexpr (WritesItself<Value>)
      value(*this);
    else
      write(value);
    if constexpr (sizeof...(more) > 0) fields(more...);
  }

  /// A message of these fields: name, value, name, value, …
  template <class... Fields>
  void message(const Fields&... all) {
    begin_message();
    fields(all...);
    end_message();
  }
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
    out.end_list();
  };
}

/// The message as ROS 2 serialises it: XCDR1, little-endian, behind its encapsulation header.
std::string cdr_of(const std::function<void(MessageWriter&)>& message);

/// Writes the message to `file`: as JSON (NaN as null) or, if it ends in .cdr, as cdr_of() gives it. Throws
/// Error(usage) for other endings and for a file that exists without `force`, Error(output) if it cannot be
/// written.
void write_message(const std::function<void(MessageWriter&)>& message, const std::filesystem::path& file,
                   bool force);

}  // namespace octosurf::io
