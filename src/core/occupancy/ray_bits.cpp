#include "occupancy/ray_bits.hpp"

#include "geometry/interruption.hpp"
#include "geometry/morton.hpp"
#include "geometry/parallel.hpp"
#include "occupancy/walk_lanes.hpp"

#include <algorithm>

namespace octosurf::occupancy {

void RayBits::clear() {
  if (unfinished_) *this = RayBits();
  for (const TouchedBlock& block : blocks_) {
    std::fill_n(block.misses, 8, 0);
    if (block.hit) std::fill_n(block.hits, 8, 0);
  }
  blocks_.clear();
  strays_.clear();
}

void RayBits::set_core(const GridOrigin& from, std::span<const GridRay> rays) {
  for (std::size_t a = 0; a < 3; ++a) core_.low[a] = core_.high[a] = from.key[a];
  for (const GridRay& ray : rays)
    for (std::size_t a = 0; a < 3; ++a) {
      core_.low[a] = std::min(core_.low[a], int{ray.key[a]});
      core_.high[a] = std::max(core_.high[a], int{ray.key[a]});
    }
  std::array<unsigned, 3> bits;
  for (std::size_t a = 0; a < 3; ++a) bits[a] = BlockAddress::bits_for(core_.low[a], core_.high[a]);
  while (bits[0] + bits[1] + bits[2] > core_bits) {
    const auto widest = static_cast<std::size_t>(std::max_element(bits.begin(), bits.end()) - bits.begin());
    const int half = (1 << --bits[widest]) / 2 - 8;
    core_.low[widest] = std::max(core_.low[widest], from.key[widest] - half);
    core_.high[widest] = std::min(core_.high[widest], from.key[widest] + half);
  }
  for (std::size_t a = 0; a < 3; ++a) {  // of a block all or nothing: it is listed once
    core_.low[a] &= ~7;
    core_.high[a] |= 7;
  }
  address_.fit(core_);
  paged_ = address_.size_bits > small_bits;
}

void RayBits::walk(Marks& marks, const GridOrigin& from, std::span<const GridRay> rays) const {
  marks.misses.reserve(std::size_t{1} << (address_.size_bits - 6));
  if (paged_) marks.pages.assign(std::size_t{1} << (address_.size_bits - 15), 0);
  marks.slow.clear();
  const std::uint64_t start = address_.of(from.key[0], from.key[1], from.key[2]);
  LaneWalker walker({marks.misses.data(), paged_ ? marks.pages.data() : nullptr, address_.mask}, start);
  auto next = [&, i = std::size_t{0}](GridWalk& out) mutable {
    while (i < rays.size()) {
      if (i % 64 == 0) geometry::end_if_interrupted();
      const GridRay& ray = rays[i++];
      if (ray.key == from.key) continue;  // within the sensor's own voxel: OctoMap frees no voxel
      out = GridWalk(ray, from);
      if (core_.holds(ray.key) && (ray.to_centre || out.ends_clearly(ray, from))) return true;
      marks.slow.push_back(&ray);
    }
    return false;
  };
  walker.run(next);
}

std::uint64_t* RayBits::stray_word(const std::array<std::uint16_t, 3>& key, bool hit) {
  if (core_.holds(key)) {
    const std::uint64_t address = address_.of(key[0], key[1], key[2]);
    if (paged_) marks_[0].pages[address >> 15] = 1;
    return (hit ? hits_ : marks_[0].misses).data() + (address >> 6);
  }
  const std::uint64_t morton = geometry::morton_of(key[0], key[1], key[2]);
  return strays_[morton >> 9].data() + (hit ? 8 : 0) + (morton >> 6 & 7);
}

/// OctoMap's loop as it stands, with its stopping rule by length.
void RayBits::walk_slowly(const GridOrigin& from, const GridRay& ray) {
  geometry::end_if_interrupted();
  GridWalk walk(ray, from);
  std::array<std::uint16_t, 3> key = from.key, brick{};
  std::uint64_t* word = nullptr;
  const auto mark = [&] {
    const std::array<std::uint16_t, 3> now{static_cast<std::uint16_t>(key[0] >> 2),
                                           static_cast<std::uint16_t>(key[1] >> 2),
                                           static_cast<std::uint16_t>(key[2] >> 2)};
    if (word == nullptr || now != brick) word = stray_word(key, false);
    brick = now;
    *word |= std::uint64_t{1} << (geometry::morton_of(key[0] & 3U, key[1] & 3U, key[2] & 3U));
  };
  mark();
  for (;;) {
    const std::size_t a = walk.next_axis();
    key[a] = static_cast<std::uint16_t>(key[a] + walk.sign[a]);
    walk.t[a] += walk.dt[a];
    if (key == ray.key || std::min({walk.t[0], walk.t[1], walk.t[2]}) > walk.length) return;
    mark();
  }
}

/// Hits are marked as misses too, so that every touched block shows in the misses.
void RayBits::mark_hits(std::span<const GridRay> rays) {
  hits_.reserve(std::size_t{1} << (address_.size_bits - 6));
  for (const GridRay& ray : rays) {
    if (!ray.hit) continue;
    const std::uint64_t bit = std::uint64_t{1}
                              << geometry::morton_of(ray.key[0] & 3U, ray.key[1] & 3U, ray.key[2] & 3U);
    *stray_word(ray.key, true) |= bit;
    *stray_word(ray.key, false) |= bit;
  }
}

void RayBits::add_block(std::uint64_t morton, std::uint64_t* misses, std::uint64_t* hits) {
  std::uint64_t any = 0;
  for (unsigned w = 0; w < 8; ++w) {
    misses[w] &= ~hits[w];
    any |= hits[w];
  }
  blocks_.push_back({morton, misses, hits, any != 0});
}

void RayBits::collect_block(unsigned x, unsigned y, unsigned z, int threads) {
  const std::uint64_t word = address_.of(8 * x, 8 * y, 8 * z) >> 6;
  std::uint64_t* misses = marks_[0].misses.data() + word;
  for (int t = 1; t < threads; ++t) {
    std::uint64_t* others = marks_[static_cast<std::size_t>(t)].misses.data() + word;
    for (unsigned w = 0; w < 8; ++w) {
      misses[w] |= others[w];
      others[w] = 0;
    }
  }
  std::uint64_t any = 0;
  for (unsigned w = 0; w < 8; ++w) any |= misses[w];
  if (any == 0) return;
  add_block(geometry::morton_of(x, y, z), misses, hits_.data() + word);
}

/// Blocks below the cube of 2^level blocks at (x, y, z), in Morton order.
void RayBits::collect(unsigned level, unsigned x, unsigned y, unsigned z, int threads) {
  const std::array<unsigned, 3> corner{x, y, z};
  for (std::size_t a = 0; a < 3; ++a)
    if (static_cast<int>(corner[a] + (1U << level)) <= core_.low[a] >> 3 ||
        static_cast<int>(corner[a]) > core_.high[a] >> 3)
      return;
  if (level == 0) return collect_block(x, y, z, threads);
  if (level == 2 && paged_) {
    const std::uint64_t page = address_.of(8 * x, 8 * y, 8 * z) >> 15;
    bool met = false;
    for (int t = 0; t < threads; ++t) met |= marks_[static_cast<std::size_t>(t)].pages[page] != 0;
    if (!met) return;
  }
  const unsigned half = 1U << (level - 1);
  for (unsigned c = 0; c < 8; ++c)
    collect(level - 1, x + (c & 1 ? half : 0), y + (c & 2 ? half : 0), z + (c & 4 ? half : 0), threads);
}

void RayBits::collect_strays() {
  if (strays_.empty()) return;
  for (auto& [morton, block] : strays_) add_block(morton, block.data(), block.data() + 8);
  std::sort(blocks_.begin(), blocks_.end(),
            [](const TouchedBlock& a, const TouchedBlock& b) { return a.morton < b.morton; });
}

std::span<const TouchedBlock> RayBits::trace(const GridOrigin& from, std::span<const GridRay> rays,
                                             int threads) {
  clear();
  unfinished_ = true;
  set_core(from, rays);
  // A further thread needs enough rays to pay for its own bits and its start.
  threads = std::clamp(static_cast<int>(rays.size() / 256), 1, std::min(threads, 16));
  if (marks_.size() < static_cast<std::size_t>(threads)) marks_.resize(static_cast<std::size_t>(threads));
  geometry::in_parallel(threads, [&](int t) {
    const geometry::Share share(rays.size(), t, threads);
    walk(marks_[static_cast<std::size_t>(t)], from, rays.subspan(share.begin, share.end - share.begin));
  });
  for (int t = 0; t < threads; ++t)
    for (const GridRay* ray : marks_[static_cast<std::size_t>(t)].slow) walk_slowly(from, *ray);
  mark_hits(rays);
  collect(13, 0, 0, 0, threads);
  collect_strays();
  unfinished_ = false;
  return blocks_;
}

}  // namespace octosurf::occupancy
