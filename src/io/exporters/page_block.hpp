#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace octosurf::io {

/// A map's data as embedded in a page (read by web/src/block.js): the length of a JSON document in four
/// bytes, the document, padding to a multiple of four bytes, and arrays of numbers, each at a multiple of
/// four; `arrays` in the document has their types, offsets after the document, and lengths. All
/// little-endian; compressed by gzip, as base64.
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

  std::string packed() const;   ///< compressed
  std::string encoded() const;  ///< packed(), as base64

 private:
  std::string bytes_;
};

std::string gzip(std::string_view bytes);
std::string base64(std::string_view bytes);

/// Differences of consecutive numbers, modulo the type's range: small numbers compress well.
template <typename Number>
std::vector<Number> differences(const std::vector<Number>& numbers) {
  using Unsigned = std::make_unsigned_t<Number>;
  std::vector<Number> result;
  result.reserve(numbers.size());
  Unsigned last = 0;
  for (const Number number : numbers) {
    const auto value = static_cast<Unsigned>(number);
    result.push_back(static_cast<Number>(static_cast<Unsigned>(value - last)));
    last = value;
  }
  return result;
}

}  // namespace octosurf::io
