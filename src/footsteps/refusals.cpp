#include "footsteps/refusals.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

namespace octosurf::footsteps {
namespace {

constexpr double stands_within = 2;   // m: search radius for an alternative stance
constexpr double near_height = 0.30;  // m, up or down: search range for ground under a foot

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string text(const Eigen::Vector3d& p) { return text("%.2f %.2f %.2f", p.x(), p.y(), p.z()); }

std::string text(Ending ending, std::size_t expansions) {
  if (ending == Ending::start_exhausted) return "every stance within reach was tried";
  if (ending == Ending::goal_cut_off) return "every stance that can reach the goal was tried";
  return "no plan within " + std::to_string(expansions) + " expansions";
}

/// By ContactRefusal.
constexpr std::array<const char*, contact_refusal_names.size()> contact_reasons{
    "the ground is too steep there",
    "the surface is too small",
    "the surface is too rough",
    "the surface is not known well enough",
    "a part of the sole would have no ground under it",
    "it is too near to an edge",
    "something stands too near to it",
    "something is over it",
    "the space over it is unknown"};

/// Why a foot has no foothold at `at` (map frame): the limit, and the end of a sentence. Empty: it has one.
std::string why_not(const FootholdField& field, const Eigen::Vector3d& at, const Eigen::Vector3d& up,
                    double yaw_rad, std::optional<ContactRefusal>& contact) {
  std::optional<Foothold> best;
  for (const SurfacePtr& surface : field.snapshot().surfaces) {
    const double lean = surface->plane.normal.dot(up);
    if (lean < 0.1) continue;  // walls, and overhanging surfaces
    const Eigen::Vector3d on = at - surface->plane.signed_distance(at) / lean * up;
    if ((on - at).norm() > near_height) continue;
    const Foothold hold = field.hold(*surface, on, yaw_rad);
    if (hold.supported > 0 && (!best || hold.supported > best->supported)) best = hold;
  }
  if (!best) return "there is no surface under it";
  contact = best->refused;
  return contact ? contact_reasons[static_cast<std::size_t>(*contact)] : "";
}

// The foot without a foothold, and the reason.
std::string which_foot(const FootholdField& field, const std::vector<Gait::Foot>& feet, const Standing& at,
                       std::optional<ContactRefusal>& contact) {
  const Eigen::Vector3d up = field.to_map({Eigen::Vector3d::UnitZ(), 0}).at;
  for (const Gait::Foot& foot : feet) {
    Eigen::Vector3d wanted = at.at;
    wanted.head<2>() += Eigen::Rotation2Dd(at.yaw_rad) * foot.at;
    wanted = field.to_map({wanted, 0}).at;
    const std::string reason = why_not(field, wanted, up, at.yaw_rad, contact);
    if (!reason.empty())
      return "the " + std::string(foot_name(foot.name)) + " foot at " + text(wanted) + ", where " + reason;
  }
  return "the feet find ground, but one of them, the legs or the body would touch something, or a leg pass "
         "unknown space";
}

}  // namespace

NoPlan refusal_of(FootholdField& field, NoPlan::Why why, const std::vector<Gait::Foot>& feet,
                  const Standing& at, const std::function<bool(const Standing&)>& stands) {
  NoPlan result;
  result.why = why;
  result.sentence =
      std::string("it cannot stand at the ") + (why == NoPlan::Why::start ? "start" : "goal") + ": ";
  result.sentence += which_foot(field, feet, at, result.contact);
  // Ground nearby, nearest first: one place in each cell of the field.
  std::vector<std::pair<double, Eigen::Vector3d>> near;
  field.for_each_place(field.nearest_heading(at.yaw_rad), planning::box_about(at.at.head<2>(), stands_within),
                       [&](PlaceId id) {
                         const Eigen::Vector3d& p = field.place(id).at;
                         if ((p - at.at).norm() <= stands_within) near.emplace_back((p - at.at).norm(), p);
                       });
  std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [distance, p] : near) {
    if (!stands({p, at.yaw_rad})) continue;
    result.nearest = field.to_map({p, 0}).at;
    result.nearest_m = distance;
    result.sentence +=
        "; the nearest place to stand is " + text(*result.nearest) + text(", %.2f m away", result.nearest_m);
    return result;
  }
  result.sentence += text("; there is no place to stand within %.0f m", stands_within);
  return result;
}

NoPlan refusal_of(const FootholdField& field, const Frontier& frontier, Ending ending,
                  std::size_t expansions) {
  NoPlan result;
  result.why = ending == Ending::budget ? NoPlan::Why::budget : NoPlan::Why::unreachable;
  result.nearest = field.to_map({frontier.nearest, 0}).at;
  result.nearest_m = frontier.nearest_m;
  result.refused = frontier.refused;
  result.sentence = text(ending, expansions) +
                    text("; it came within %.2f m of the goal, at ", frontier.nearest_m) +
                    text(*result.nearest) + ", where ";
  const auto of = [&](StepRefusal why) { return frontier.refused[static_cast<std::size_t>(why)]; };
  const std::size_t reach = of(StepRefusal::reach), height = of(StepRefusal::height),
                    clearance = of(StepRefusal::clearance), unknown = of(StepRefusal::unknown);
  if (reach + height + clearance + unknown == 0) {
    result.sentence += "no foothold nearer to the goal was in sight (support)";
    return result;
  }
  // A reachable place that is too high or blocked is a better reason than one out of reach.
  StepRefusal most = StepRefusal::reach;
  for (const StepRefusal why : {StepRefusal::height, StepRefusal::clearance, StepRefusal::unknown})
    if (of(why) > (most == StepRefusal::reach ? 0 : of(most))) most = why;
  result.sentence +=
      text(
          "of %zu footholds nearer to the goal %zu were out of reach, %zu too high or too low, "
          "at %zu something was in the way and at %zu something unseen may be (",
          reach + height + clearance + unknown, reach, height, clearance, unknown) +
      std::string(step_refusal_name(most)) + ")";
  return result;
}

}  // namespace octosurf::footsteps
