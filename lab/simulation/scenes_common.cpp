#include "simulation/scenes.hpp"
#include "simulation/sensor.hpp"

#include <algorithm>
#include <numbers>
#include <string_view>
#include <utility>

namespace octosurf::simulation {
namespace {

constexpr double wall_thickness = 0.15;
constexpr double wall_height = 2.5;
constexpr double floor_thickness = 1.0;

using Maker = Scene (*)(Random&, double);

constexpr std::pair<std::string_view, Maker> makers[] = {
    {"room", [](Random& random, double) { return make_room(random); }},
    {"office", [](Random& random, double) { return make_office(random); }},
    {"stairs", [](Random& random, double) { return make_stairs(random); }},
    {"stones", [](Random& random, double) { return make_stones(random); }},
    {"corridor", [](Random& random, double length) { return make_corridor(random, length); }},
    {"change", [](Random& random, double) { return make_change(random); }},
    {"flight", [](Random& random, double) { return make_flight(random); }},
    {"landing", [](Random& random, double) { return make_landing(random); }},
    {"spiral", [](Random& random, double) { return make_spiral(random); }},
    {"open", [](Random& random, double) { return make_open(random); }},
    {"storeys", [](Random& random, double) { return make_storeys(random); }}};

}  // namespace

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& [name, maker] : makers) names.emplace_back(name);
  return names;
}

Scene make_scene(const std::string& name, Random random, double length) {
  require_known("scene", name, scene_names());
  const auto* maker =
      std::find_if(std::begin(makers), std::end(makers), [&](const auto& one) { return one.first == name; });
  Scene scene = maker->second(random, length);
  scene.name = name;
  return scene;
}

void add_floor(Scene& scene, const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  add_box(scene, add_object(scene, "floor"), {min.x(), min.y(), -floor_thickness}, {max.x(), max.y(), 0});
}

void add_four_walls(Scene& scene, double width, double depth, const std::vector<Door>& doors) {
  const double t = wall_thickness;
  const double h = wall_height;
  const std::size_t walls = add_object(scene, "walls");
  add_wall(scene, walls, {-t, -t, 0}, {width + t, 0, h}, doors);
  add_wall(scene, walls, {-t, depth, 0}, {width + t, depth + t, h});
  add_box(scene, walls, {-t, 0, 0}, {0, depth, h});
  add_box(scene, walls, {width, 0, 0}, {width + t, depth, h});
}

void add_table(Scene& scene, const std::string& name, const Eigen::Vector2d& place, double yaw_rad,
               const Eigen::Vector3d& size) {
  constexpr double top = 0.04;
  constexpr double leg = 0.05;
  constexpr double inset = 0.04;
  const std::size_t table = add_object(scene, name);
  const Eigen::Isometry3d T = Eigen::Translation3d(place.x(), place.y(), 0) *
                              Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                              Eigen::Isometry3d::Identity();
  const auto part = [&](const Eigen::Vector3d& center, const Eigen::Vector3d& extent) {
    add_box(scene, table, T * Eigen::Translation3d(center), extent);
  };
  part({0, 0, size.z() - top / 2}, {size.x(), size.y(), top});
  for (const double sx : {-1.0, 1.0})
    for (const double sy : {-1.0, 1.0})
      part({sx * (size.x() / 2 - inset - leg / 2), sy * (size.y() / 2 - inset - leg / 2),
            (size.z() - top) / 2},
           {leg, leg, size.z() - top});
}

std::size_t add_standing_box(Scene& scene, const std::string& name, const Eigen::Vector2d& place, double z,
                             double yaw_rad, const Eigen::Vector3d& size, bool before, bool after) {
  const std::size_t box = add_object(scene, name, before, after);
  const Eigen::Isometry3d T = Eigen::Translation3d(place.x(), place.y(), z + size.z() / 2) *
                              Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                              Eigen::Isometry3d::Identity();
  add_box(scene, box, T, size);
  return box;
}

void walk_around(Scene& scene, const Eigen::Vector2d& center, const Eigen::Vector2d& radii, double start_rad,
                 int steps, double reach, double look_z) {
  for (int i = 0; i <= steps; ++i) {
    const double angle_rad = start_rad + 2 * std::numbers::pi * i / steps;
    const Eigen::Vector2d offset(radii.x() * std::cos(angle_rad), radii.y() * std::sin(angle_rad));
    const Eigen::Vector2d eye = center + offset;
    const Eigen::Vector2d target = eye - reach * offset.normalized();
    scene.path.push_back({{eye.x(), eye.y(), head_height}, {target.x(), target.y(), look_z}});
  }
}

}  // namespace octosurf::simulation
