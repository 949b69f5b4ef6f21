#include "page_feet.hpp"

#include <future>

#include <octosurf/contact.hpp>
#include <octosurf/up.hpp>

namespace octosurf {

static PageFoot page_foot(const planning::AskedMap& map, const std::string& foot, bool edges_alone) {
  planning::ContactQuestion question;
  question.foot = planning::foot_of(foot);
  if (question.foot->outline.empty()) question.robot = Quadruped{};
  if (edges_alone) question.clearance_m = question.obstacle_margin_m = 0;
  const GroundView ground = map.ground(planning::rules_of(question, map.up, map.octree.resolution()));
  PageFoot result{foot + (edges_alone ? " m, by slope and edges alone" : " m, with all limits of plan"), {}};
  for (const SurfacePtr& surface : map.snapshot->surfaces) {
    // For a wall other limits are not evaluated, to save time.
    if (slope_rad(*surface, map.up) > ground.rules().limits.max_slope_rad)
      result.regions.push_back({surface->id, surface->revision, {}, {}, 0, {ContactRefusal::slope}});
    else
      result.regions.push_back(ground.region(surface->id, std::nullopt));
  }
  return result;
}

std::vector<PageFoot> page_feet(const planning::AskedMap& map, const std::vector<std::string>& feet) {
  const bool usual = feet.empty();
  std::vector<std::future<PageFoot>> asking;  // in threads, if they are available
  for (const std::string& foot : usual ? std::vector<std::string>{"0.22x0.11", "0.03"} : feet)
    asking.push_back(std::async([&map, foot, usual] { return page_foot(map, foot, usual); }));
  std::vector<PageFoot> result;
  for (std::future<PageFoot>& foot : asking) result.push_back(foot.get());
  return result;
}

}  // namespace octosurf
