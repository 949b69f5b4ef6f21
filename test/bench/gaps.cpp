// How much of the ground that a sensor could see is supported, and whether any of what was bridged is a void.
#include "bench/support.hpp"
#include "evaluation/planar_region.hpp"
#include "simulation/recording.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <octosurf/gaps.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/up.hpp>

namespace octosurf::bench {
namespace {

constexpr double reach = 8;                                 // m: farther ground is not asked for
constexpr double off_plane = 0.02;                          // m, as evaluate()'s tolerance at 2 cm
constexpr double level = 0.1745329251994;                   // rad: 10°
constexpr double asked_every = 0.05, sampled_every = 0.01;  // m

struct Options {
  std::vector<std::string> scenes{"office", "room", "stairs", "stones"};
  std::vector<std::string> sensors{"spinning", "tilting"};
  std::size_t seeds = 1;
  std::uint64_t first_seed = 1;
  double resolution = 0.02;
};

/// Directions in which a sensor looks: by whole 2° of azimuth, from its lowest to its highest ray.
class View {
 public:
  explicit View(const std::vector<Eigen::Vector3f>& rays) {
    for (const Eigen::Vector3f& ray : rays) {
      const Eigen::Vector3d to = ray.cast<double>();
      spans_[column_of(to)].extend(Eigen::Matrix<double, 1, 1>(elevation_of(to)));
    }
  }
  bool holds(const Eigen::Vector3d& to) const {
    return spans_[column_of(to)].contains(Eigen::Matrix<double, 1, 1>(elevation_of(to)));
  }

 private:
  static std::size_t column_of(const Eigen::Vector3d& to) {
    const double turns = std::atan2(to.y(), to.x()) / (2 * std::numbers::pi);
    return static_cast<std::size_t>(std::floor((turns + 1) * columns)) % columns;
  }
  static double elevation_of(const Eigen::Vector3d& to) { return std::atan2(to.z(), to.head<2>().norm()); }
  static constexpr std::size_t columns = 180;
  std::array<Eigen::AlignedBox1d, columns> spans_;
};

struct Face {
  const evaluation::TrueFace* truth;
  evaluation::PlanarRegion region;
  Eigen::Isometry3d T_face_map;
};

/// The faces that stand at the end.
class TrueWorld {
 public:
  TrueWorld(const evaluation::Truth& truth, const Eigen::Vector3d& up) : up_(up) {
    for (const evaluation::TrueFace& face : truth.faces)
      if (!face.gone)
        faces_.push_back({&face, evaluation::PlanarRegion(face.polygons), face.T_map_face.inverse()});
  }

  template <class Visit>
  void for_each_on_ground(const Visit& visit) const {
    for (const Face& face : faces_)
      if (is_level(face))
        face.region.for_each_cell(asked_every, [&](const Eigen::Vector2d& uv) {
          visit(Eigen::Vector3d(face.truth->T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0)));
        });
  }

  /// No face between.
  bool sees(const Eigen::Vector3d& eye, const Eigen::Vector3d& p) const {
    return std::none_of(faces_.begin(), faces_.end(), [&](const Face& face) {
      const double from = height(face, eye), to = height(face, p);
      if (std::fabs(to) < 1e-3 || from * to >= 0) return false;
      const Eigen::Vector3d crossing = eye + (p - eye) * (from / (from - to));
      return face.region.contains((face.T_face_map * crossing).head<2>());
    });
  }

  /// Neither ground, nor within `margin` of its rim, nor inside of something.
  bool is_void(const Eigen::Vector3d& p, double margin) const {
    const bool on_ground = std::any_of(faces_.begin(), faces_.end(), [&](const Face& face) {
      return is_level(face) && std::fabs(height(face, p)) < off_plane &&
             face.region.within((face.T_face_map * p).head<2>(), margin);
    });
    if (on_ground) return false;
    const Eigen::Vector3d x = up_.unitOrthogonal(), y = up_.cross(x);
    const std::array<Eigen::Vector3d, 6> ways{up_, -up_, x, -x, y, -y};
    return std::none_of(ways.begin(), ways.end(), [&](const auto& way) { return meets_a_back(p, way); });
  }

 private:
  bool is_level(const Face& face) const { return face.truth->plane.normal.dot(up_) > std::cos(level); }
  /// The first face on a ray is seen from inside.
  bool meets_a_back(const Eigen::Vector3d& p, const Eigen::Vector3d& way) const {
    double next = std::numeric_limits<double>::infinity();
    bool back = false;
    for (const Face& face : faces_) {
      const double cosine = face.truth->plane.normal.dot(way);
      const double off = -height(face, p) / cosine;
      if (std::fabs(cosine) < 1e-6 || off < 0 || off > next) continue;
      if (!face.region.contains((face.T_face_map * (p + off * way)).head<2>())) continue;
      next = off;
      back = cosine > 0;
    }
    return back;
  }
  static double height(const Face& face, const Eigen::Vector3d& p) {
    return face.truth->plane.normal.dot(p) - face.truth->plane.offset;
  }

  Eigen::Vector3d up_;
  std::vector<Face> faces_;
};

/// Level surfaces, ready to be asked.
class Supported {
 public:
  Supported(const Snapshot& snapshot, const Eigen::Vector3d& up) {
    for (const SurfacePtr& surface : snapshot.surfaces)
      if (surface->plane.normal.dot(up) > std::cos(level))
        surfaces_.push_back({surface, evaluation::PlanarRegion(surface->polygons)});
  }
  bool at(const Eigen::Vector3d& p) const {
    return std::any_of(surfaces_.begin(), surfaces_.end(), [&](const auto& one) {
      const Eigen::Vector3d local = one.first->T_map_surface.inverse() * p;
      return std::fabs(local.z()) < off_plane && one.second.contains(local.head<2>());
    });
  }

 private:
  std::vector<std::pair<SurfacePtr, evaluation::PlanarRegion>> surfaces_;
};

struct Row {
  std::size_t near = 0, seen = 0;                   // places
  std::array<std::size_t, 2> of_near{}, of_seen{};  // supported: as mapped, with gaps
  // Samples; `beyond`: farther off what is there than a cell that meets it reaches, √2 d.
  std::size_t bridged = 0, over_void = 0, beyond = 0;
};

void add(const simulation::SimulationOptions& options, double resolution, Row& row) {
  const simulation::Recording recording(options);
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  Mapper mapper(parameters);
  mapper.share_octree();
  std::vector<Eigen::Isometry3d> poses;
  auto visibility = recording.visibility();
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const simulation::Readings ideal = recording.ideal(i);
    visibility.add(i, ideal);
    poses.push_back(recording.true_pose(i));
    mapper.insert(recording.labelled_scan(i, ideal).scan);
  }
  const evaluation::Truth truth = visibility.truth();
  const Eigen::Vector3d up = up_of(mapper.map()).direction;
  const std::shared_ptr<const Snapshot> mapped = mapper.snapshot();
  std::map<SurfaceId, std::vector<Gap>> gaps;
  const auto grounded = with_gaps(*mapped, mapper.map().octree(), widest_gap_m, &gaps);

  const TrueWorld world(truth, up);
  const View view(recording.rays());
  const Supported before(*mapped, up), after(*grounded, up);
  world.for_each_on_ground([&](const Eigen::Vector3d& p) {
    bool near = false, seen = false;
    for (const Eigen::Isometry3d& pose : poses) {
      if ((pose.translation() - p).norm() > reach) continue;
      near = true;
      seen = view.holds(pose.inverse() * p) && world.sees(pose.translation(), p);
      if (seen) break;
    }
    if (!near) return;
    const std::array<bool, 2> supported{before.at(p), after.at(p)};
    ++row.near;
    row.seen += seen ? 1 : 0;
    for (std::size_t k = 0; k < supported.size(); ++k) {
      row.of_near[k] += supported[k] ? 1 : 0;
      row.of_seen[k] += seen && supported[k] ? 1 : 0;
    }
  });
  for (const SurfacePtr& surface : grounded->surfaces) {
    if (surface->plane.normal.dot(up) <= std::cos(level)) continue;
    for (const Gap& gap : gaps[surface->id]) {
      if (!gap.bridged) continue;
      evaluation::PlanarRegion({gap.outline}).for_each_cell(sampled_every, [&](const Eigen::Vector2d& uv) {
        const Eigen::Vector3d p = surface->to_map(uv);
        ++row.bridged;
        row.over_void += world.is_void(p, 0) ? 1 : 0;
        row.beyond += world.is_void(p, std::numbers::sqrt2 * resolution) ? 1 : 0;
      });
    }
  }
}

std::vector<std::string> cells(const std::string& name, const Row& row) {
  const auto share = [](std::size_t part, std::size_t all) {
    return fixed(all > 0 ? 100 * static_cast<double>(part) / static_cast<double>(all) : 0, 1);
  };
  const auto area = [](std::size_t samples) {
    return fixed(static_cast<double>(samples) * sampled_every * sampled_every, 4);
  };
  return {name,
          fixed(static_cast<double>(row.near) * asked_every * asked_every, 1),
          share(row.seen, row.near),
          share(row.of_seen[0], row.seen),
          share(row.of_seen[1], row.seen),
          share(row.of_near[0], row.near),
          share(row.of_near[1], row.near),
          area(row.bridged),
          area(row.over_void),
          area(row.beyond)};
}

void body(const Options& options) {
  TextTable table({"", "near m²", "in sight %", "as mapped %", "bridged %", "all: as mapped %", "bridged %",
                   "bridged m²", "over void", "> √2 d off"});
  for (const std::string& sensor : options.sensors) {
    table.rule();
    for (const std::string& scene : options.scenes) {
      Row row;
      for (std::size_t k = 0; k < options.seeds; ++k) {
        simulation::SimulationOptions simulation;
        simulation.sensor = sensor;
        simulation.seed = options.first_seed + k;
        set_scene(scene, simulation);
        add(simulation, options.resolution, row);
      }
      table.add(cells(sensor + ", " + scene, row));
    }
  }
  std::printf(
      "True level ground within 8 m of a scan, of it what a scan had in sight, and the shares of both that "
      "are\n"
      "supported.\n%s",
      table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"supported ground and bridged voids on maps of simulated scenes, against the truth"};
  app.add_option("--scenes", options.scenes)->delimiter(',')->capture_default_str();
  app.add_option("--sensors", options.sensors)->delimiter(',')->capture_default_str();
  app.add_option("--seeds", options.seeds, "recordings of each")->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_option("--resolution", options.resolution, "m")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
