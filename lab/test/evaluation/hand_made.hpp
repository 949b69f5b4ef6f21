#pragma once

#include "evaluation/evaluate.hpp"
#include "evaluation/truth.hpp"
#include "surfaces/blobs.hpp"

#include <nlohmann/json.hpp>

namespace octosurf::hand_made {

constexpr double pi = std::numbers::pi;

inline double radians(double degrees) { return degrees * pi / 180; }

inline Ring2 box(double u0, double v0, double u1, double v1) {
  return {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
}

inline Polygon polygon(Ring2 outer, std::vector<Ring2> holes = {}) {
  return {std::move(outer), std::move(holes)};
}

/// A frame with its origin at `origin`, turned by `angle_rad` about `axis`.
inline Eigen::Isometry3d frame(const Eigen::Vector3d& origin, double angle_rad = 0,
                               const Eigen::Vector3d& axis = Eigen::Vector3d::UnitX()) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(origin);
  T.rotate(Eigen::AngleAxisd(angle_rad, axis.normalized()));
  return T;
}

using test::plane_of;
using test::random_pose;

/// All cells whose centre lies inside `seen`.
inline std::vector<evaluation::CellRun> cells_inside(const std::vector<Polygon>& seen, double cell) {
  const test::Region region(seen);
  Eigen::AlignedBox2d bounds;
  for (const Polygon& polygon : seen)
    for (const Eigen::Vector2d& p : polygon.outer) bounds.extend(p);
  std::vector<evaluation::CellRun> runs;
  for (int row = static_cast<int>(std::floor(bounds.min().y() / cell)); row * cell < bounds.max().y();
       ++row) {
    for (int c = static_cast<int>(std::floor(bounds.min().x() / cell)); c * cell < bounds.max().x(); ++c) {
      if (!region.covers({(c + 0.5) * cell, (row + 0.5) * cell})) continue;
      if (!runs.empty() && runs.back().row == row && runs.back().column + runs.back().count == c)
        ++runs.back().count;
      else
        runs.push_back({row, c, 1});
    }
  }
  return runs;
}

/// A truth and the surfaces found in it, put together by hand.
struct World {
  evaluation::Truth truth;
  Snapshot snapshot;

  World() {
    truth.scene = "hand-made";
    snapshot.resolution = 0.02;
  }

  /// A face all of which was seen, or only what lies inside `seen`.
  evaluation::TrueFace& add_face(const Eigen::Isometry3d& T, const std::vector<Polygon>& polygons,
                                 const std::vector<Polygon>* seen = nullptr) {
    evaluation::TrueFace face;
    face.id = static_cast<std::uint32_t>(truth.faces.size() + 1);
    face.name = "face/" + std::to_string(face.id);
    face.plane = plane_of(T);
    face.T_map_face = T;
    face.polygons = polygons;
    face.visible = cells_inside(seen ? *seen : polygons, truth.cell);
    for (const evaluation::CellRun& run : face.visible)
      face.visible_area_m2 += run.count * truth.cell * truth.cell;
    truth.faces.push_back(face);
    return truth.faces.back();
  }

  void add_surface(const Eigen::Isometry3d& T, const std::vector<Polygon>& polygons) {
    Surface surface;
    surface.id = static_cast<SurfaceId>(snapshot.surfaces.size() + 1);
    surface.plane = plane_of(T);
    surface.T_map_surface = T;
    surface.polygons = polygons;
    snapshot.surfaces.push_back(std::make_shared<const Surface>(surface));
  }

  World moved(const Eigen::Isometry3d& motion) const {
    World result = *this;
    for (evaluation::TrueFace& face : result.truth.faces) {
      face.T_map_face = motion * face.T_map_face;
      face.plane = plane_of(face.T_map_face);
    }
    for (SurfacePtr& surface : result.snapshot.surfaces) {
      Surface copy = *surface;
      copy.T_map_surface = motion * copy.T_map_surface;
      copy.plane = plane_of(copy.T_map_surface);
      surface = std::make_shared<const Surface>(copy);
    }
    return result;
  }
};

inline evaluation::Evaluation scores_of(const World& world) {
  return evaluation::evaluate(world.snapshot, world.truth);
}

using Json = nlohmann::json;

inline Json json_of(const World& world) { return Json::parse(to_json(scores_of(world))); }

inline const Json& at(const Json& scores, const std::string& path) {
  return scores.at(Json::json_pointer("/" + path));
}

inline void expect_in(const Json& /*scores*/) {}

/// Paths of scores and what each is to be, by turns.
template <class Value, class... Others>
void expect_in(const Json& scores, const std::string& path, const Value& value, const Others&... others) {
  if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>)
    EXPECT_NEAR(at(scores, path).get<double>(), static_cast<double>(value), 1e-11) << path;
  else
    EXPECT_EQ(at(scores, path), value) << path;
  expect_in(scores, others...);
}

template <class... Expected>
void expect_scores(const World& world, const Expected&... expected) {
  expect_in(json_of(world), expected...);
}

}  // namespace octosurf::hand_made
