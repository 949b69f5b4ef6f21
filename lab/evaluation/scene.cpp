#include "evaluation/scene.hpp"

#include "geometry/rings.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

constexpr double largest_area = 1e5;       // m²: 10⁹ samples at the default grid
constexpr double largest_perimeter = 1e6;  // m
constexpr std::size_t most_cells = 1000000000;
constexpr double frame_agreement = 1e-3;  // rad and m between a plane and its frame

void require_frame(const Plane& plane, const Eigen::Isometry3d& T, const std::string& where) {
  const bool finite = T.matrix().allFinite() && plane.normal.allFinite() && std::isfinite(plane.offset);
  const Eigen::Matrix3d error = T.linear().transpose() * T.linear() - Eigen::Matrix3d::Identity();
  if (!finite || error.norm() > frame_agreement || T.linear().determinant() < 0 ||
      (T.linear().col(2) - plane.normal).norm() > frame_agreement ||
      std::abs(plane.signed_distance(T.translation())) > frame_agreement) {
    throw Error(Error::Kind::data, where, "its frame is not rigid or does not lie in its plane",
                "z of the frame must be the unit normal, its origin a point of the plane");
  }
}

struct Extent {
  double area = 0, perimeter = 0;
};

void add_ring(const Ring2& ring, const std::string& where, Extent& extent) {
  if (ring.size() < 3) throw Error(Error::Kind::data, where, "a ring has fewer than three vertices");
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (!ring[i].allFinite()) throw Error(Error::Kind::data, where, "a vertex is not finite");
    extent.perimeter += (ring[(i + 1) % ring.size()] - ring[i]).norm();
  }
  extent.area += std::abs(geometry::signed_area(ring));
}

Patch make_patch(const Plane& plane, const Eigen::Isometry3d& T, const std::vector<Polygon>& polygons,
                 const std::string& where, Extent& extent) {
  require_frame(plane, T, where);
  Eigen::AlignedBox3d box;
  for (const Polygon& polygon : polygons) {
    add_ring(polygon.outer, where, extent);
    for (const Ring2& hole : polygon.holes) add_ring(hole, where, extent);
    for (const Eigen::Vector2d& uv : polygon.outer) box.extend(transfer(T, uv));
  }
  if (!(extent.area <= largest_area && extent.perimeter <= largest_perimeter)) {
    throw Error(Error::Kind::data, where, "polygons enclose more than 10⁵ m² or are longer than 10⁶ m",
                "coordinates must be in metres");
  }
  return {plane, T, PlanarRegion(polygons), box};
}

void find_pairs(Scene& scene) {
  scene.pairs_of_face.resize(scene.faces.size());
  scene.pairs_of_surface.resize(scene.surfaces.size());
  const double margin = scene.tolerance + std::max(scene.snapshot->resolution, rim_width);
  for (std::size_t f = 0; f < scene.faces.size(); ++f) {
    const Patch& face = scene.faces[f];
    if (face.box.isEmpty()) continue;
    const Eigen::AlignedBox3d reach(face.box.min().array() - margin, face.box.max().array() + margin);
    for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
      const Patch& surface = scene.surfaces[s];
      if (surface.box.isEmpty() || !reach.intersects(surface.box)) continue;
      const double angle = angle_between(face.plane.normal, surface.plane.normal);
      if (angle > scene.options.support_rad) continue;
      scene.pairs_of_face[f].push_back(scene.pairs.size());
      scene.pairs_of_surface[s].push_back(scene.pairs.size());
      scene.pairs.push_back({f, s, angle <= scene.options.angle_rad, 0, 0});
    }
  }
}

void place_faces(const Truth& truth, Scene& scene) {
  if (truth.faces.empty()) {
    throw Error(Error::Kind::data, "truth", "it has no faces", "give the truth.json of a simulated scene");
  }
  if (!(truth.cell > 0 && std::isfinite(truth.cell))) {
    throw Error(Error::Kind::data, "truth", "cell is not a positive length");
  }
  Extent extent;
  std::size_t present_cells = 0;
  for (const TrueFace& face : truth.faces) {
    const std::string where = "truth, face " + std::to_string(face.id) + " (" + face.name + ")";
    scene.faces.push_back(make_patch(face.plane, face.T_map_face, face.polygons, where, extent));
    scene.visible.emplace_back(face.visible, truth.cell, where);
    if (!face.gone) present_cells += scene.visible.back().count();
    if (present_cells > most_cells) throw Error(Error::Kind::data, where, "more than 10⁹ visible cells");
  }
  if (present_cells == 0) {
    throw Error(Error::Kind::data, "truth", "none of its faces was seen", "simulate more frames");
  }
}

void place_surfaces(const Snapshot& snapshot, Scene& scene) {
  if (!(snapshot.resolution > 0 && std::isfinite(snapshot.resolution))) {
    throw Error(Error::Kind::data, "snapshot", "resolution is not a positive length");
  }
  Extent extent;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (!surface) throw Error(Error::Kind::data, "snapshot", "a surface is missing");
    scene.surfaces.push_back(make_patch(surface->plane, surface->T_map_surface, surface->polygons,
                                        "surface " + std::to_string(surface->id), extent));
  }
}

}  // namespace

VisibleCells::VisibleCells(std::vector<CellRun> runs, double cell, const std::string& where)
    : runs_(std::move(runs)), cell_(cell) {
  std::sort(runs_.begin(), runs_.end(), [](const CellRun& a, const CellRun& b) {
    return std::tie(a.row, a.column) < std::tie(b.row, b.column);
  });
  const CellRun* before = nullptr;
  for (const CellRun& run : runs_) {
    if (run.count <= 0) throw Error(Error::Kind::data, where, "a run of visible cells is empty");
    if (before && before->row == run.row && std::int64_t{before->column} + before->count > run.column) {
      throw Error(Error::Kind::data, where, "runs of visible cells overlap");
    }
    before = &run;
    count_ += static_cast<std::size_t>(run.count);
  }
}

bool VisibleCells::near(const Eigen::Vector2d& uv, double reach) const {
  const double first_column = std::floor((uv.x() - reach) / cell_);
  const double last_column = std::floor((uv.x() + reach) / cell_);
  const double last_row = std::floor((uv.y() + reach) / cell_);
  for (double row = std::floor((uv.y() - reach) / cell_); row <= last_row; ++row) {
    // The last run of the row that begins no later than the square ends.
    auto run = std::upper_bound(runs_.begin(), runs_.end(), std::pair(row, last_column),
                                [](const std::pair<double, double>& key, const CellRun& other) {
                                  return key < std::pair<double, double>(other.row, other.column);
                                });
    if (run == runs_.begin()) continue;
    --run;
    if (run->row == row && double{1} * run->column + run->count > first_column) return true;
  }
  return false;
}

double Scene::reach() const { return std::max(2 * truth->cell, snapshot->resolution); }

double Scene::visible_m2(std::size_t face) const {
  // Cells that the outline cuts count whole: a lidar's, of 5 cm, are more than all of a table's leg.
  double area = 0;
  for (const Polygon& polygon : truth->faces[face].polygons) area += enclosed_area(polygon);
  return std::min(area, static_cast<double>(visible[face].count()) * truth->cell * truth->cell);
}

Scene prepare(const Snapshot& snapshot, const Truth& truth, const EvaluationOptions& options) {
  Scene scene;
  scene.snapshot = &snapshot;
  scene.truth = &truth;
  scene.options = options;
  place_faces(truth, scene);
  place_surfaces(snapshot, scene);
  scene.tolerance = options.tolerance_at(snapshot.resolution);
  scene.options.tolerance = scene.tolerance;
  find_pairs(scene);
  return scene;
}

}  // namespace octosurf::evaluation
