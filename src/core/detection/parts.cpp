#include "detection/parts.hpp"

#include "detection/voxel_blocks.hpp"
#include "geometry/parallel.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::detection {
namespace {

/// Effort, points: smaller parts are put together, since each reads the blocks around it. A part of a
/// sixteenth keeps sixteen threads busy.
constexpr std::size_t smallest_part = 2000;
constexpr std::size_t most_parts = 16;

/// Cubes that touch, by union-find.
class TouchingCubes {
 public:
  explicit TouchingCubes(int edge) : cubes_(edge) {}

  std::size_t add(geometry::VoxelKey key) {
    const auto [at, fresh] = index_.try_emplace(cubes_.of(key), sets_.size());
    if (fresh) sets_.add();
    return at->second;
  }
  void join(std::size_t a, std::size_t b) { sets_.join(a, b); }
  void join_adjacent() {
    for (const auto& [place, at] : index_)
      for (std::uint64_t k = 0; k < 13; ++k) {  // half of those around: each pair once
        constexpr std::uint64_t y = 1 << 16, z = y << 16, before = z + y + 1;
        const std::uint64_t near = place - before + k % 3 + k / 3 % 3 * y + k / 9 * z;
        if (const auto other = index_.find(near); other != index_.end()) sets_.join(at, other->second);
      }
  }
  std::size_t root(std::size_t at) { return sets_.root(at); }

 private:
  VoxelBlocks cubes_;
  geometry::DisjointSets sets_;
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> index_;
};

std::vector<geometry::VoxelKey> keys_of(const surfaces::MapView& map, const std::vector<PointId>& points) {
  std::vector<geometry::VoxelKey> keys;
  for (const PointId i : points) keys.push_back(map.window[i].key);
  return keys;
}

std::vector<PointId> points_at(const surfaces::MapView& map, const std::vector<geometry::VoxelKey>& keys) {
  std::vector<PointId> points;
  for (const geometry::VoxelKey key : keys) points.push_back(map.window.find(key));
  return points;
}

}  // namespace

std::vector<Part> divided(const surfaces::MapView& map, const Part& part) {
  std::size_t all = part.points.size() + part.gained.size();
  for (const SurfaceId id : part.surfaces) all += map.surfaces.find(id)->size();
  if (all < 2 * smallest_part) return all == 0 ? std::vector<Part>() : std::vector{part};
  const double h = map.parameters.max_hole_size() / map.grid.resolution();
  TouchingCubes cubes(static_cast<int>(std::ceil(h - 1e-9)) + (1 << map.cells.map().level));
  struct Item {
    std::size_t cube, size;
  };
  std::vector<Item> items;  // points, surfaces, and gained points
  for (const PointId i : part.points) items.push_back({cubes.add(map.window[i].key), 1});
  for (const SurfaceId id : part.surfaces) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    std::optional<std::size_t> cube;  // of one inlier
    surface.for_each_inlier([&](const surfaces::Inlier& inlier) {
      const std::size_t at = cubes.add(inlier.key);
      cube ? cubes.join(*cube, at) : void(cube = at);
    });
    items.push_back({*cube, surface.size()});
  }
  for (const PointId i : part.gained) items.push_back({cubes.add(map.window[i].key), 1});
  cubes.join_adjacent();

  std::map<std::size_t, std::size_t> sizes, place;  // by root
  for (auto& [cube, size] : items) sizes[cube = cubes.root(cube)] += size;
  const std::size_t least = std::max(smallest_part, all / most_parts);
  struct SizedPart {
    std::size_t size = 0;
    Part part;
  };
  std::vector<SizedPart> sized;
  std::optional<std::size_t> open;  // takes small parts
  for (const Item& item : items) {
    const bool small = sizes[item.cube] < least;
    const auto [at, fresh] = place.try_emplace(item.cube, small && open ? *open : sized.size());
    if (!fresh) continue;
    if (at->second == sized.size()) sized.emplace_back();
    sized[at->second].size += sizes[item.cube];
    if (small) open = sized[at->second].size < least ? std::optional(at->second) : std::nullopt;
  }
  auto item = items.begin();
  const auto next = [&]() -> Part& { return sized[place[item++->cube]].part; };
  for (const PointId i : part.points) next().points.push_back(i);
  for (const SurfaceId id : part.surfaces) next().surfaces.push_back(id);
  for (const PointId i : part.gained) next().gained.push_back(i);
  std::ranges::stable_sort(sized, std::greater{}, &SizedPart::size);
  std::vector<Part> parts;
  for (SizedPart& one : sized) parts.push_back(std::move(one.part));
  return parts;
}

void look_at_parts(const surfaces::MapView& map, const std::vector<Part>& parts, int threads,
                   const LookAtPart& look) {
  struct Keys {
    std::vector<geometry::VoxelKey> points, gained;
  };
  std::vector<Keys> keys;  // taken before thread 0 loads more into the map's window
  if (threads > 1 && parts.size() > 1)
    for (const Part& part : parts) keys.push_back({keys_of(map, part.points), keys_of(map, part.gained)});
  map.for_threads.prepare(threads);
  geometry::share_among(threads, parts.size(), [&](std::size_t k, int thread) {
    const surfaces::MapView& view = map.for_threads.of(thread);
    thread == 0 ? look(k, view, parts[k])
                : look(k, view,
                       {points_at(view, keys[k].points), parts[k].surfaces, points_at(view, keys[k].gained)});
  });
}

void JointProposal::add(const Proposal& part, const occupancy::PointWindow& from) {
  const auto before = static_cast<Proposal::Label>(joint_.planes.size() - 1);
  const auto into = [&](Proposal::Label label) { return label == 0 ? 0 : label + before; };
  const auto here = [&](PointId i) { return &from == &map_.window ? i : map_.window.find(from[i].key); };
  joint_.planes.insert(joint_.planes.end(), std::next(part.planes.begin()), part.planes.end());
  while (planes_.size() < joint_.planes.size()) planes_.add();
  for (const auto& [point, label] : part.points)
    if (const PointId i = here(point); labelled_.insert(i)) joint_.points.push_back({i, into(label)});
  for (const Proposal::Rest& rest : part.rest) {
    const auto [at, fresh] = goes_on_.try_emplace(rest.surface, into(rest.label));
    if (fresh || rest.label == 0) continue;
    at->second == 0 ? void(at->second = into(rest.label)) : planes_.join(at->second, into(rest.label));
  }
  for (const PointId i : part.unprocessed) joint_.unprocessed.push_back(here(i));
  for (const std::vector<PointId>& patch : part.curved) {
    std::vector<PointId>& points = joint_.curved.emplace_back();
    for (const PointId i : patch) points.push_back(here(i));
  }
}

Proposal JointProposal::take() && {
  std::map<SurfaceId, std::size_t> inside;
  std::vector<std::size_t> sizes(joint_.planes.size(), 0);
  for (const auto& [point, label] : joint_.points) {
    ++inside[map_.window[point].surface];
    ++sizes[planes_.root(label)];
  }
  for (const auto& [surface, label] : goes_on_) {
    const std::size_t rest = map_.surfaces.find(surface)->size() - inside[surface];
    if (rest == 0) continue;
    joint_.rest.push_back({surface, label, static_cast<double>(rest)});
    sizes[planes_.root(label)] += rest;
  }
  std::vector<Proposal::FoundPlane> planes(1);
  std::vector<Proposal::Label> into(joint_.planes.size(), 0);
  for (Proposal::Label label = 1; label < into.size(); ++label) {
    if (planes_.root(label) != label ||
        sizes[label] < static_cast<std::size_t>(map_.parameters.min_surface_points()))
      continue;
    into[label] = static_cast<Proposal::Label>(planes.size());
    planes.push_back(joint_.planes[label]);
  }
  joint_.planes = std::move(planes);
  const auto joined = [&](Proposal::Label label) { return into[planes_.root(label)]; };
  for (Proposal::Rest& rest : joint_.rest) rest.label = joined(rest.label);
  for (auto& [point, label] : joint_.points) {
    if (label != 0 && joined(label) == 0 && map_.is_pending(point)) joint_.unprocessed.push_back(point);
    label = joined(label);
  }
  return std::move(joint_);
}

}  // namespace octosurf::detection
