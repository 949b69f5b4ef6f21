// Parts of the surfaces' work: normals, and the outline of a surface that grows.

#include "bench/speed/contestant.hpp"
#include "occupancy/point_window.hpp"
#include "reference/alpha_shape.hpp"
#include "reference/pcl_steps.hpp"
#include "simulation/random.hpp"
#include "surfaces/normal_field.hpp"
#include "surfaces/surface_model.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

namespace octosurf::bench {
namespace {

/// The octree of one scan.
occupancy::OccupancyMap octree_of(const Scan& scan, const Json& settings) {
  occupancy::OccupancyMap map(parameters_from(settings).occupancy);
  sensing::Downsampler downsampler(map.grid());
  map.insert(downsampler(scan, 0, max_range_of(settings)), downsampler, nullptr);
  return map;
}

/// tell(): {"normals": [[x, y, z, curvature] or null, …]} for the octree's points in their order.
class NormalFieldSide : public Contestant {
 public:
  explicit NormalFieldSide(const Json& settings)
      : settings_(settings), parameters_(parameters_from(settings)), noise_(parameters_) {
    // Both ends at one radius: no widening, which the incumbent does not have either.
    parameters_.detection.normal_radius = parameters_.detection.search_radius =
        settings.at("radius").get<double>();
  }
  void prepare(const Scan& scan) override {
    map_.emplace(octree_of(scan, settings_));
    keys_.clear();
    map_->for_each_point([&](const occupancy::VoxelPoint& point) { keys_.push_back(point.key); });
  }
  void run() override {
    planes_.clear();
    occupancy::PointWindow window(*map_);
    surfaces::NormalField field(window, parameters_, noise_, surfaces_);
    for (const geometry::VoxelKey key : keys_) planes_.push_back(field.at(window.find(key)));
  }
  Json tell(const Json& /*question*/) override {
    Json normals = Json::array();
    for (const surfaces::LocalPlane& plane : planes_)
      normals.push_back(
          plane.known ? Json{plane.normal.x(), plane.normal.y(), plane.normal.z(), plane.curvature} : Json());
    return {{"normals", normals}};
  }

 private:
  Json settings_;
  Parameters parameters_;
  sensing::NoiseModel noise_;
  surfaces::SurfaceStore surfaces_{parameters_.occupancy.resolution};  // none: every neighbour counts
  std::optional<occupancy::OccupancyMap> map_;
  std::vector<geometry::VoxelKey> keys_;
  std::vector<surfaces::LocalPlane> planes_;
};

/// The same of pcl::MovingLeastSquares; PCL's normals have no side.
class MlsSide : public Contestant {
 public:
  explicit MlsSide(const Json& settings)
      : settings_(settings), radius_(settings.at("radius").get<double>()) {}
  void prepare(const Scan& scan) override {
    points_.clear();
    octree_of(scan, settings_).for_each_point([&](const occupancy::VoxelPoint& point) {
      points_.push_back(point.position);
    });
  }
  void run() override { normals_ = reference::mls_normals(points_, radius_); }
  Json tell(const Json& /*question*/) override {
    Json normals(points_.size(), Json());
    for (const reference::PointNormal& n : normals_)
      normals[n.point] = {n.normal.x(), n.normal.y(), n.normal.z(), n.curvature};
    return {{"normals", normals}};
  }

 private:
  Json settings_;
  double radius_;
  reference::Points points_;
  std::vector<reference::PointNormal> normals_;
};

/// A large floor, slightly tilted, with round holes, that grows by patches along one edge.
class GrowingFloor {
 public:
  explicit GrowingFloor(const Json& settings)
      : d_(settings.at("resolution").get<double>()),
        start_(settings.at("inliers").get<std::size_t>()),
        step_(settings.at("step").get<std::size_t>()),
        side_(static_cast<int>(std::sqrt(static_cast<double>(start_)))),
        grid_(d_) {
    plane_.normal = Eigen::Vector3d(0.1, 0.2, 1).normalized();
    for (int x = 0; inliers_.size() < start_; ++x)
      for (int y = -side_ / 2; y < side_ / 2 && inliers_.size() < start_; ++y)
        if (!in_hole(x, y)) add(x, y);
    next_column_ = inliers_.back().key.x - geometry::VoxelGrid::origin + 1;
  }

  const Plane& plane() const { return plane_; }
  double resolution() const { return d_; }
  const std::vector<surfaces::Inlier>& inliers() const { return inliers_; }

  /// One more patch beyond the edge, `step` voxels, next to the patch before it.
  void grow() {
    constexpr int depth = 25;
    const int width = static_cast<int>(step_) / depth;
    const int first = -side_ / 2 + patches_++ * width % std::max(width, side_ - width);
    for (int y = first; y < first + width; ++y)
      for (int x = next_column_; x < next_column_ + depth; ++x) add(x, y);
  }

 private:
  bool in_hole(int x, int y) const {
    const double pitch = 100, radius = 12;  // cells
    return std::hypot(std::remainder(x, pitch), std::remainder(y, pitch)) < radius;
  }
  /// The voxel of column (x, y) that the plane passes, with a point within 0.3 d and the noise.
  void add(int x, int y) {
    const double u = (x + 0.5 + random_.uniform(-0.3, 0.3)) * d_;
    const double v = (y + 0.5 + random_.uniform(-0.3, 0.3)) * d_;
    const double z = -(plane_.normal.x() * u + plane_.normal.y() * v) / plane_.normal.z();
    surfaces::Inlier inlier;
    inlier.range_class = 4;
    inlier.position = Eigen::Vector3d(u, v, z + random_.uniform(-0.2, 0.2) * d_).cast<float>();
    if (grid_.key_of(inlier.position, inlier.key)) inliers_.push_back(inlier);
  }

  double d_;
  std::size_t start_, step_;
  int side_;
  geometry::VoxelGrid grid_;
  Plane plane_;
  simulation::Random random_{1, 1};
  std::vector<surfaces::Inlier> inliers_;
  int next_column_ = 0, patches_ = 0;
};

/// tell(): area, number of rings and vertices, and a digest of the rings that does not depend on where
/// a ring begins or which comes first.
Json rings_of(const surfaces::SurfaceModel& model) {
  std::size_t rings = 0, vertices = 0, digest = 0;
  double area_m2 = 0;
  const auto add = [&](const Ring2& ring) {
    area_m2 += reference::signed_area(ring);
    std::vector<std::pair<std::int64_t, std::int64_t>> rounded;
    for (const Eigen::Vector2d& p : ring)
      rounded.emplace_back(std::llround(p.x() * 1e9), std::llround(p.y() * 1e9));
    std::rotate(rounded.begin(), std::min_element(rounded.begin(), rounded.end()), rounded.end());
    std::size_t hash = rounded.size();
    const geometry::PackedKeyHash mix;
    for (const auto& [u, v] : rounded)
      hash = mix(mix(hash ^ static_cast<std::uint64_t>(u)) ^ static_cast<std::uint64_t>(v));
    digest += hash;
    ++rings;
    vertices += ring.size();
  };
  for (const Polygon& polygon : model.polygons()) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  return {{"rings", rings}, {"vertices", vertices}, {"digest", digest}, {"area_m2", area_m2}};
}

constexpr double max_hole_size = 0.08;  // m, h

surfaces::SurfaceModel model_of(const GrowingFloor& floor) {
  surfaces::SurfaceModel model(1, floor.plane(), Eigen::Vector3d::Zero(), floor.resolution());
  for (const surfaces::Inlier& inlier : floor.inliers()) model.add(inlier);
  return model;
}

/// The surface lives on: the new inliers are added and the outline is brought up to date.
class DeriveGrownSide : public Contestant {
 public:
  explicit DeriveGrownSide(const Json& settings) : floor_(settings), model_(model_of(floor_)) {
    model_.derive(max_hole_size);
  }
  void prepare(const Scan& /*scan*/) override {
    known_ = floor_.inliers().size();
    floor_.grow();
  }
  void run() override {
    for (std::size_t i = known_; i < floor_.inliers().size(); ++i) model_.add(floor_.inliers()[i]);
    model_.derive(max_hole_size);
  }
  Json tell(const Json& /*question*/) override { return rings_of(model_); }

 private:
  GrowingFloor floor_;
  surfaces::SurfaceModel model_;
  std::size_t known_ = 0;
};

/// The outline of a new surface with the same inliers; that they were added is not timed.
class DeriveFreshSide : public Contestant {
 public:
  explicit DeriveFreshSide(const Json& settings) : floor_(settings) {}
  void prepare(const Scan& /*scan*/) override {
    floor_.grow();
    model_.emplace(model_of(floor_));
  }
  void run() override { model_->derive(max_hole_size); }
  Json tell(const Json& /*question*/) override { return rings_of(*model_); }

 private:
  GrowingFloor floor_;
  std::optional<surfaces::SurfaceModel> model_;
};

/// The reference's alpha shape: CGAL's Delaunay triangulation of all inliers at once.
class DeriveReferenceSide : public Contestant {
 public:
  explicit DeriveReferenceSide(const Json& settings)
      : floor_(settings), to_plane_(geometry::plane_axes(floor_.plane().normal).transpose()) {}
  void prepare(const Scan& /*scan*/) override {
    floor_.grow();
    projected_.clear();
    for (const surfaces::Inlier& inlier : floor_.inliers())
      projected_.emplace_back((to_plane_ * inlier.position.cast<double>()).head<2>());
  }
  void run() override { shape_ = reference::alpha_shape(projected_, max_hole_size); }
  Json tell(const Json& /*question*/) override { return {{"area_m2", shape_.area_m2}}; }

 private:
  GrowingFloor floor_;
  Eigen::Matrix3d to_plane_;
  std::vector<Eigen::Vector2d> projected_;
  reference::AlphaShape shape_;
};

}  // namespace

std::unique_ptr<Contestant> make_derive_reference(const Json& settings) {
  return std::make_unique<DeriveReferenceSide>(settings);
}
std::unique_ptr<Contestant> make_normal_field(const Json& settings) {
  return std::make_unique<NormalFieldSide>(settings);
}
std::unique_ptr<Contestant> make_mls(const Json& settings) { return std::make_unique<MlsSide>(settings); }
std::unique_ptr<Contestant> make_derive_grown(const Json& settings) {
  return std::make_unique<DeriveGrownSide>(settings);
}
std::unique_ptr<Contestant> make_derive_fresh(const Json& settings) {
  return std::make_unique<DeriveFreshSide>(settings);
}

}  // namespace octosurf::bench
