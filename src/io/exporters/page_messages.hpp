#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/page.hpp>

// What a page knows of a map: a message with its surfaces, and one with its voxels. A page in a file has them
// inside; a page that follows a map gets them from the server. web/src/data.js reads them.

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

/// The surfaces and cylinders as export_surfaces() writes them, without `boundary`, and what is beside them
/// in the PageMap: all, or only what changed since a revision, with these changes.
/// `run` identifies the run of these revisions. Throws Error(data) for numbers that are not finite.
PageBlock surfaces_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run = {},
                           const std::optional<MapChanges>& since = {});

/// The occupied voxels, merged as far as they must be not to exceed `most_bytes`; at last none.
std::string voxels_message(const PageMap& map, double most_bytes);

}  // namespace octosurf::io
