#include "readable.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

/// A field's name and unit.
std::pair<std::string, std::string> named(std::string key) {
  constexpr std::array<std::array<std::string_view, 2>, 4> units{
      {{"_m2", " m²"}, {"_m", " m"}, {"_deg", "°"}, {"_s", " s"}}};
  std::string unit;
  for (const auto& [ending, written] : units)
    if (unit.empty() && key.ends_with(ending)) {
      key.erase(key.size() - ending.size());
      unit = written;
    }
  std::ranges::replace(key, '_', ' ');
  return {key, unit};
}

std::string text_of(const Json& value) {
  if (value.is_null()) return "none";
  if (value.is_boolean()) return value ? "yes" : "no";
  if (value.is_string()) return value;
  if (value.is_number_float()) {
    const double number = value;
    if (number != 0 && std::fabs(number) < 1e-3) return io::formatted("%.3g", number);
    std::string text = io::formatted("%.4f", number);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
  }
  if (!value.is_structured()) return value.dump();
  std::string text;
  if (value.is_array()) {
    if (!value.empty() && value[0].is_structured()) return std::to_string(value.size());
    for (const Json& element : value) text += (text.empty() ? "" : " ") + text_of(element);
  } else {
    for (const auto& [key, field] : value.items()) {
      const auto [name, unit] = named(key);
      text += (text.empty() ? "" : ", ") + name + " " + text_of(field) + unit;
    }
  }
  return text.empty() ? "none" : text;
}

/// How many columns of a terminal a text takes: UTF-8's further bytes take none.
int width_of(const std::string& text) {
  return static_cast<int>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

void print_table(const std::string& name, const Json& rows) {
  std::printf("\n%s %zu\n", name.c_str(), rows.size());
  std::vector<std::vector<std::string>> lines(rows.size() + 1);
  for (const auto& [key, first] : rows[0].items()) {
    const auto [title, unit] = named(key);
    lines[0].push_back(title + unit);
    for (std::size_t i = 0; i < rows.size(); ++i) lines[i + 1].push_back(text_of(rows[i].value(key, Json())));
  }
  for (const auto& line : lines) {
    for (std::size_t column = 0; column < line.size(); ++column) {
      int wide = 0;
      for (const auto& other : lines) wide = std::max(wide, width_of(other[column]));
      std::printf("%s%*s%s", column == 0 ? "" : "  ", wide - width_of(line[column]), "",
                  line[column].c_str());
    }
    std::printf("\n");
  }
}

}  // namespace

void print_readable(const Json& answer) {
  constexpr std::size_t longest_line = 6;  // fields
  std::vector<std::pair<std::string, const Json*>> below;
  const auto has_rings = [](const Json& value) {  // of points
    return value.is_array() && !value.empty() && value[0].is_array() && !value[0].empty() &&
           value[0][0].is_array();
  };
  for (const auto& [key, value] : answer.items()) {
    const auto [name, unit] = named(key);
    const bool table = value.is_array() && !value.empty() && value[0].is_object();
    if (table || has_rings(value) || (value.is_object() && value.size() > longest_line))
      below.emplace_back(name, &value);
    else
      std::printf("%-20s %s%s\n", name.c_str(), text_of(value).c_str(), value.is_null() ? "" : unit.c_str());
  }
  for (const auto& [name, part] : below) {
    if (has_rings(*part)) {
      std::printf("\n%s %zu\n", name.c_str(), part->size());
      for (const Json& ring : *part) {
        std::string line;
        for (const Json& point : ring) line += (line.empty() ? "" : ", ") + text_of(point);
        std::printf("%s\n", line.c_str());
      }
    } else if (part->is_array()) {
      print_table(name, *part);
    } else {
      std::printf("\n%s\n", name.c_str());
      print_readable(*part);
    }
  }
}

void print_answer(const Json& answer, bool as_json) {
  if (!as_json) return print_readable(answer);
  std::printf("%s\n", answer.dump(1, ' ', false, Json::error_handler_t::replace).c_str());
}

}  // namespace octosurf
