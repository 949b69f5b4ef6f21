// How much of the ground that a sensor could see is supported, and whether any of what was bridged is a void.

#include "bench/bench.hpp"

#include <octosurf/gaps.hpp>

namespace octosurf::bench {
namespace {

constexpr double near_m = 8;                                // m: farther ground does not count
constexpr double on_plane_m = 0.02;                         // m, as evaluate()'s tolerance at 2 cm
constexpr double level_rad = 10 / deg;                      // of ground
constexpr double asked_every = 0.05, sampled_every = 0.01;  // m

/// Directions in which a sensor looks: by whole 2° of azimuth, from its lowest to its highest ray.
class View {
 public:
  explicit View(const std::vector<Eigen::Vector3f>& rays) {
    for (const Eigen::Vector3f& ray : rays) {
      const Eigen::Vector3d to = ray.cast<double>();
      spans_[column_of(to)].extend(elevation_of(to));
    }
  }
  bool holds(const Eigen::Vector3d& to) const { return spans_[column_of(to)].contains(elevation_of(to)); }

 private:
  static std::size_t column_of(const Eigen::Vector3d& to) {
    const double turns = std::atan2(to.y(), to.x()) / (2 * std::numbers::pi);
    return static_cast<std::size_t>(std::floor((turns + 1) * columns)) % columns;
  }
  static Eigen::Matrix<double, 1, 1> elevation_of(const Eigen::Vector3d& to) {
    return Eigen::Matrix<double, 1, 1>(std::atan2(to.z(), to.head<2>().norm()));
  }
  static constexpr std::size_t columns = 180;
  std::array<Eigen::AlignedBox1d, columns> spans_;
};

bool is_level(const Face& face, const Eigen::Vector3d& up) {
  return face.normal().dot(up) > std::cos(level_rad);
}

/// The faces that stand at the end.
class TrueWorld {
 public:
  TrueWorld(const evaluation::Truth& truth, const Eigen::Vector3d& up)
      : up_(up), faces_(standing_faces(truth)) {}

  template <class Visit>
  void for_each_on_ground(const Visit& visit) const {
    for (const Face& face : faces_)
      if (is_level(face, up_)) face.for_each_point(asked_every, visit);
  }

  /// No face between.
  bool sees(const Eigen::Vector3d& eye, const Eigen::Vector3d& p) const {
    return std::ranges::none_of(faces_, [&](const Face& face) {
      const double from = face.height(eye), to = face.height(p);
      if (std::fabs(to) < 1e-3 || from * to >= 0) return false;
      return face.holds(eye + (p - eye) * (from / (from - to)));
    });
  }

  /// Neither ground, nor within `margin` of its rim, nor inside of something.
  bool is_void(const Eigen::Vector3d& p, double margin) const {
    if (std::ranges::any_of(faces_, [&](const Face& face) {
          return is_level(face, up_) && std::fabs(face.height(p)) < on_plane_m &&
                 face.region.within(face.foot(p), margin);
        }))
      return false;
    const Eigen::Vector3d x = up_.unitOrthogonal(), y = up_.cross(x);
    const std::array<Eigen::Vector3d, 6> ways{up_, -up_, x, -x, y, -y};
    return std::ranges::none_of(ways, [&](const auto& way) { return meets_a_back(p, way); });
  }

 private:
  /// The first face on a ray is seen from inside.
  bool meets_a_back(const Eigen::Vector3d& p, const Eigen::Vector3d& way) const {
    double next = std::numeric_limits<double>::infinity();
    bool back = false;
    for (const Face& face : faces_) {
      const double cosine = face.normal().dot(way), off = -face.height(p) / cosine;
      if (std::fabs(cosine) < 1e-6 || off < 0 || off > next || !face.holds(p + off * way)) continue;
      next = off;
      back = cosine > 0;
    }
    return back;
  }

  Eigen::Vector3d up_;
  std::vector<Face> faces_;
};

}  // namespace

/// Places on true level ground within reach of a scan, which of them one had in sight, and of both what is
/// supported as mapped and with gaps bridged; m² that were bridged, that of it over a void, and farther off
/// what is there than a cell that meets it reaches, √2 d.
void gaps(Mapper& mapper, const Recorded& recorded, const Options& options, const Json& recording) {
  const Eigen::Vector3d up = up_of(mapper.map()).direction;
  const std::shared_ptr<const Snapshot> as_mapped = mapper.snapshot();
  GroundRules rules;
  rules.widest_unseen_m = widest_gap_m;
  const GroundView ground(as_mapped, mapper.map().octree(), rules);
  const TrueWorld world(recorded.truth, up);
  const View view(recorded.simulated->rays());
  const std::vector<Face> before = faces_of(*as_mapped), after = faces_of(*ground.solid());
  const auto supported = [&](const std::vector<Face>& faces, const Eigen::Vector3d& p) {
    return std::ranges::any_of(faces, [&](const Face& face) {
      return is_level(face, up) && std::fabs(face.height(p)) < on_plane_m && face.holds(p);
    });
  };
  Counts asked{"near", "near_mapped", "near_bridged", "seen", "seen_mapped", "seen_bridged"};
  world.for_each_on_ground([&](const Eigen::Vector3d& p) {
    bool is_near = false, in_sight = false;
    for (std::size_t i = 0; i < recorded.simulated->size() && !in_sight; ++i) {
      const Eigen::Isometry3d pose = recorded.simulated->true_pose(i);
      if ((pose.translation() - p).norm() > near_m) continue;
      is_near = true;
      in_sight = view.holds(pose.inverse() * p) && world.sees(pose.translation(), p);
    }
    if (!is_near) return;
    const bool mapped_there = supported(before, p), bridged_there = supported(after, p);
    ++asked["near"];
    asked["near_mapped"] += mapped_there;
    asked["near_bridged"] += bridged_there;
    asked["seen"] += in_sight;
    asked["seen_mapped"] += in_sight && mapped_there;
    asked["seen_bridged"] += in_sight && bridged_there;
  });
  Counts sampled{"bridged", "over_void", "beyond"};
  for (const Face& face : after) {
    if (!is_level(face, up)) continue;
    for (const Gap& gap : ground.gaps(face.surface->id)) {
      if (!gap.bridged) continue;
      evaluation::PlanarRegion({gap.outline}).for_each_cell(sampled_every, [&](const Eigen::Vector2d& uv) {
        const Eigen::Vector3d p = face.surface->to_map(uv);
        ++sampled["bridged"];
        sampled["over_void"] += world.is_void(p, 0);
        sampled["beyond"] += world.is_void(p, std::numbers::sqrt2 * options.resolutions.front());
      });
    }
  }
  Json areas;
  for (const auto& [counts, edge] : {std::pair(&asked, asked_every), {&sampled, sampled_every}})
    for (const auto& [name, samples] : counts->row.items())
      areas[name + "_m2"] = samples.get<double>() * edge * edge;
  write(recording, areas);
}

}  // namespace octosurf::bench
