// One place, one answer: tile, patch, storey, foothold, region and exported ground beside the truth of
// painted octrees and of a mapped scene. The counts are of places where a reader differs; they may only fall.
#include "planning/rings.hpp"
#include "support/painted_octree.hpp"
#include "support/scene.hpp"

#include <array>
#include <functional>
#include <map>

#include <octosurf/ground.hpp>
#include <octosurf/ground_patch.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/storeys.hpp>

namespace octosurf::planning {
namespace {

constexpr double voxel = 0.02;    // m
constexpr int floor_cells = 120;  // a voxel each, of a floor of 2.4 m

enum class Truth { ground, open, occupied, hanging, unseen };
constexpr std::array<const char*, 5> truth_names{"ground", "open", "occupied", "hanging", "unseen"};
enum class Reader { tile, patch, storey, foothold, region, exported };
constexpr std::array<const char*, 6> reader_names{"tile",     "patch",  "storey",
                                                  "foothold", "region", "exported"};

/// What is on a floor, by cells along x and y.
struct Plan {
  std::array<std::array<Truth, floor_cells>, floor_cells> truth{};

  template <class Visit>
  void paint(Truth what, int x0, int x1, int y0, int y1, const Visit& visit) {
    for (int x = x0; x < x1; ++x)
      for (int y = y0; y < y1; ++y) truth[x][y] = what, visit(x, y);
  }
  /// Whether all cells so near are of one truth.
  bool is_clear(int x, int y, int near) const {
    for (int i = x - near; i <= x + near; ++i)
      for (int k = y - near; k <= y + near; ++k)
        if (i < 0 || k < 0 || i >= floor_cells || k >= floor_cells || truth[i][k] != truth[x][y])
          return false;
    return true;
  }
};

/// By reader and truth, places where they differ.
using Counts = std::map<std::pair<Reader, Truth>, int>;

GroundRules rules_of_disc() {
  GroundRules rules = GroundRules::of(Biped{}, voxel);
  rules.widest_unseen_m = 0.04;  // a disc between readings in every second cell is 2.8 cm wide, to a voxel
  rules.foot = ContactShape::disc(0.02);
  return rules;
}

/// `spread`: cells by which what was mapped may be off.
Counts ask(const Plan& plan, const GroundView& view, int spread) {
  Counts differ;
  StoreyLimits limits;
  limits.radius_m = 0.05;
  limits.min_area_m2 = 0.1;  // strips between slots
  const std::vector<Storey> storeys = find_storeys(view, limits);
  std::vector<SurfacePtr> floors;
  for (const SurfacePtr& surface : view.mapped().surfaces)
    if (surface->plane.normal.z() > 0.99 && std::fabs(surface->plane.offset) < voxel)
      floors.push_back(surface);
  PatchLayout layout;
  for (int x = 0; x < floor_cells; ++x)
    for (int y = 0; y < floor_cells; ++y) layout.points.push_back(voxel * (Eigen::Array2d(x, y) + 0.5) - 0.5);
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.translation() = Eigen::Vector3d(0.5, 0.5, 0.5);
  const GroundPatch patch = ground_patch(view, base, layout);
  std::vector<std::vector<Polygon>> exported, regions;
  for (const SurfacePtr& floor : floors) {
    exported.push_back(view.solid(floor->id)->polygons);
    regions.push_back(view.region(floor->id, 0.0).polygons);
  }
  for (int x = 2; x < floor_cells - 2; ++x)
    for (int y = 2; y < floor_cells - 2; ++y) {
      const Truth truth = plan.truth[x][y];
      const bool ground = truth == Truth::ground, over = truth == Truth::hanging;
      const Eigen::Vector3d at(voxel * (x + 0.5), voxel * (y + 0.5), voxel / 2);
      const auto on_any = [&](const auto& is_on) {
        for (std::size_t k = 0; k < floors.size(); ++k)
          if (is_on(k)) return true;
        return false;
      };
      const auto is_in = [&](const std::vector<std::vector<Polygon>>& of_floors) {
        return on_any([&](std::size_t k) {
          const Eigen::Vector2d uv = (floors[k]->T_map_surface.inverse() * at).head<2>();
          return std::ranges::any_of(of_floors[k], [&](const Polygon& one) { return contains(one, uv); });
        });
      };
      /// Unless another truth is nearer than the reader's margin: cells, on ground and elsewhere.
      const auto note = [&](Reader reader, int on_ground, int elsewhere, const auto& is_right) {
        if (plan.is_clear(x, y, spread + (ground ? on_ground : elsewhere)) && !is_right())
          ++differ[{reader, truth}];
      };
      note(Reader::tile, 1, 1, [&] {
        return on_any([&](std::size_t k) {
          const Ground kind = view.ground_at(floors[k]->id, at);
          return ground || over           ? kind == Ground::supported
                 : truth == Truth::open   ? kind == Ground::open
                 : truth == Truth::unseen ? kind == Ground::unseen  // as is the inside of what stands there
                                          : kind == Ground::blocked || kind == Ground::unseen;
        });
      });
      // Less than a voxel from a void is below; a cell of a storey is 5 cm wide, and all of it counts; a disc
      // of 2 cm keeps a voxel's distance from edges.
      note(Reader::patch, 2, 0, [&] {
        return patch.cell[static_cast<std::size_t>(x * floor_cells + y)] ==
               (ground                   ? PatchCell::supported
                : truth == Truth::open   ? PatchCell::below
                : truth == Truth::unseen ? PatchCell::unseen
                                         : PatchCell::occupied);
      });
      note(Reader::storey, 4, 3, [&] {
        StoreyCell known = StoreyCell::unknown;
        for (const Storey& storey : storeys)
          if (const auto cell = storey.cell_at(at.head<2>()); cell && std::fabs(storey.height_m) < 0.1)
            if (known != StoreyCell::free && storey.cells[*cell] != StoreyCell::unknown)
              known = storey.cells[*cell];
        return known == (ground                   ? StoreyCell::free
                         : truth == Truth::unseen ? StoreyCell::unknown
                                                  : StoreyCell::occupied);
      });
      note(Reader::foothold, 4, 0, [&] {
        return ground == on_any([&](std::size_t k) { return view.foothold(floors[k]->id, at, 0).accepted; });
      });
      note(Reader::region, 4, 0, [&] { return is_in(regions) == ground; });
      note(Reader::exported, 1, 0, [&] { return is_in(exported) == (ground || over); });
    }
  return differ;
}

/// Prints them. Returns how many.
int print(const Counts& differ, const std::string& scene) {
  int all = 0;
  for (const auto& [of, places] : differ) {
    std::printf("%-8s %-9s %-9s %d\n", scene.c_str(), reader_names[static_cast<std::size_t>(of.first)],
                truth_names[static_cast<std::size_t>(of.second)], places);
    all += places;
  }
  return all;
}

/// A level floor at z = 0, seen from above.
struct Painted {
  Plan plan;
  test::PaintedOctree octree{voxel};
  Eigen::Isometry3d T_map_floor = Eigen::Isometry3d::Identity();  // turned: its cells are no voxels
  std::vector<Surface> surfaces;
  std::array<std::array<bool, floor_cells>, floor_cells> unread{};

  explicit Painted(double yaw) {
    T_map_floor.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    add_surface(1, 0, 0, floor_cells, 0, floor_cells);
    for (int x = 0; x < floor_cells; ++x)
      for (int y = 0; y < floor_cells; ++y)
        for (int z = 1; z < 4; ++z) octree.free(x, y, z);
    for (int x = 0; x < floor_cells; x += 4)
      for (int y = 0; y < floor_cells; y += 4)
        for (int z = 4; z < 80; z += 4) octree.free(x, y, z, 2);
  }
  Ring2 ring(int x0, int x1, int y0, int y1) const {
    Ring2 corners = ring_of({Eigen::Vector2d(x0, y0) * voxel, Eigen::Vector2d(x1, y1) * voxel});
    for (Eigen::Vector2d& p : corners)
      p = (T_map_floor.inverse() * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>();
    return corners;
  }
  void add_surface(SurfaceId id, int z, int x0, int x1, int y0, int y1) {
    Surface& surface = surfaces.emplace_back();
    surface.id = id;
    surface.resolution = voxel;
    surface.T_map_surface = T_map_floor;
    surface.T_map_surface.translation().z() = surface.plane.offset = voxel * (z + 0.5);
    surface.rms_m = 0.002;
    surface.polygons = {{ring(x0, x1, y0, y1), {}}};
    surface.area_m2 = area_of(surface.polygons);
  }
  /// What is in the cells from x0, y0 on, to x1, y1. Outlines close what is narrower than 10 cm.
  template <class Column>
  void paint(Truth what, int x0, int x1, int y0, int y1, const Column& column) {
    plan.paint(what, x0, x1, y0, y1, [&](int x, int y) {
      unread[x][y] = what != Truth::hanging;
      column(x, y);
    });
    if (what == Truth::hanging || std::min(x1 - x0, y1 - y0) <= 5) return;
    Ring2 hole = ring(x0, x1, y0, y1);
    std::reverse(hole.begin(), hole.end());
    surfaces.front().polygons.front().holes.push_back(hole);
  }
  void fill(int x, int y, int from_z, int to_z) {
    for (int z = from_z; z < to_z; ++z) octree.occupy(x, y, z, 2, 0);
  }
  void open(int x, int y, int depth) {
    for (int z = 0; z > -depth; --z) octree.free(x, y, z);
  }
  GroundView view() {
    for (int x = 0; x < floor_cells; ++x)
      for (int y = 0; y < floor_cells; ++y)
        if (!unread[x][y]) octree.occupy(x, y, 0, 2, 1);
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->resolution = voxel;
    for (const Surface& surface : surfaces)
      snapshot->surfaces.push_back(std::make_shared<const Surface>(surface));
    return {snapshot, octree.view(), rules_of_disc()};
  }
};

TEST(OneLaw, OfAPaintedPlaceAllSayTheSame) {
  const std::map<std::string, std::function<void(Painted&)>> scenes{
      {"void",
       [](Painted& s) { s.paint(Truth::open, 50, 80, 50, 80, [&](int x, int y) { s.open(x, y, 9); }); }},
      {"slot",
       [](Painted& s) { s.paint(Truth::open, 60, 63, 20, 100, [&](int x, int y) { s.open(x, y, 9); }); }},
      {"drop",
       [](Painted& s) {
         s.paint(Truth::open, 50, 90, 40, 90, [&](int x, int y) {
           s.open(x, y, 20);
           s.octree.occupy(x, y, -20, 2, 2);
         });
         s.add_surface(2, -20, 50, 90, 40, 90);
       }},
      {"pole",
       [](Painted& s) {
         s.paint(Truth::occupied, 60, 64, 60, 64, [&](int x, int y) { s.fill(x, y, 0, 40); });
       }},
      {"beam",
       [](Painted& s) {
         s.paint(Truth::hanging, 58, 66, 20, 100, [&](int x, int y) { s.fill(x, y, 30, 31); });
       }},
      {"unseen", [](Painted& s) { s.paint(Truth::unseen, 50, 80, 50, 80, [](int, int) {}); }},
      {"sparse",
       [](Painted& s) {
         for (int x = 20; x < 100; ++x)
           for (int y = 20; y < 100; ++y) s.unread[x][y] = x % 2 != 0 || y % 2 != 0;
       }},
      {"table", [](Painted& s) {
         s.paint(Truth::hanging, 50, 90, 40, 70, [&](int x, int y) { s.octree.occupy(x, y, 36, 2, 3); });
         s.add_surface(3, 36, 50, 90, 40, 70);
       }}};
  int differ = 0;
  for (const double yaw : {0.0, 0.4})
    for (const auto& [name, paint] : scenes) {
      Painted scene(yaw);
      paint(scene);
      differ += print(ask(scene.plan, scene.view(), 0), name);
    }
  // Of a million. The patch counts a border of what nobody saw to the ground, 232; readings in every second
  // cell of a turned floor are too few for tile, foothold and region here and there, 129.
  EXPECT_LE(differ, 413);
}

/// A floor with slots of 6 and 12 cm, a hole and a drop over a deep one, a box and a beam, seen by cameras.
TEST(OneLaw, OfAMappedPlaceAllSayTheSame) {
  constexpr double size = voxel * floor_cells, deep = -0.5;
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Plan plan;
  test::Scene scene;
  const auto nothing = [](int, int) {};
  // Strips of floor along y between the slots; in the last one a hole.
  const auto strip = [&](int from, int to, int y0 = 0, int y1 = floor_cells) {
    scene.rectangle({voxel * from, voxel * y0, 0}, voxel * (to - from) * x, voxel * (y1 - y0) * y);
  };
  strip(0, 30), strip(33, 70), strip(76, 90), strip(90, 110, 0, 40), strip(90, 110, 60, 120), strip(110, 120);
  scene.rectangle({0, 0, deep}, size * x, size * y);
  plan.paint(Truth::open, 30, 33, 0, 120, nothing);
  plan.paint(Truth::open, 70, 76, 0, 120, nothing);
  plan.paint(Truth::open, 90, 110, 40, 60, nothing);
  scene.box({voxel * 45, voxel * 20, 0}, {voxel * 60, voxel * 35, 0.4});
  plan.paint(Truth::occupied, 45, 60, 20, 35, nothing);
  scene.box({voxel * 40, voxel * 80, 0.7}, {voxel * 64, voxel * 86, 0.76});
  plan.paint(Truth::hanging, 40, 64, 80, 86, nothing);
  std::mt19937_64 rng = test::rng();
  Mapper mapper(test::of_voxels(voxel, false));
  for (const double height : {1.5, 0.6})
    for (int i = 0; i < 12; ++i) {
      const double turn = 2 * std::numbers::pi * i / 12;
      const Eigen::Vector3d middle(size / 2, size / 2, 0);
      const Eigen::Vector3d eye = middle + 1.3 * (std::cos(turn) * x + std::sin(turn) * y) + height * z;
      mapper.insert(camera_scan(scene, test::look_at(eye, middle + 0.3 * (eye - middle).cross(z)), rng,
                                {400, 300, 250}));
    }
  mapper.drain();
  const GroundView view(mapper.snapshot(), mapper.map().octree(), rules_of_disc());
  // Of 60,000; 13 to 36 by seed, half of them places that region leaves out beside margins.
  EXPECT_LE(print(ask(plan, view, 1), "mapped"), 60);
}

}  // namespace
}  // namespace octosurf::planning
