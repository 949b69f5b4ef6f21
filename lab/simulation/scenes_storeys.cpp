// A house of two storeys and the stair between them, which robots that plan in the plane take for two maps.
#include "simulation/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

constexpr int risers = 14;
constexpr double slab_thickness = 0.2, brick = 0.15;  // m, of floors and walls

/// Measures of the house. The stair goes up along the wall x = 0, from `foot` to `top` on the y axis.
struct House {
  double width, depth, stair_width, riser, tread, foot;
  double top() const { return foot + (risers - 1) * tread; }
  double storey() const { return risers * riser; }
};

void add_shell(Scene& scene, const House& house) {
  const double w = house.width, d = house.depth, h = house.storey();
  add_floor(scene, {-brick, -brick}, {w + brick, d + brick});
  const std::size_t slab = add_object(scene, "slab");
  add_box(scene, slab, {house.stair_width, 0, h - slab_thickness}, {w, d, h});
  add_box(scene, slab, {0, 0, h - slab_thickness}, {house.stair_width, house.foot, h});
  add_box(scene, slab, {0, house.top(), h - slab_thickness}, {house.stair_width, d, h});
  const std::size_t walls = add_object(scene, "walls");
  const double roof = h + 2.4;
  add_box(scene, walls, {-brick, -brick, 0}, {w + brick, 0, roof});
  add_box(scene, walls, {-brick, d, 0}, {w + brick, d + brick, roof});
  add_box(scene, walls, {-brick, 0, 0}, {0, d, roof});
  add_box(scene, walls, {w, 0, 0}, {w + brick, d, roof});
}

void add_flight_up(Scene& scene, const House& house) {
  const std::size_t stair = add_object(scene, "stair");
  evaluation::TrueStair built{"flight", house.riser, house.tread, {}};
  for (int k = 0; k < risers; ++k) {
    const double y = house.foot + k * house.tread, z = (k + 1) * house.riser;
    if (k + 1 < risers) add_box(scene, stair, {0, y, 0}, {house.stair_width, y + house.tread, z});
    built.edges.push_back({Eigen::Vector3d(0, y, z), Eigen::Vector3d(house.stair_width, y, z)});
  }
  scene.stairs.push_back(std::move(built));
}

/// Around a storey, looking at its middle and then at what is along its walls.
void walk_storey(Scene& scene, const House& house, double height, double start_rad) {
  const std::size_t first = scene.path.size();
  const Eigen::Vector2d middle((house.stair_width + house.width) / 2, house.depth / 2),
      radii(0.28 * (house.width - house.stair_width), 0.33 * house.depth);
  walk_around(scene, middle, radii, start_rad, 14, 2.0, 0);
  walk_around(scene, middle, radii, start_rad, 14, -1.3, 0.1);
  for (std::size_t i = first; i < scene.path.size(); ++i) {
    scene.path[i].eye.z() += height;
    scene.path[i].target.z() += height;
  }
}

/// Over the stair in `steps` of its way, from share `from` to share `to`, looking `ahead` of it.
void walk_stair(Scene& scene, const House& house, double from, double to, double ahead) {
  constexpr int steps = 9;
  const auto ground = [&](double share) -> Eigen::Vector3d {
    const double along = std::clamp(share, 0.0, 1.0);
    return {house.stair_width / 2, house.foot + share * (house.top() - house.foot), along * house.storey()};
  };
  for (int i = 0; i <= steps; ++i) {
    const double share = from + (to - from) * i / steps;
    scene.path.push_back({ground(share) + Eigen::Vector3d(0, 0, head_height), ground(share + ahead)});
  }
}

}  // namespace

Scene make_storeys(Random& random) {
  const auto typically = [&random](double typical) { return typical * random.uniform(0.95, 1.05); };
  House house{typically(6), 0, typically(1.1), typically(0.17), typically(0.28), typically(1.3)};
  house.depth = house.top() + typically(1.5);
  Scene scene;
  add_shell(scene, house);
  add_flight_up(scene, house);
  const Eigen::Vector2d middle((house.stair_width + house.width) / 2, house.depth / 2);
  add_table(scene, "table", middle, random.uniform(-0.4, 0.4),
            {typically(1.6), typically(0.8), typically(0.74)});
  add_standing_box(scene, "cupboard", {house.width - 0.3, 0.3 * house.depth}, house.storey(), 0,
                   {0.5, typically(1.2), typically(1.8)});
  add_standing_box(scene, "chest", middle, house.storey(), random.uniform(0, 1.5),
                   {typically(0.9), typically(0.5), typically(0.5)});
  constexpr double pi = std::numbers::pi;
  walk_storey(scene, house, 0, -0.6 * pi);
  walk_stair(scene, house, -0.2, 1.2, 0.3);
  walk_storey(scene, house, house.storey(), 0.6 * pi);
  walk_stair(scene, house, 1.2, -0.2, -0.25);
  return scene;
}

}  // namespace octosurf::simulation
