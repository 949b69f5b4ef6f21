#include "evaluation/one_plane.hpp"

#include "evaluation/scene.hpp"
#include "geometry/disjoint_sets.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace octosurf::evaluation {
namespace {

template <class Visit>
void for_each_corner(const TrueFace& face, const Visit& visit) {
  for (const Polygon& polygon : face.polygons) {
    for (const Eigen::Vector2d& uv : polygon.outer) visit(uv);
    for (const Ring2& hole : polygon.holes)
      for (const Eigen::Vector2d& uv : hole) visit(uv);
  }
}

Eigen::Vector3d to_map(const TrueFace& face, const Eigen::Vector2d& uv) {
  return face.T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0);
}

double farthest_off(const Plane& plane, const TrueFace& face) {
  double farthest = 0;
  for_each_corner(face, [&](const Eigen::Vector2d& uv) {
    farthest = std::max(farthest, std::abs(plane.signed_distance(to_map(face, uv))));
  });
  return farthest;
}

/// A face, ready for distances from it.
struct Outline {
  const TrueFace* face;
  PlanarRegion region;
  Eigen::AlignedBox3d box;  ///< of its corners, map frame

  explicit Outline(const TrueFace& f) : face(&f), region(f.polygons) {
    for_each_corner(f, [&](const Eigen::Vector2d& uv) { box.extend(to_map(f, uv)); });
  }

  /// A corner of the other is nearer than `gap` to this one, along its plane.
  bool corner_near(const Outline& other, double gap) const {
    const Eigen::Isometry3d T = face->T_map_face.inverse() * other.face->T_map_face;
    bool near = false;
    for_each_corner(*other.face, [&](const Eigen::Vector2d& uv) {
      near = near || region.within((T * Eigen::Vector3d(uv.x(), uv.y(), 0)).head<2>(), gap);
    });
    return near;
  }
};

/// Outlines that do not cross come nearest to each other at a corner of one of them.
bool are_near(const Outline& a, const Outline& b, double gap) {
  if (a.box.isEmpty() || b.box.isEmpty() || a.box.squaredExteriorDistance(b.box) > gap * gap) return false;
  return a.corner_near(b, gap) || b.corner_near(a, gap);
}

/// Cells of the first face's grid whose centre lies in a visible cell of any of the faces.
std::vector<CellRun> join_cells(const std::vector<const TrueFace*>& faces, double cell) {
  std::vector<std::pair<VisibleCells, Eigen::Isometry3d>>
      sets;  // and the first face's (u, v, 0) to each one's
  Eigen::AlignedBox2d box;
  for (const TrueFace* face : faces) {
    const Eigen::Isometry3d T = face->T_map_face.inverse() * faces.front()->T_map_face;
    sets.emplace_back(VisibleCells(face->visible, cell, face->name), T);
    for (const CellRun& run : face->visible)
      for (const int column : {run.column, run.column + run.count})
        for (const int row : {run.row, run.row + 1})
          box.extend((T.inverse() * Eigen::Vector3d(column * cell, row * cell, 0)).head<2>());
  }
  std::vector<CellRun> joined;
  if (box.isEmpty()) return joined;
  const auto low = [cell](double x) { return static_cast<int>(std::floor(x / cell)); };
  for (int row = low(box.min().y()); row <= low(box.max().y()); ++row) {
    CellRun run{row, 0, 0};
    for (int column = low(box.min().x()); column <= low(box.max().x()) + 1; ++column) {
      const Eigen::Vector3d centre((column + 0.5) * cell, (row + 0.5) * cell, 0);
      const bool visible = std::any_of(sets.begin(), sets.end(), [&](const auto& set) {
        return set.first.near((set.second * centre).template head<2>(), 0);
      });
      if (visible && run.count++ == 0) run.column = column;
      if (!visible && run.count > 0) joined.push_back(std::exchange(run, CellRun{row, 0, 0}));
    }
  }
  return joined;
}

double area_of(const std::vector<CellRun>& cells, double cell) {
  double area = 0;
  for (const CellRun& run : cells) area += run.count * cell * cell;
  return area;
}

/// What was seen of a face in pieces that lie a cell farther from each other than the gap: a wall that a door
/// cuts.
std::vector<TrueFace> pieces_of(const TrueFace& face, double cell, double gap) {
  std::vector<CellRun> runs = face.visible;
  std::ranges::stable_sort(runs, {}, &CellRun::row);
  geometry::DisjointSets sets(runs.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    for (std::size_t k = i; k-- > 0;) {
      const CellRun &a = runs[k], &b = runs[i];
      const double up = cell * std::max(0, b.row - a.row - 1);
      const double aside = cell * std::max({0, b.column - a.column - a.count, a.column - b.column - b.count});
      if (up >= gap + cell) break;
      if (std::hypot(up, aside) < gap + cell) sets.join(i, k);
    }
  }
  std::map<std::size_t, std::vector<CellRun>> pieces;
  for (std::size_t i = 0; i < runs.size(); ++i) pieces[sets.root(i)].push_back(runs[i]);
  if (pieces.size() < 2) return {face};
  std::vector<TrueFace> found;
  for (auto& [root, cells] : pieces) {
    TrueFace& piece = found.emplace_back(face);
    piece.visible_area_m2 = area_of(cells, cell);
    piece.largest_part_m2 = std::min(piece.largest_part_m2, piece.visible_area_m2);
    piece.visible = std::move(cells);
  }
  return found;
}

TrueFace joined_face(const std::vector<const TrueFace*>& faces, double cell) {
  TrueFace all = *faces.front();
  for (const TrueFace* face : faces) {
    if (face == faces.front()) continue;
    const Eigen::Isometry3d T = all.T_map_face.inverse() * face->T_map_face;
    const auto moved = [&T](Ring2 ring) {
      for (Eigen::Vector2d& uv : ring) uv = (T * Eigen::Vector3d(uv.x(), uv.y(), 0)).head<2>();
      return ring;
    };
    for (const Polygon& polygon : face->polygons) {
      Polygon& copy = all.polygons.emplace_back(Polygon{moved(polygon.outer), {}});
      for (const Ring2& hole : polygon.holes) copy.holes.push_back(moved(hole));
    }
    all.joined.push_back(face->id);
  }
  all.largest_part_m2 = area_of(all.visible, cell);
  all.visible = join_cells(faces, cell);
  all.visible_area_m2 = area_of(all.visible, cell);
  return all;
}

}  // namespace

Fold fold_between(const TrueFace& a, const TrueFace& b) {
  const bool a_is_larger =
      a.visible_area_m2 != b.visible_area_m2 ? a.visible_area_m2 > b.visible_area_m2 : a.id < b.id;
  return {angle_between(a.plane.normal, b.plane.normal),
          a_is_larger ? farthest_off(a.plane, b) : farthest_off(b.plane, a)};
}

Truth join_faces(const Truth& truth, const OnePlane& rule) {
  std::vector<Outline> outlines(truth.faces.begin(), truth.faces.end());
  std::vector<std::size_t> order(outlines.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return truth.faces[a].visible_area_m2 > truth.faces[b].visible_area_m2;
  });
  std::vector<std::vector<const TrueFace*>> groups(outlines.size());  // by the face they begin with
  std::vector<bool> taken(outlines.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t first = order[i];
    if (taken[first] || truth.faces[first].gone) continue;
    const Plane& plane = truth.faces[first].plane;
    std::vector<std::size_t> coplanar;
    for (std::size_t k = i + 1; k < order.size(); ++k) {
      const TrueFace& face = truth.faces[order[k]];
      if (!taken[order[k]] && !face.gone &&
          angle_between(plane.normal, face.plane.normal) <= rule.angle_rad &&
          farthest_off(plane, face) <= rule.offset_m)
        coplanar.push_back(order[k]);
    }
    std::vector<std::size_t> group{first};
    for (std::size_t g = 0; g < group.size(); ++g) {
      for (const std::size_t other : coplanar) {
        if (taken[other] || !are_near(outlines[group[g]], outlines[other], rule.gap_m)) continue;
        taken[other] = true;
        group.push_back(other);
      }
    }
    for (const std::size_t face : group) groups[first].push_back(&truth.faces[face]);
  }
  Truth joined = truth;
  joined.faces.clear();
  for (std::size_t f = 0; f < truth.faces.size(); ++f) {
    if (taken[f]) continue;
    const TrueFace whole = groups[f].size() > 1 ? joined_face(groups[f], truth.cell) : truth.faces[f];
    std::ranges::move(pieces_of(whole, truth.cell, rule.gap_m), std::back_inserter(joined.faces));
  }
  return joined;
}

}  // namespace octosurf::evaluation
