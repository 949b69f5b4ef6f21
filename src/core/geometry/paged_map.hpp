#pragma once

#include "geometry/voxel_key.hpp"
#include "memory/page_file.hpp"

#include <boost/container/vector.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::geometry {

/// Keeps 4 × 4 × 4 neighbours (of cells on a plane 4 × 4) in 64 buckets beside each other, which is a page or
/// two: who works at a place touches the pages of its neighbourhood only.
struct PlaceHash {
  std::size_t operator()(std::uint64_t k) const {
    constexpr std::uint64_t low = 0x000300030003;  // two bits of each coordinate, or of a cell's two
    const std::size_t group = PackedKeyHash()(k & ~low);
    const std::uint64_t place = (k & 3) | (k >> 14 & 0xc) | (k >> 28 & 0x30);
    // Odd, so that each place has a bucket, and far from a power of two, so that rows are spread over them.
    return (group & ~std::size_t{63}) | ((group + 37 * place) & 63);
  }
};

/// By packed key of a place, of what grows with a map.
template <class T>
using PagedMap = tsl::robin_map<std::uint64_t, T, PlaceHash, std::equal_to<std::uint64_t>,
                                memory::PagedAllocator<std::pair<std::uint64_t, T>>>;
/// Of fewer than 2³² elements: with its allocator no larger than a std::vector, as there is one at each
/// place.
template <class T>
using PagedSequence = boost::container::vector<
    T, memory::PagedAllocator<T>,
    boost::container::vector_options_t<boost::container::stored_size<std::uint32_t>,
                                       boost::container::growth_factor<boost::container::growth_factor_100>>>;

}  // namespace octosurf::geometry
