// How far footholds on our surfaces can be trusted: random ones on maps of simulated recordings, against the
// truth, for several margins, and beside them the convex hull's plain inset.

#include "bench/bench.hpp"
#include "geometry/rings.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

namespace octosurf::bench {
namespace {

/// A foothold counts as accepted with at least these to the nearest edge, m; and last by the hull alone.
constexpr std::array margins{0.0, 0.01, 0.02, 0.03};
constexpr std::size_t by_hull = margins.size();
constexpr double inside_by = 0.01;   // m: truly supported is what lies so far inside
constexpr double false_from = 0.05;  // m off every true outline: no rim any more, nothing is there

/// Feet on outlines as mapped, and on ground by default.
std::vector<std::pair<std::string, GroundRules>> all_feet(double resolution) {
  std::vector<std::pair<std::string, GroundRules>> feet;
  for (const auto& [name, robot] : {std::pair("sole", Robot(Biped{})), {"ball", Robot(Quadruped{})}}) {
    GroundRules ground = GroundRules::of(robot, resolution), mapped = ground;
    mapped.as_mapped = true;
    mapped.limits = {};
    feet.push_back({name, mapped});
    feet.push_back({name + std::string(", ground"), ground});
  }
  return feet;
}

/// The heading that brings a contact's x axis to `x` on this surface.
double yaw_of(const Surface& surface, const Eigen::Vector3d& x) {
  const Eigen::Vector3d u = surface.T_map_surface.linear().transpose() * x;
  const Eigen::Vector2d zero = heading_on(surface, 0, Eigen::Vector3d::UnitZ());
  // Of a slope up to 30° a heading's projection is not quite turned by the same angle: turned on until it is.
  double yaw = std::atan2(u.y(), u.x()) - std::atan2(zero.y(), zero.x());
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d h = heading_on(surface, yaw, Eigen::Vector3d::UnitZ());
    yaw += std::atan2(h.x() * u.y() - h.y() * u.x(), h.dot(u.head<2>()));
  }
  return yaw;
}

/// The truth about places where a foot may be.
class Ground {
 public:
  /// A contact on a face that slopes little, anywhere that the sensor saw and at any heading.
  struct Place {
    Eigen::Isometry3d T_map_contact;       ///< z = the face's normal
    bool supported = false, seen = false;  ///< all of `points`
  };

  /// `tolerance`: m off a face's plane at which a surface's point still is on it.
  Ground(const evaluation::Truth& truth, double tolerance)
      : faces_(standing_faces(truth)), cells_(faces_.size()), cell_(truth.cell), tolerance_(tolerance) {
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (const evaluation::CellRun& run : faces_[f].truth->visible)
        for (int c = 0; c < run.count; ++c) cells_[f].emplace_back(run.row, run.column + c);
    for (std::size_t f = 0; f < faces_.size(); ++f)
      weights_.push_back(
          faces_[f].normal().z() < std::cos(max_slope) ? 0.0 : static_cast<double>(cells_[f].size()));
  }
  bool has_ground() const {
    return std::ranges::any_of(weights_, [](double weight) { return weight > 0; });
  }

  double off(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
    return off_outlines(faces_, p, normal, tolerance_, false_from);
  }

  /// Whether a face is over a place, lower than a contact's clearance.
  bool covered(const Eigen::Vector3d& at, const ContactLimits& limits) const {
    return std::ranges::any_of(faces_, [&](const Face& face) {
      if (face.normal().z() < 0.1) return false;
      const Eigen::Vector3d over = at - face.height(at) / face.normal().z() * Eigen::Vector3d::UnitZ();
      return over.z() - at.z() > limits.obstacle_from_m && over.z() - at.z() < limits.clearance_m &&
             face.holds(over);
    });
  }

  Place place(std::mt19937_64& rng, const std::vector<Eigen::Vector2d>& points) const {
    std::uniform_real_distribution<double> uniform(0, 1);
    std::discrete_distribution<std::size_t> by_area(weights_.begin(), weights_.end());
    const std::size_t f = by_area(rng);
    const Face& face = faces_[f];
    const auto& [row, column] = cells_[f][rng() % cells_[f].size()];
    const double v = (row + uniform(rng)) * cell_, u = (column + uniform(rng)) * cell_;
    const Eigen::Rotation2Dd turn(2 * std::numbers::pi * uniform(rng));
    Place place{face.truth->T_map_face, true, true};
    place.T_map_contact.translate(Eigen::Vector3d(u, v, 0));
    place.T_map_contact.rotate(Eigen::AngleAxisd(turn.angle(), Eigen::Vector3d::UnitZ()));
    for (const Eigen::Vector2d& point : points) {
      const Eigen::Vector2d p = Eigen::Vector2d(u, v) + turn * point, at = p / cell_;
      place.supported = place.supported && face.region.contains(p);
      const Cell cell(static_cast<int>(std::floor(at.y())), static_cast<int>(std::floor(at.x())));
      place.seen = place.seen && std::binary_search(cells_[f].begin(), cells_[f].end(), cell);
    }
    return place;
  }

 private:
  using Cell = std::pair<int, int>;  // row, column
  std::vector<Face> faces_;
  std::vector<std::vector<Cell>> cells_;  // that were seen, by face; in order
  std::vector<double> weights_;           // of faces that a foot is put on
  double cell_, tolerance_;
};

/// A surface that slopes little, and how planners without polygons have it: its convex hull.
struct Walkable {
  const Surface* surface;
  Ring2 hull;
  double area;
  Eigen::AlignedBox2d box;

  bool in_hull(const Ring2& ring, const Eigen::Isometry3d& T_map_contact) const {
    const Eigen::Isometry3d T = surface->T_map_surface.inverse() * T_map_contact;
    return std::all_of(ring.begin(), ring.end(), [&](const Eigen::Vector2d& p) {
      return planning::depth_in(hull, (T * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>()) >= 0;
    });
  }
};
std::vector<Walkable> walkable(const Snapshot& snapshot) {
  std::vector<Walkable> all;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (slope_rad(*surface) > max_slope || surface->polygons.empty()) continue;
    Ring2 points;
    for (const Polygon& polygon : surface->polygons)
      points.insert(points.end(), polygon.outer.begin(), polygon.outer.end());
    const Ring2 hull = planning::convex_hull(std::move(points));
    all.push_back({surface.get(), hull, geometry::signed_area(hull), {}});
    for (const Eigen::Vector2d& p : hull) all.back().box.extend(p);
  }
  return all;
}

/// The queries to one map for one foot.
struct Asked {
  const Mapper& mapper;
  const std::vector<Walkable>& surfaces;
  const Ground& ground;
  const GroundRules& rules;
  double tolerance;
  OccupancyView octree = mapper.map().octree();
  GroundView view{mapper.snapshot(), octree, rules};
  Ring2 ring = ring_of(rules.foot);
  /// Of each way to accept: footholds, and those of them that are off by more than so much; of truly good
  /// ones.
  std::vector<Counts> tallies{margins.size() + 1,
                              Counts{"accepted", "off_1cm", "off_2cm", "false", "good_accepted"}};
  Counts truly{"good", "room_unseen"};
  std::vector<double> us{};

  /// Random places on what the map says is there: how many are accepted, and which of them are not there.
  void ask_map(std::mt19937_64& rng, std::size_t count) {
    const std::vector<Eigen::Vector2d> points = points_of(rules.foot, 0);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<double> areas;
    for (const Walkable& one : surfaces) areas.push_back(one.area);
    std::discrete_distribution<std::size_t> by_area(areas.begin(), areas.end());
    for (std::size_t i = 0; i < count; ++i) {
      const Walkable& one = surfaces[by_area(rng)];
      const Eigen::AlignedBox2d& box = one.box;
      Eigen::Vector2d uv;
      do uv = box.min() + Eigen::Vector2d(uniform(rng), uniform(rng)).cwiseProduct(box.sizes());
      while (planning::depth_in(one.hull, uv) < 0);
      Foothold found;
      const double yaw = 2 * std::numbers::pi * uniform(rng);
      us.push_back(1000 *
                   time_ms([&] { found = view.foothold(one.surface->id, one.surface->to_map(uv), yaw); }));
      const bool hull = one.in_hull(ring, found.T_map_contact);
      if (!found.accepted && !hull) continue;
      double off = 0;
      for (const Eigen::Vector2d& p : points)
        off = std::max(off, ground.off(found.T_map_contact * Eigen::Vector3d(p.x(), p.y(), 0),
                                       one.surface->plane.normal));
      for (std::size_t m = 0; m < tallies.size(); ++m) {
        if (m == by_hull ? !hull : !found.accepted || found.margin_m < margins[m]) continue;
        ++tallies[m]["accepted"];
        tallies[m]["off_1cm"] += off > 0.01;
        tallies[m]["off_2cm"] += off > 0.02;
        tallies[m]["false"] += off >= false_from;
      }
    }
  }

  /// Whether no ray entered some voxel over a point of a foot, where the limits want it known.
  bool unseen_over(const Eigen::Isometry3d& T_map_contact, const Eigen::Vector2d& p) const {
    const ContactLimits& limits = rules.limits;
    for (double z = limits.obstacle_from_m; z < limits.unknown_to_m; z += octree.resolution() / 2)
      if (octree.at(T_map_contact * Eigen::Vector3d(p.x(), p.y(), z)).state == OccupancyView::State::unknown)
        return true;
    return false;
  }

  /// Places that are truly supported and were seen: how many are accepted, by any surface that is there.
  void ask_truth(std::mt19937_64& rng, std::size_t count) {
    const std::vector<Eigen::Vector2d> points = points_of(rules.foot, inside_by);
    for (std::size_t i = 0; i < count; ++i) {
      const Ground::Place place = ground.place(rng, points);
      if (!place.supported || !place.seen) continue;
      if (std::ranges::any_of(points, [&](const Eigen::Vector2d& p) {
            return ground.covered(place.T_map_contact * Eigen::Vector3d(p.x(), p.y(), 0), rules.limits);
          }))
        continue;
      const auto over = [&](const Eigen::Vector2d& p) { return unseen_over(place.T_map_contact, p); };
      const bool unseen = std::ranges::any_of(points, over);
      ++truly[unseen ? "room_unseen" : "good"];
      if (unseen) continue;
      double margin = -1;
      bool hull = false;
      const Eigen::Vector3d at = place.T_map_contact.translation();
      for (const Walkable& one : surfaces) {
        const Surface& surface = *one.surface;
        if (surface.plane.normal.dot(place.T_map_contact.linear().col(2)) < std::cos(max_slope / 2) ||
            std::abs(surface.plane.signed_distance(at)) > tolerance)
          continue;
        const double yaw = yaw_of(surface, place.T_map_contact.linear().col(0));
        const Foothold found = view.foothold(surface.id, at, yaw);
        if (found.accepted) margin = std::max(margin, found.margin_m);
        hull = hull || one.in_hull(ring, found.T_map_contact);
      }
      for (std::size_t m = 0; m < tallies.size(); ++m)
        tallies[m]["good_accepted"] += m == by_hull ? hull : margin >= margins[m];
    }
  }
};

}  // namespace

void footholds(const Options& options) {
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    Mapper mapper(parameters_at(options.resolutions.front(), options.set));
    for (const Scan& scan : recorded.scans) mapper.insert(scan);
    mapper.drain();
    const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
    const double d = snapshot->resolution, tolerance = std::max(0.02, 1.5 * d);
    const Ground ground(recorded.truth, tolerance);
    const std::vector<Walkable> surfaces = walkable(*snapshot);
    if (surfaces.empty() || !ground.has_ground()) return;
    std::mt19937_64 rng(recording.at("seed").get<std::uint64_t>());
    for (const auto& [foot, rules] : all_feet(d)) {
      Asked asked{mapper, surfaces, ground, rules, tolerance};
      asked.ask_map(rng, options.count);
      asked.ask_truth(rng, options.count);
      for (std::size_t m = 0; m < asked.tallies.size(); ++m) {
        Json row{{"foot", foot}, {"margin_m", m == by_hull ? Json("hull") : Json(margins[m])}};
        for (const Json& part : {asked.tallies[m].row, asked.truly.row, quantiles("", "us", asked.us)})
          row.update(part);
        write(recording, row);
      }
    }
  });
}

}  // namespace octosurf::bench
