#include "simulation/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

constexpr double half_width = 0.95;
constexpr double wall = 0.14;
constexpr double corridor_height = 2.4;
constexpr double room_depth = 3.0;
constexpr double door_width = 0.95;
constexpr double room_length = 4.0;  ///< wished for; rooms share the corridor's length evenly

/// One side's rooms: where their doors begin, and what closes them off.
struct Side {
  double sign = 1;  ///< +1: rooms at y > 0
  std::vector<Door> doors;
};

Side add_rooms(Scene& scene, Random& random, std::size_t walls, double sign, double length) {
  Side side;
  side.sign = sign;
  const int rooms = std::max(1, static_cast<int>(std::lround(length / room_length)));
  const double pitch = length / rooms;
  const auto span = [&](double x0, double x1, double near, double far, const std::vector<Door>& doors) {
    const double y0 = std::min(sign * near, sign * far);
    const double y1 = std::max(sign * near, sign * far);
    add_wall(scene, walls, {x0, y0, 0}, {x1, y1, corridor_height}, doors);
  };
  const double inner = half_width + wall;
  const double outer = inner + room_depth;
  for (int k = 0; k < rooms; ++k) {
    const double door = k * pitch + wall + random.uniform(0.3, std::max(0.35, pitch - door_width - 0.6));
    side.doors.push_back({door, door + door_width, 2.05});
  }
  span(0, length, half_width, inner, side.doors);
  span(-wall, length + wall, outer, outer + wall, {});
  for (int k = 0; k <= rooms; ++k) {
    // End walls stand outside [0, length], partitions on the rooms' borders.
    const double x = k == 0 ? -wall : k == rooms ? length : k * pitch - wall / 2;
    span(x, x + wall, inner, outer, {});
  }
  return side;
}

void furnish(Scene& scene, Random& random, const Side& side) {
  for (std::size_t k = 0; k < side.doors.size(); ++k) {
    const double x = (side.doors[k].from + side.doors[k].to) / 2 + random.uniform(-0.3, 0.3);
    const double y = side.sign * (half_width + wall + 1.9);
    const std::string room = (side.sign > 0 ? "left" : "right") + std::to_string(k + 1) + "_";
    if (random.uniform() < 0.5)
      add_table(scene, room + "table", {x, y}, random.uniform(-0.3, 0.3),
                {random.uniform(1, 1.4), random.uniform(0.6, 0.8), random.uniform(0.68, 0.78)});
    else
      add_standing_box(scene, room + "box", {x, y}, 0, random.uniform(0, std::numbers::pi),
                       {random.uniform(0.5, 0.9), random.uniform(0.4, 0.6), random.uniform(0.4, 0.8)});
  }
}

/// Along the corridor in the direction `heading` (±1 along x), into each door of `side` a look.
void walk(Scene& scene, double length, double heading, const Side& side) {
  const double margin = std::min(0.9, length / 4);
  const auto ahead = [&](double x) {
    scene.path.push_back({{x, 0, head_height}, {x + heading * 2.4, 0, 0.2}});
  };
  ahead(heading > 0 ? margin : length - margin);
  for (std::size_t i = 0; i < side.doors.size(); ++i) {
    const auto& door = side.doors[heading > 0 ? i : side.doors.size() - 1 - i];
    const double x = (door.from + door.to) / 2;
    if (x - heading * 1.2 > margin && x - heading * 1.2 < length - margin) ahead(x - heading * 1.2);
    scene.path.push_back({{x, side.sign * 0.3, head_height}, {x, side.sign * 2.7, 0.3}});
  }
  ahead(heading > 0 ? length - margin : margin);
}

}  // namespace

Scene make_corridor(Random& random, double length) {
  Scene scene;
  const double outer = half_width + wall + room_depth + wall;
  add_floor(scene, {-wall, -outer}, {length + wall, outer});
  const std::size_t walls = add_object(scene, "walls");
  add_box(scene, walls, {-wall, -half_width - wall, 0}, {0, half_width + wall, corridor_height});
  add_box(scene, walls, {length, -half_width - wall, 0}, {length + wall, half_width + wall, corridor_height});
  const Side left = add_rooms(scene, random, walls, 1, length);
  const Side right = add_rooms(scene, random, walls, -1, length);
  furnish(scene, random, left);
  furnish(scene, random, right);
  int boxes = 0;
  for (double x = 2.2; x < length - 1.5; x += random.uniform(3, 5)) {
    const double y = (random.uniform() < 0.5 ? -1 : 1) * random.uniform(0.55, 0.65);
    add_standing_box(scene, "box" + std::to_string(++boxes), {x, y}, 0, random.uniform(-0.3, 0.3),
                     {random.uniform(0.3, 0.5), random.uniform(0.25, 0.4), random.uniform(0.2, 0.5)});
  }
  walk(scene, length, 1, left);
  walk(scene, length, -1, right);
  return scene;
}

}  // namespace octosurf::simulation
