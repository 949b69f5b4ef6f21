#pragma once

#include "geometry/page_file.hpp"
#include "geometry/voxel_key.hpp"

#include <cstdint>
#include <functional>
#include <tsl/robin_map.h>
#include <utility>
#include <vector>

namespace octosurf::geometry {

/// By packed key of a place, and sequences, of what grows with a map.
template <class T>
using PagedMap = tsl::robin_map<std::uint64_t, T, PackedKeyHash, std::equal_to<std::uint64_t>,
                                PagedAllocator<std::pair<std::uint64_t, T>>>;
template <class T>
using PagedSequence = std::vector<T, PagedAllocator<T>>;

}  // namespace octosurf::geometry
