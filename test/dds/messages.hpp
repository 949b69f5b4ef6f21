// Messages as JSON, by their definitions in ros/dds/idl and ros/octosurf_msgs.
#pragma once

#include "io/cdr_bytes.hpp"
#include "io/ros_messages.hpp"
#include "support/paths.hpp"

#include <cstdlib>
#include <fstream>
#include <limits>
#include <regex>
#include <unistd.h>

namespace octosurf::test {

using ros::Json;

/// Adds a file's structs, with types as .msg files have them.
inline void read_idl(std::istream& in, ros::Types& types) {
  static const std::map<std::string, std::string> plain{
      {"boolean", "bool"},          {"octet", "uint8"},
      {"unsigned short", "uint16"}, {"long", "int32"},
      {"unsigned long", "uint32"},  {"long long", "int64"},
      {"float", "float32"},         {"unsigned long long", "uint64"},
      {"double", "float64"},        {"string<256", "string"}};
  std::string text;
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with('#')) text += line.substr(0, line.find("//")) + ' ';
  std::vector<std::string> scope;
  const std::regex part(R"(\s*([^;{}]*?)\s*([;{}]))"), field(R"((sequence<)?(.*?)(>)? (\w+)(\[\d+\])?)");
  for (std::sregex_iterator found(text.begin(), text.end(), part), end; found != end; ++found) {
    const std::string words = found->str(1);
    std::smatch match;
    if (found->str(2) == "{") {
      scope.push_back((scope.empty() ? "" : scope.back() + "::") + words.substr(words.find(' ') + 1));
      if (words.starts_with("struct ")) types[scope.back()];
    } else if (found->str(2) == "}") {
      scope.pop_back();
    } else if (std::regex_match(words, match, field)) {
      const auto known = plain.find(match[2]);
      types[scope.back()].emplace_back(match[4], (known == plain.end() ? match.str(2) : known->second) +
                                                     (match[1].matched ? "[]" : match.str(5)));
    }
  }
}

/// All types, by DDS's names.
inline const ros::Types& dds_types() {
  static const ros::Types types = [] {
    ros::Types all;
    const std::string idl = paths::source() + "/ros/dds/idl/",
                      made = "/tmp/octosurf_msgs." + std::to_string(getpid()) + ".idl";
    EXPECT_EQ(std::system(("python3 -B " + idl + "make_idl.py " + made).c_str()), 0);
    for (const std::string& file : {idl + "ros2.idl", made}) {
      std::ifstream in(file);
      read_idl(in, all);
    }
    unlink(made.c_str());
    return all;
  }();
  return types;
}

inline void encode(CdrBytes& out, const std::string& type, const Json& value) {
  if (ros::with_number(
          type, [&]<class Number>(Number zero) { out.number(value.is_null() ? zero : value.get<Number>()); }))
    return;
  if (type == "string") {
    out.text(value.is_null() ? "" : value.get<std::string>());
  } else if (type == "uint8[]") {
    out.bytes(value.is_null() ? "" : value.get<std::string>());
  } else if (const std::size_t list = type.find('['); list != std::string::npos) {
    std::size_t size = value.size();
    if (type.ends_with("[]"))
      out.u32(static_cast<std::uint32_t>(size));
    else
      size = std::stoul(type.substr(list + 1));
    const std::string of = type.substr(0, list);
    for (std::size_t i = 0; i < size; ++i)
      if (of == "float32" && !value.is_null() && value.at(i).is_null())
        out.number(std::numeric_limits<float>::quiet_NaN());  // as ros::decode() reads it
      else
        encode(out, of, value.is_null() ? Json() : value.at(i));
  } else {
    for (const auto& [name, of] : dds_types().at(type))
      encode(out, of, value.contains(name) ? value.at(name) : Json());
  }
}

/// "sensor_msgs::msg::dds_::Image_" for "sensor_msgs/Image"; "Save_Request" is a service's.
inline std::string dds_name(const std::string& type) {
  const std::size_t slash = type.find('/');
  if (slash == std::string::npos) return "octosurf_msgs::srv::dds_::" + type + "_";
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

/// What is missing is zero or empty.
inline std::string encoded(const std::string& type, const Json& message) {
  CdrBytes out;
  encode(out, dds_name(type), message);
  return out.all();
}

inline Json decoded(const std::string& type, const std::string& cdr) {
  ros::CdrReader in(cdr);
  Json message = ros::decode(in, dds_name(type), dds_types());
  EXPECT_LT(in.left(), 4U) << type;  // what RTPS fills up
  return message;
}

}  // namespace octosurf::test
