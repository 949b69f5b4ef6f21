#include "simulation/scenes.hpp"

#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

constexpr double pi = std::numbers::pi;

/// A value within ±10 % of `typical`.
double about(Random& random, double typical) { return typical * random.uniform(0.9, 1.1); }

/// Bookcase against the wall x = `wall_x`, opening toward −x.
void add_shelf(Scene& scene, Random& random, double wall_x, double y, double width) {
  constexpr double depth = 0.34;
  constexpr double height = 1.75;
  constexpr double board = 0.03;
  const std::size_t shelf = add_object(scene, "shelf");
  const double x = wall_x - depth;
  add_box(scene, shelf, {x, y, 0}, {wall_x, y + board, height});
  add_box(scene, shelf, {x, y + width - board, 0}, {wall_x, y + width, height});
  double z = 0.08;
  while (z < height - 0.3) {
    add_box(scene, shelf, {x, y + board, z}, {wall_x, y + width - board, z + board});
    z += random.uniform(0.36, 0.48);
  }
  add_box(scene, shelf, {x, y + board, height - board}, {wall_x, y + width - board, height});
}

/// A flight of `steps` nested boxes over [x0, x1] that rises toward +y from y0; the last one
/// reaches to `y_end` as a landing.
void add_stair(Scene& scene, double x0, double x1, double y0, double y_end, int steps) {
  constexpr double riser = 0.17;
  constexpr double tread = 0.29;
  const std::size_t stair = add_object(scene, "stair");
  evaluation::TrueStair built{"flight", riser, tread, {}};
  for (int k = 0; k < steps; ++k) {
    // Each step stands behind the one before, so that no two solids overlap.
    const double y = k + 1 < steps ? y0 + (k + 1) * tread : y_end;
    add_box(scene, stair, {x0, y0 + k * tread, 0}, {x1, y, (k + 1) * riser});
    built.edges.push_back({Eigen::Vector3d(x0, y0 + k * tread, (k + 1) * riser),
                           Eigen::Vector3d(x1, y0 + k * tread, (k + 1) * riser)});
  }
  scene.stairs.push_back(std::move(built));
}

/// Boxes of 4 to 30 cm strewn over [min, max] (x, y) at height z, side by side along x.
void add_clutter(Scene& scene, Random& random, const std::string& name, int count, const Eigen::Vector2d& min,
                 const Eigen::Vector2d& max, double z) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d size(random.uniform(0.08, 0.3), random.uniform(0.06, 0.22),
                               random.uniform(0.04, 0.25));
    const double slot = (max.x() - min.x()) / count;
    const Eigen::Vector2d place(min.x() + slot * (i + random.uniform(0.3, 0.7)),
                                random.uniform(min.y(), max.y()));
    add_standing_box(scene, name + std::to_string(i + 1), place, z, random.uniform(0, pi), size);
  }
}

void add_office_furniture(Scene& scene, Random& random, double width, double depth) {
  const double desk = random.uniform(0.72, 0.77);
  add_table(scene, "desk", {0.48 * width, 0.42 * depth}, random.uniform(-0.2, 0.2),
            {about(random, 1.6), about(random, 0.8), desk});
  add_clutter(scene, random, "on_desk", 5, {0.39 * width, 0.39 * depth}, {0.57 * width, 0.45 * depth}, desk);
  const double low = random.uniform(0.43, 0.5);
  add_table(scene, "low_table", {0.60 * width, 0.72 * depth}, random.uniform(0.2, 0.6),
            {about(random, 0.9), about(random, 0.6), low});
  add_clutter(scene, random, "on_low_table", 2, {0.58 * width, 0.70 * depth}, {0.62 * width, 0.74 * depth},
              low);
  add_table(scene, "side_table", {width - 0.45, 0.30 * depth}, 0,
            {0.7, about(random, 1.2), random.uniform(0.78, 0.84)});

  const double counter_x = 0.34 * width;
  const double counter_height = random.uniform(0.88, 0.95);
  const std::size_t counter = add_object(scene, "counter");
  add_box(scene, counter, {counter_x, depth - 0.55, 0}, {counter_x + 1.9, depth, counter_height - 0.04});
  add_box(scene, counter, {counter_x - 0.02, depth - 0.6, counter_height - 0.04},
          {counter_x + 1.92, depth, counter_height});
  add_clutter(scene, random, "on_counter", 4, {counter_x + 0.2, depth - 0.42}, {counter_x + 1.7, depth - 0.2},
              counter_height);
  add_shelf(scene, random, width, 0.58 * depth, about(random, 1.2));

  const std::size_t kerb = add_object(scene, "kerb");
  add_box(scene, kerb, {0.48 * width, 0.55, 0}, {0.86 * width, 0.95, random.uniform(0.1, 0.15)});
  add_cylinder(scene, add_object(scene, "pillar"), {0.26 * width, 0.88 * depth, 0}, random.uniform(0.12, 0.2),
               2.4);
  add_cylinder(scene, add_object(scene, "bin"), {0.34 * width, 0.5 * depth, 0}, random.uniform(0.14, 0.18),
               random.uniform(0.34, 0.42));
  const double ball = random.uniform(0.12, 0.18);
  add_sphere(scene, add_object(scene, "ball"), {0.76 * width, 0.62 * depth, ball}, ball);
  add_clutter(scene, random, "on_floor", 4, {0.2, 0.4}, {0.27 * width, 0.28 * depth}, 0);
}

}  // namespace

Scene make_room(Random& random) {
  Scene scene;
  const double width = about(random, 4.4);
  const double depth = about(random, 4.0);
  const double door = random.uniform(0.6, 1.2);
  add_floor(scene, {-0.3, -1.0}, {width + 0.3, depth + 0.3});
  add_four_walls(scene, width, depth, {{door, door + 0.9, 2.05}});
  add_table(scene, "table", {0.56 * width, 0.58 * depth}, random.uniform(-0.4, 0.4),
            {about(random, 1.3), about(random, 0.75), random.uniform(0.70, 0.77)});
  add_standing_box(scene, "box", {0.25 * width, 0.72 * depth}, 0, random.uniform(0.2, 1.3),
                   {about(random, 0.55), about(random, 0.42), about(random, 0.45)});
  walk_around(scene, {width / 2, depth / 2}, {width / 2 - 0.9, depth / 2 - 0.9}, -0.6 * pi, 12, 2.2, 0.1);
  walk_around(scene, {width / 2, depth / 2}, {width / 4, depth / 4}, -0.6 * pi, 12, -1.4, 0.9);
  return scene;
}

Scene make_office(Random& random) {
  Scene scene;
  const double width = about(random, 6.6);
  const double depth = about(random, 5.8);
  add_floor(scene, {-0.3, -1.0}, {width + 0.3, depth + 0.3});
  add_four_walls(scene, width, depth, {{0.3 * width, 0.3 * width + 0.9, 2.05}});
  add_stair(scene, 0, about(random, 1.1), depth - about(random, 2.6), depth, 5);
  add_office_furniture(scene, random, width, depth);
  const Eigen::Vector2d center(width / 2, depth / 2);
  const Eigen::Vector2d radii(0.32 * width, 0.31 * depth);
  walk_around(scene, center, radii, -0.6 * pi, 16, 2.2, 0.2);
  walk_around(scene, center, radii, -0.6 * pi, 16, -1.6, 0.6);
  return scene;
}

Scene make_stairs(Random& random) {
  Scene scene;
  const double width = about(random, 4.2);
  const double stair_width = about(random, 1.3);
  const double start = about(random, 1.7);
  const int steps = 6;
  const double landing = start + (steps - 1) * 0.29;
  const double depth = landing + about(random, 1.3);
  const double top = steps * 0.17 + head_height;
  add_floor(scene, {-0.3, -1.6}, {width + 0.3, depth + 0.3});
  const std::size_t walls = add_object(scene, "walls");
  add_box(scene, walls, {-0.15, 0, 0}, {0, depth, 3.2});
  add_box(scene, walls, {-0.15, depth, 0}, {width, depth + 0.15, 3.2});
  add_stair(scene, 0, stair_width, start, depth, steps);
  add_standing_box(scene, "box", {0.7 * width, 0.75 * depth}, 0, random.uniform(0.2, 1.3),
                   {about(random, 0.5), about(random, 0.4), about(random, 0.6)});

  const double x = stair_width / 2;
  scene.path = {{{x, -0.9, head_height}, {x, 1.4, 0.1}},
                {{x, 0.7, head_height}, {x, start + 0.7, 0.3}},
                {{x, start + 0.3, head_height + 0.25}, {x, landing - 0.1, 0.9}},
                {{x, landing - 0.5, head_height + 0.7}, {x, depth, 1.3}},
                {{x, landing + 0.3, top}, {x + 0.1, depth, 1.4}},
                {{x, landing + 0.4, top}, {0.75 * width, landing + 0.4, 0.2}},
                {{x, landing + 0.5, top}, {x, start + 0.4, 0.4}},
                {{x, start + 0.4, head_height + 0.3}, {x, start - 1.2, 0}},
                {{x + 0.3, 0.4, head_height}, {width - 0.4, 0.8, 0}},
                {{width - 1.2, 0.4, head_height}, {x, start + 0.6, 0.3}},
                {{width - 0.8, start + 0.3, head_height}, {x, start + 0.9, 0.5}},
                {{width - 0.8, landing, head_height}, {x, landing + 0.6, 0.7}},
                {{width - 0.7, landing, head_height}, {0.75 * width, depth, 0.5}},
                {{width - 0.5, start, head_height}, {0.65 * width, depth - 0.3, 0.3}}};
  return scene;
}

Scene make_stones(Random& random) {
  constexpr int columns = 4;
  constexpr int rows = 4;
  Scene scene;
  const double size = 0.5;
  add_floor(scene, {-3, -3}, {columns * 0.75 + 3, rows * 0.75 + 3});
  for (int row = 0; row < rows; ++row) {
    // Every other row stands close: neighbours 1 to 3 cm apart, the others a hand's breadth and more.
    const double pitch = row % 2 == 0 ? size + random.uniform(0.03, 0.05) : random.uniform(0.68, 0.75);
    const double start = random.uniform(0, 0.5);
    for (int column = 0; column < columns; ++column) {
      const double height = random.uniform(0.1, 0.4);
      const double tilt_rad = random.uniform(5, 25) * pi / 180;
      const double toward_rad = random.uniform(0, 2 * pi);
      const Eigen::Vector3d axis(std::cos(toward_rad), std::sin(toward_rad), 0);
      const double yaw_rad = row % 2 == 0 ? 0 : random.uniform(-0.4, 0.4);
      const double extent = size * random.uniform(0.95, 1);
      const Eigen::Isometry3d T = Eigen::Translation3d(start + column * pitch, 0.35 + row * 0.72, height) *
                                  Eigen::AngleAxisd(tilt_rad, axis) *
                                  Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                                  Eigen::Translation3d(0, 0, -0.4) * Eigen::Isometry3d::Identity();
      add_box(scene, add_object(scene, "stone" + std::to_string(row * columns + column + 1)), T,
              {extent, size * random.uniform(0.85, 1), 0.8});
    }
  }
  const Eigen::Vector2d center(columns * 0.33, rows * 0.36);
  walk_around(scene, center, {1.9, 1.9}, -0.5 * pi, 16, 1.6, 0.1);
  walk_around(scene, center, {1.1, 1.1}, -0.5 * pi, 12, 1.0, 0.2);
  return scene;
}

Scene make_change(Random& random) {
  Scene scene;
  const double width = about(random, 4.8);
  const double depth = about(random, 4.4);
  add_floor(scene, {-0.3, -1.0}, {width + 0.3, depth + 0.3});
  add_four_walls(scene, width, depth, {{1.0, 1.9, 2.05}});
  add_table(scene, "table", {0.5 * width, 0.45 * depth}, random.uniform(-0.3, 0.3),
            {about(random, 1.3), about(random, 0.7), random.uniform(0.70, 0.77)});
  add_standing_box(scene, "removed", {0.24 * width, 0.72 * depth}, 0, random.uniform(0.2, 1.3),
                   {about(random, 0.6), about(random, 0.5), about(random, 0.5)}, true, false);
  const Eigen::Vector3d moved(about(random, 0.5), about(random, 0.45), about(random, 0.65));
  add_standing_box(scene, "moved_from", {0.78 * width, 0.75 * depth}, 0, random.uniform(0.2, 1.3), moved,
                   true, false);
  add_standing_box(scene, "moved_to", {0.52 * width, 0.82 * depth}, 0, random.uniform(0.2, 1.3), moved, false,
                   true);
  add_standing_box(scene, "added", {0.8 * width, 0.26 * depth}, 0, random.uniform(0.2, 1.3),
                   {about(random, 0.55), about(random, 0.5), about(random, 0.4)}, false, true);
  const Eigen::Vector2d center(width / 2, depth / 2);
  // The same loop before and after the change, so that everything gone is looked at again.
  for (int loop = 0; loop < 2; ++loop) {
    walk_around(scene, center, {width / 2 - 1, depth / 2 - 1}, -0.6 * pi, 12, 2.0, 0.1);
    walk_around(scene, center, {width / 4, depth / 4}, -0.6 * pi, 12, -1.4, 0.6);
  }
  return scene;
}

}  // namespace octosurf::simulation
