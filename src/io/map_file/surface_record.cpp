#include "io/map_file/surface_record.hpp"

#include "geometry/ring_check.hpp"
#include "io/map_file/record_stream.hpp"
#include "map_file.pb.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

using Doubles = google::protobuf::RepeatedField<double>;

constexpr int moment_doubles = 13;  // of a class
// Per inlier, and the weight of one: surfaces forget at a hundred readings, and weights are squared ratios of
// noises from 1 µm on.
constexpr double most_readings = 1e4, most_weight = 1e8;
constexpr double rotation_slack = 1e-6;
constexpr double plane_slack = 1e-4;    // m
constexpr double edge_slack = 1e-6;     // relative
constexpr double moments_slack = 1e-3;  // relative: accumulated rounding of millions of changes

void put(const Eigen::Vector3d& v, Doubles& out) { out.Add(v.begin(), v.end()); }

void put(const Plane& plane, Doubles& out) {
  put(plane.normal, out);
  out.Add(plane.offset);
}

void put(const Eigen::Isometry3d& T, Doubles& out) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) out.Add(T(row, column));
}

void put(const geometry::Moments& m, Doubles& out) {
  out.Add(m.count);
  put(m.sum, out);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) out.Add(m.outer(row, column));
}

void put(const std::vector<Polygon>& polygons, map_file::Polygons& out) {
  const auto put_ring = [&](const Ring2& ring) {
    out.add_vertices(static_cast<std::uint32_t>(ring.size()));
    for (const Eigen::Vector2d& p : ring) {
      out.add_uv(p.x());
      out.add_uv(p.y());
    }
  };
  for (const Polygon& polygon : polygons) {
    out.add_rings(static_cast<std::uint32_t>(1 + polygon.holes.size()));
    put_ring(polygon.outer);
    for (const Ring2& hole : polygon.holes) put_ring(hole);
  }
}

/// Reads one record's numbers; errors name the surface.
class SurfaceReader {
 public:
  SurfaceReader(const map_file::Surface& record, const SurfaceBounds& bounds, const std::string& where)
      : record_(record), bounds_(bounds), where_(where), reach_(std::ldexp(bounds.resolution, 18)) {}

  surfaces::SurfaceModel::State operator()(std::vector<surfaces::Inlier> inliers) {
    surfaces::SurfaceModel::State s;
    s.id = record_.id();
    s.inliers = std::move(inliers);
    require(record_.has_inliers() && record_.inliers() == s.inliers.size() && !s.inliers.empty(),
            "has other inliers than the octree");
    s.plane = plane(record_.plane());
    s.pose = frame(record_.pose());
    s.hash_frame = frame(record_.hash_frame());
    require((s.pose.linear().col(2) - s.plane.normal).norm() <= rotation_slack &&
                std::fabs(s.plane.signed_distance(s.pose.translation())) <= plane_slack,
            "has a frame that is not its plane's");
    s.reference = place(numbers(record_.reference(), 3));
    read_moments(s);
    read_evidence(s);
    read_covariance(s);
    s.polygons = polygons(record_.polygons());
    if (const auto fault = geometry::fault_of(s.polygons))
      require(false, ("has " + std::string(*fault)).c_str());
    check_edges(s.polygons);
    for (const SurfaceId parent : record_.parents()) {
      require(parent > 0 && parent < bounds_.next_id, "has a parent that never was");
      s.parents.push_back(parent);
    }
    s.polygons_stale = record_.polygons_stale();
    s.born = record_.born();
    s.revision = record_.revision();
    s.checked_size = record_.checked_inliers();
    require(s.checked_size <= largest_count, "has counts that make no sense");
    require(record_.has_polygons_stale() && record_.has_revision() && s.revision <= bounds_.revision,
            "has no revision, or one that is to come");
    require(s.born <= s.revision, "changed before it was there");
    return s;
  }

 private:
  void require(bool holds, const char* what) const {
    if (!holds)
      throw Error(Error::Kind::data, where_,
                  "is damaged: surface " + std::to_string(record_.id()) + " " + what,
                  "restore it from a backup");
  }

  std::span<const double> numbers(const Doubles& field, int count) const {
    require(field.size() == count, "lacks numbers");
    for (const double value : field) require(std::isfinite(value), "has a number that is not finite");
    return {field.data(), static_cast<std::size_t>(count)};
  }

  /// Within eight times the octree's range, so that hash cells fit their integers.
  Eigen::Vector3d place(std::span<const double> v) const {
    const Eigen::Vector3d p(v[0], v[1], v[2]);
    require(p.cwiseAbs().maxCoeff() <= reach_, "lies far outside the octree");
    return p;
  }

  Plane plane(const Doubles& field) const {
    const auto v = numbers(field, 4);
    const Plane plane{{v[0], v[1], v[2]}, v[3]};
    require(std::fabs(plane.normal.norm() - 1) <= rotation_slack, "has a normal that is not of length 1");
    require(std::fabs(plane.offset) <= 2 * reach_, "lies far outside the octree");
    return plane;
  }

  Eigen::Isometry3d frame(const Doubles& field) const {
    const auto v = numbers(field, 12);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        T(row, column) = v[static_cast<std::size_t>(4 * row + column)];
    const Eigen::Matrix3d R = T.linear();
    require((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= rotation_slack &&
                R.determinant() > 0,
            "has a frame that is not a rigid motion");
    const Eigen::Vector3d origin = T.translation();
    place({origin.data(), 3});
    return T;
  }

  static geometry::Moments moments(std::span<const double> v) {
    geometry::Moments m;
    m.count = v[0];
    for (int i = 0; i < 3; ++i) m.sum[i] = v[static_cast<std::size_t>(1 + i)];
    for (int i = 0; i < 9; ++i) m.outer(i / 3, i % 3) = v[static_cast<std::size_t>(4 + i)];
    return m;
  }

  void read_evidence(surfaces::SurfaceModel::State& s) const {
    if (record_.evidence_size() == 0) return;  // nothing was seen again
    const auto v = numbers(record_.evidence(), 1 + moment_doubles);
    s.evidence = {moments(v.subspan(1)), v[0]};
    const geometry::Moments& m = s.evidence.moments;
    const auto bounded = [&](const auto& x, double limit) { return x.cwiseAbs().maxCoeff() <= limit; };
    const double readings = most_readings * static_cast<double>(s.inliers.size());
    require(s.evidence.readings >= 0 && s.evidence.readings <= readings && m.count >= 0 &&
                m.count <= most_weight * readings && bounded(m.sum, reach_ * m.count + plane_slack) &&
                bounded(m.outer, reach_ * reach_ * m.count + plane_slack) &&
                m.outer.diagonal().minCoeff() >= 0 && m.outer.isApprox(m.outer.transpose(), moments_slack),
            "has evidence that no scan gives");
  }

  void read_covariance(surfaces::SurfaceModel::State& s) const {
    const auto v = numbers(record_.covariance(), 6);
    s.covariance << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
    require(
        s.covariance.cwiseAbs().maxCoeff() <= reach_ * reach_ && s.covariance.llt().info() == Eigen::Success,
        "has a covariance that no fit gives");
  }

  void read_moments(surfaces::SurfaceModel::State& s) const {
    const auto v = numbers(record_.moments(), moment_doubles * static_cast<int>(s.moments.size()));
    std::array<geometry::Moments, sensing::NoiseModel::classes> sums;
    for (const surfaces::Inlier& inlier : s.inliers)
      sums[inlier.range_class].add(inlier.position.cast<double>() - s.reference);
    for (std::size_t c = 0; c < s.moments.size(); ++c) {
      const geometry::Moments& m = s.moments[c] = moments(v.subspan(c * moment_doubles, moment_doubles));
      require(m.count == sums[c].count &&
                  (m.sum - sums[c].sum).norm() <= moments_slack * (1 + sums[c].sum.norm()) &&
                  (m.outer - sums[c].outer).norm() <= moments_slack * (1 + sums[c].outer.norm()),
              "has moments that are not its inliers'");
    }
  }

  std::vector<Polygon> polygons(const map_file::Polygons& field) const {
    const auto total = [](const auto& counts) {
      return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    };
    require(total(field.rings()) == static_cast<std::uint64_t>(field.vertices_size()) &&
                2 * total(field.vertices()) == static_cast<std::uint64_t>(field.uv_size()),
            "has polygons that do not add up");
    std::vector<Polygon> polygons;
    int ring = 0, number = 0;
    const auto coordinate = [&] {
      const double value = field.uv(number++);
      require(std::fabs(value) <= 2 * reach_, "has a polygon outside the octree, or not finite");
      return value;
    };
    const auto next_ring = [&] {
      Ring2 points(field.vertices(ring++));
      require(points.size() >= 3, "has a ring of fewer than three vertices");
      for (Eigen::Vector2d& p : points) {
        p.x() = coordinate();
        p.y() = coordinate();
      }
      return points;
    };
    for (const std::uint32_t rings : field.rings()) {
      require(rings > 0, "has a polygon without rings");
      Polygon& polygon = polygons.emplace_back();
      polygon.outer = next_ring();
      for (std::uint32_t hole = 1; hole < rings; ++hole) polygon.holes.push_back(next_ring());
    }
    return polygons;
  }

  void check_edges(const std::vector<Polygon>& polygons) const {
    const double longest = bounds_.max_hole_size * (1 + edge_slack);
    for (const Polygon& polygon : polygons) {
      const auto short_edges = [&](const Ring2& ring) {
        for (std::size_t i = 0; i < ring.size(); ++i)
          if ((ring[i] - ring[i + 1 < ring.size() ? i + 1 : 0]).norm() > longest) return false;
        return true;
      };
      require(
          short_edges(polygon.outer) && std::all_of(polygon.holes.begin(), polygon.holes.end(), short_edges),
          "has boundary points more than h apart");
    }
  }

  const map_file::Surface& record_;
  const SurfaceBounds& bounds_;
  const std::string& where_;
  double reach_;
};

}  // namespace

void write_surface(const surfaces::SurfaceModel::State& surface, map_file::Surface& record) {
  record.set_id(surface.id);
  put(surface.plane, *record.mutable_plane());
  put(surface.pose, *record.mutable_pose());
  put(surface.hash_frame, *record.mutable_hash_frame());
  put(surface.reference, *record.mutable_reference());
  for (const geometry::Moments& moments : surface.moments) put(moments, *record.mutable_moments());
  if (surface.evidence.readings > 0) {
    record.add_evidence(surface.evidence.readings);
    put(surface.evidence.moments, *record.mutable_evidence());
  }
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column) record.add_covariance(surface.covariance(row, column));
  put(surface.polygons, *record.mutable_polygons());
  for (const SurfaceId parent : surface.parents) record.add_parents(parent);
  record.set_polygons_stale(surface.polygons_stale);
  if (surface.born > 0) record.set_born(surface.born);
  record.set_revision(surface.revision);
  if (surface.checked_size > 0) record.set_checked_inliers(surface.checked_size);
  record.set_inliers(surface.inliers.size());
}

surfaces::SurfaceModel::State read_surface(const map_file::Surface& record,
                                           std::vector<surfaces::Inlier> inliers, const SurfaceBounds& bounds,
                                           const std::string& where) {
  return SurfaceReader(record, bounds, where)(std::move(inliers));
}

}  // namespace octosurf::io
