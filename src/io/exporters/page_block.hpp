#pragma once

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace octosurf::io {

/// A message about a map to its page (read by web/src/block.js): the length of a JSON document in four bytes,
/// the document, padding to a multiple of four bytes, and arrays of numbers, each at a multiple of four;
/// `arrays` in the document has their types, offsets after the document, and lengths. All little-endian;
/// compressed by gzip.
class PageBlock {
 public:
  using Json = nlohmann::ordered_json;
  Json json;

  template <typename Number>
  void add(const std::string& name, const std::vector<Number>& numbers) {
    static_assert(std::endian::native == std::endian::little);
    static_assert(std::is_integral_v<Number>);
    std::string type(1, std::is_signed_v<Number> ? 'i' : 'u');
    type += std::to_string(8 * sizeof(Number));
    json["arrays"][name] = {type, bytes_.size(), numbers.size()};
    const std::size_t at = bytes_.size();
    bytes_.resize(at + (numbers.size() * sizeof(Number) + 3) / 4 * 4);
    if (!numbers.empty()) std::memcpy(bytes_.data() + at, numbers.data(), numbers.size() * sizeof(Number));
  }

  /// Part of the document that is JSON already.
  void add(const std::string& name, const std::string& text) { texts_ += ",\"" + name + "\":" + text; }

  std::string document() const;
  std::string packed() const;

 private:
  std::string bytes_, texts_;
};

std::string gzip(std::string_view bytes);
std::string base64(std::string_view bytes);

}  // namespace octosurf::io
