#include "geometry/outline.hpp"

#include "geometry/rings.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>
#include <algorithm>
#include <boost/container/small_vector.hpp>
#include <numeric>
#include <tsl/robin_map.h>
#include <unordered_map>

namespace octosurf::geometry {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_2;

struct VertexMark {
  std::uint32_t sites : 30 = 0;  // number of sites with equal coordinates
  bool doomed : 1 = false;       // to be removed by this update
  bool changed : 1 = false;      // a triangle at it was added or removed by this update
  std::int32_t corner = -1;      // first of the boundary's corners here
};
using Parts =
    CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_with_info_2<VertexMark, Kernel>>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Parts>;
using Face = Delaunay::Face_handle;
using Vertex = Delaunay::Vertex_handle;

/// A passage of the boundary through a vertex, interior on the left. It depends on the triangles at the
/// vertex only, so it remains valid while they do. Every update() walks the boundary over all corners, so the
/// data for that are here and not at the vertices.
struct Corner {
  Eigen::Vector2d place;
  std::int32_t next = -1;     // corner along the boundary
  std::int32_t sibling = -1;  // next corner of the same vertex
  bool used = false, walked = false;
  bool alone = true;  // the vertex has no other corner
  Vertex at, from, to;
};

struct Site {
  Vertex vertex;
  std::uint8_t cell;
};

struct NewSite {
  std::uint64_t tile;
  std::uint8_t cell;
};

}  // namespace

struct Outline::Impl {
  explicit Impl(double a) : alpha(a) {}

  double alpha;
  Delaunay triangulation;
  tsl::robin_map<std::uint64_t, std::vector<Site>, PackedKeyHash> tiles;
  std::vector<Vertex> left;  // without any remaining site
  std::vector<NewSite> entering;
  std::vector<Point> entering_points;
  std::vector<Vertex> changed;
  std::vector<Corner> corners;
  std::vector<std::int32_t> free_corners;

  bool kept(Face face) const;
  void set(PlaneCell cell, std::span<const Eigen::Vector2d> sites);
  void note_changed(Vertex vertex);
  void note_neighbours(Vertex vertex);
  void remove_left();
  std::vector<std::size_t> order_of_entering() const;
  void insert_entering();
  void drop_corners(Vertex vertex);
  void find_corners(Vertex vertex);
  Corner& corner_at(std::int32_t index) { return corners[static_cast<std::size_t>(index)]; }
  void link_corners(Vertex vertex);
  std::vector<Ring2> trace();
  static void split(const std::vector<const Corner*>& walk, std::vector<Ring2>& loops);
};

bool Outline::Impl::kept(Face face) const {
  if (triangulation.is_infinite(face)) return false;
  for (int i = 0; i < 3; ++i)
    if (CGAL::squared_distance(face->vertex(i)->point(), face->vertex(Delaunay::ccw(i))->point()) >
        alpha * alpha)
      return false;
  return true;
}

void Outline::Impl::set(PlaneCell cell, std::span<const Eigen::Vector2d> wanted) {
  const std::uint64_t tile = CellBits::tile_of(cell).packed();
  const auto number = static_cast<std::uint8_t>(CellBits::bit_of(cell));
  boost::container::small_vector<Point, 4> coming;
  for (const Eigen::Vector2d& p : wanted) coming.emplace_back(p.x(), p.y());
  if (const auto found = tiles.find(tile); found != tiles.end()) {
    std::vector<Site>& sites = found.value();
    const auto gone = std::remove_if(sites.begin(), sites.end(), [&](const Site& site) {
      if (site.cell != number) return false;
      const auto same = std::find(coming.begin(), coming.end(), site.vertex->point());
      if (same != coming.end()) {
        coming.erase(same);
        return false;
      }
      if (--site.vertex->info().sites == 0) left.push_back(site.vertex);
      return true;
    });
    sites.erase(gone, sites.end());
    if (sites.empty()) tiles.erase(found);
  }
  for (const Point& p : coming) {
    entering.push_back({tile, number});
    entering_points.push_back(p);
  }
}

void Outline::Impl::note_changed(Vertex vertex) {
  if (vertex->info().changed || vertex->info().doomed || triangulation.is_infinite(vertex)) return;
  vertex->info().changed = true;
  changed.push_back(vertex);
}

void Outline::Impl::note_neighbours(Vertex vertex) {
  if (triangulation.dimension() < 2) return;  // update() then visits all vertices
  auto neighbour = triangulation.incident_vertices(vertex);
  const auto first = neighbour;
  do note_changed(neighbour);
  while (++neighbour != first);
}

/// Triangles that fill the hole of a removed vertex have its neighbours as corners.
void Outline::Impl::remove_left() {
  for (const Vertex vertex : left) vertex->info().doomed = true;
  for (const Vertex vertex : left) {
    note_neighbours(vertex);
    drop_corners(vertex);
    triangulation.remove(vertex);
  }
  left.clear();
}

/// The order of arrival, tile by tile, is local; but many insertions at once would make long triangles on the
/// way.
std::vector<std::size_t> Outline::Impl::order_of_entering() const {
  std::vector<std::size_t> order(entering.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (entering.empty() || entering.size() < triangulation.number_of_vertices() / 2) return order;
  using Map = CGAL::Pointer_property_map<Point>::const_type;
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_2<Kernel, Map>(
                         CGAL::make_property_map(std::as_const(entering_points))));
  return order;
}

/// Triangles made by an insertion have the new vertex as a corner, until a later one replaces them.
void Outline::Impl::insert_entering() {
  const std::size_t before = changed.size();
  Face hint;
  for (const std::size_t i : order_of_entering()) {
    std::vector<Site>& sites = tiles[entering[i].tile];
    if (!sites.empty()) hint = sites.back().vertex->face();
    const Vertex vertex = triangulation.insert(entering_points[i], hint);
    hint = vertex->face();
    sites.push_back({vertex, entering[i].cell});
    if (vertex->info().sites++ == 0) note_changed(vertex);
  }
  for (std::size_t i = before, after = changed.size(); i < after; ++i) note_neighbours(changed[i]);
  entering.clear();
  entering_points.clear();
}

void Outline::Impl::drop_corners(Vertex vertex) {
  for (std::int32_t i = vertex->info().corner; i >= 0; i = corner_at(i).sibling) {
    corner_at(i).used = false;
    free_corners.push_back(i);
  }
  vertex->info().corner = -1;
}

/// Each run of kept triangles around the vertex is one corner.
void Outline::Impl::find_corners(Vertex vertex) {
  drop_corners(vertex);
  struct Spoke {
    Vertex right, left;  // seen from the vertex
    bool kept;
  };
  boost::container::small_vector<Spoke, 16> spokes;
  std::size_t dropped = 0;
  const Face first = vertex->face();
  Face face = first;
  do {
    const int i = face->index(vertex);
    spokes.push_back({face->vertex(Delaunay::ccw(i)), face->vertex(Delaunay::cw(i)), kept(face)});
    dropped += !spokes.back().kept;
    face = face->neighbor(Delaunay::ccw(i));
  } while (face != first);
  const std::size_t n = spokes.size();
  if (dropped == 0 || dropped == n) return;
  for (std::size_t begin = 0; begin < n; ++begin) {
    if (!spokes[begin].kept || spokes[(begin + n - 1) % n].kept) continue;
    std::size_t end = begin;
    while (spokes[(end + 1) % n].kept) ++end;
    if (free_corners.empty()) {
      free_corners.push_back(static_cast<std::int32_t>(corners.size()));
      corners.emplace_back();
    }
    const std::int32_t index = free_corners.back();
    free_corners.pop_back();
    Corner& corner = corner_at(index);
    corner = {{vertex->point().x(), vertex->point().y()},
              -1,
              vertex->info().corner,
              true,
              false,
              true,
              vertex,
              spokes[end % n].left,
              spokes[begin].right};
    if (corner.sibling >= 0) corner.alone = corner_at(corner.sibling).alone = false;
    vertex->info().corner = index;
  }
}

/// Links the corners on both sides: a neighbour with unchanged triangles keeps its corners, but one of them
/// may lead to a corner here. Call after all changed vertices have their corners.
void Outline::Impl::link_corners(Vertex vertex) {
  for (std::int32_t i = vertex->info().corner; i >= 0; i = corner_at(i).sibling) {
    Corner& corner = corner_at(i);
    std::int32_t before = corner.from->info().corner, after = corner.to->info().corner;
    while (corner_at(before).to != vertex) before = corner_at(before).sibling;
    while (corner_at(after).from != vertex) after = corner_at(after).sibling;
    corner_at(before).next = i;
    corner.next = after;
  }
}

/// Cuts a closed walk into vertex-simple loops: a repeated vertex closes the loop since its first visit. Only
/// vertices with several corners can repeat.
void Outline::Impl::split(const std::vector<const Corner*>& walk, std::vector<Ring2>& loops) {
  std::vector<const Corner*> open;
  std::unordered_map<const void*, std::size_t> place;
  const auto emit = [&](std::size_t begin) {
    if (open.size() - begin < 3) return;
    Ring2& ring = loops.emplace_back();
    ring.reserve(open.size() - begin);
    for (std::size_t i = begin; i < open.size(); ++i) ring.push_back(open[i]->place);
  };
  open.reserve(walk.size());
  for (const Corner* corner : walk) {
    if (!corner->alone) {
      if (const auto seen = place.find(&*corner->at); seen != place.end()) {
        const std::size_t begin = seen->second;
        emit(begin);
        for (std::size_t i = begin; i < open.size(); ++i) place.erase(&*open[i]->at);
        open.resize(begin);
      }
      place[&*corner->at] = open.size();
    }
    open.push_back(corner);
  }
  emit(0);
}

std::vector<Ring2> Outline::Impl::trace() {
  std::vector<Ring2> loops;
  for (Corner& corner : corners) corner.walked = !corner.used;
  std::vector<const Corner*> walk;
  for (Corner& start : corners) {
    if (start.walked) continue;
    walk.clear();
    Corner* corner = &start;
    do {
      corner->walked = true;
      walk.push_back(corner);
      corner = &corner_at(corner->next);
    } while (corner != &start);
    split(walk, loops);
  }
  return loops;
}

Outline::Outline(double alpha) : impl_(std::make_unique<Impl>(alpha)) {}
Outline::~Outline() = default;
Outline::Outline(Outline&&) noexcept = default;
Outline& Outline::operator=(Outline&&) noexcept = default;

double Outline::alpha() const { return impl_->alpha; }
std::size_t Outline::sites() const { return impl_->triangulation.number_of_vertices(); }

void Outline::set(PlaneCell cell, std::span<const Eigen::Vector2d> sites) { impl_->set(cell, sites); }

std::vector<Polygon> Outline::update() {
  Impl& impl = *impl_;
  const auto flat = [&] { return impl.triangulation.dimension() < 2; };
  bool anew = flat();
  impl.remove_left();
  anew |= flat();
  impl.insert_entering();
  if (flat()) {
    for (const Vertex vertex : impl.triangulation.finite_vertex_handles()) {
      vertex->info().changed = false;
      vertex->info().corner = -1;
    }
    impl.corners.clear();
    impl.free_corners.clear();
    impl.changed.clear();
    return {};
  }
  if (anew)
    for (const Vertex vertex : impl.triangulation.finite_vertex_handles()) impl.note_changed(vertex);
  for (const Vertex vertex : impl.changed) {
    impl.find_corners(vertex);
    vertex->info().changed = false;
  }
  for (const Vertex vertex : impl.changed) impl.link_corners(vertex);
  impl.changed.clear();
  return polygons_of(impl.trace());
}

void Outline::recover() {
  Outline anew(impl_->alpha);
  for (const auto& [tile, sites] : impl_->tiles)
    for (const Site& site : sites) {
      anew.impl_->entering.push_back({tile, site.cell});
      anew.impl_->entering_points.push_back(site.vertex->point());
    }
  anew.update();
  *this = std::move(anew);
}

}  // namespace octosurf::geometry
