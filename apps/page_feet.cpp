#include "page_feet.hpp"

#include "geometry/degrees.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <future>
#include <numbers>
#include <optional>
#include <utility>

#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

std::optional<double> yaw_deg_of(const std::string& text, std::size_t at) {
  if (at == std::string::npos) return std::nullopt;
  double yaw = 0;
  const char *begin = text.data() + at + 1, *end = text.data() + text.size();
  const auto [rest, failure] = std::from_chars(begin, end, yaw);
  if (failure != std::errc() || rest != end || !(yaw >= -3600 && yaw <= 3600))
    throw Error(Error::Kind::usage, "--foot " + text, "has no heading after its @",
                "write degrees, such as 0.22x0.11@90");
  return yaw;
}

std::string name_of(const std::string& foot, std::optional<double> yaw_deg, const ContactLimits& limits) {
  char text[200];
  const std::string heading = yaw_deg ? std::to_string(std::lround(*yaw_deg)) + "°" : "any heading";
  std::snprintf(text, sizeof text, "%s m, %s; slope to %.0f°, %.0f mm to edges", foot.c_str(),
                heading.c_str(), limits.max_slope_rad / rad_per_deg, 1000 * limits.edge_margin_m);
  std::string name = text;
  if (limits.clearance_m > 0) {
    std::snprintf(text, sizeof text, ", %.2f m of room over it, no gaps under it", limits.clearance_m);
    return name + text;
  }
  return name + "; what stands there is not asked";
}

PageFoot make_foot(const planning::AskedMap& map, const std::string& text, bool edges_only) {
  const std::size_t at = text.find('@');
  const std::string foot = text.substr(0, at);
  const ContactShape shape = planning::foot_of(foot);
  const std::optional<double> yaw_deg = yaw_deg_of(text, at);
  const std::optional<double> yaw_rad =
      yaw_deg ? std::optional(*yaw_deg * rad_per_deg) : std::optional<double>();
  planning::ContactQuestion question;
  if (shape.outline.empty()) question.robot = Quadruped{};
  question.foot = shape;
  if (edges_only) question.clearance_m = question.obstacle_margin_m = 0;
  const GroundView ground = map.ground(planning::rules_of(question, map.up, map.octree.resolution()));
  const ContactLimits& limits = ground.rules().limits;
  PageFoot result{name_of(foot, yaw_deg, limits), {}};
  for (const SurfacePtr& surface : map.snapshot->surfaces) {
    // For a wall other limits are not evaluated, to save time.
    if (slope_rad(*surface, map.up) > limits.max_slope_rad)
      result.regions.push_back({surface->id, surface->revision, yaw_rad, {}, 0, {ContactRefusal::slope}});
    else
      result.regions.push_back(ground.region(surface->id, yaw_rad));
  }
  return result;
}

}  // namespace

PageFoot page_foot(const planning::AskedMap& map, const std::string& text) {
  return make_foot(map, text, false);
}

std::vector<PageFoot> usual_page_feet(const planning::AskedMap& map) {
  // In another thread, if available.
  std::future<PageFoot> ball = std::async([&map] { return make_foot(map, "0.03", true); });
  PageFoot sole = make_foot(map, "0.22x0.11", true);
  return {std::move(sole), ball.get()};
}

}  // namespace octosurf
