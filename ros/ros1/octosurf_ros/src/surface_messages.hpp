#pragma once

#include <jsk_recognition_msgs/PolygonArray.h>
#include <map>
#include <octosurf_msgs/Surfaces.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::ros1 {

/// geometry_msgs/Point, Point32 or Vector3.
template <class Message>
Message xyz_message(const Eigen::Vector3d& xyz) {
  Message message;
  message.x = static_cast<decltype(message.x)>(xyz.x());
  message.y = static_cast<decltype(message.y)>(xyz.y());
  message.z = static_cast<decltype(message.z)>(xyz.z());
  return message;
}
inline geometry_msgs::Point point_message(const Eigen::Vector3d& point) {
  return xyz_message<geometry_msgs::Point>(point);
}
inline geometry_msgs::Vector3 vector_message(const Eigen::Vector3d& vector) {
  return xyz_message<geometry_msgs::Vector3>(vector);
}
geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose);
octosurf_msgs::Ring ring_message(const std::vector<Eigen::Vector3d>& points);
/// In the map's frame.
octosurf_msgs::Polygon polygon_message(const Polygon& polygon, const Surface& surface);

octosurf_msgs::Surfaces surfaces_message(const Snapshot& snapshot, const std_msgs::Header& header);

/// The convex pieces of surfaces, made once for each that is published.
class PieceCache {
 public:
  /// Those of the surfaces that are no more are forgotten.
  void update(const Snapshot& snapshot);
  const std::vector<ConvexPiece>& of(const Surface& surface) const { return pieces_.at(surface.id).pieces; }

 private:
  struct Entry {
    SurfacePtr surface;  // which a snapshot shares with the one before, unless it changed
    std::vector<ConvexPiece> pieces;
  };
  std::map<SurfaceId, Entry> pieces_;
};

/// For each surface its area ("surfaces"), made of its convex pieces, and its rings ("outlines"); ids are
/// the surfaces'. What was there before is deleted first.
visualization_msgs::MarkerArray markers_message(const Snapshot& snapshot, const PieceCache& pieces,
                                                const std_msgs::Header& header);

/// The convex pieces, labelled with their surface's id: polygons of jsk have no holes.
jsk_recognition_msgs::PolygonArray polygons_message(const Snapshot& snapshot, const PieceCache& pieces,
                                                    const std_msgs::Header& header);

}  // namespace octosurf::ros1
