#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

struct Rule {
  const char* name;
  double value;
  double least, most;
};

void require(const std::vector<Rule>& rules) {
  for (const Rule& rule : rules) {
    if (rule.value >= rule.least && rule.value <= rule.most) continue;  // false for NaN
    throw Error(Error::Kind::usage, rule.name,
                std::to_string(rule.value) + " is not in " + std::to_string(rule.least) + " … " +
                    std::to_string(rule.most));
  }
}

constexpr double longest = 2;  // m: no longer step is allowed
constexpr double quarter = std::numbers::pi / 2;

template <class Kind>
void require_common(const Kind& robot) {
  const BodyBox& body = robot.body;
  const StepCosts& costs = robot.costs;
  require({{"max_slope_rad", robot.contact.max_slope_rad, 0, quarter * 0.9},
           {"max_turn_rad", robot.max_turn_rad, 0, quarter},
           {"body.length_m", body.length_m, 0, 10},
           {"body.width_m", body.width_m, 0, 10},
           {"body.from_m", body.from_m, 0, 10},
           {"body.to_m", body.to_m, body.from_m, 10},
           {"costs.length", costs.length, 0, 1e6},
           {"costs.height", costs.height, 0, 1e6},
           {"costs.turn", costs.turn, 0, 1e6},
           {"costs.margin", costs.margin, 0, 1e6},
           {"costs.slope", costs.slope, 0, 1e6},
           {"costs.uncertainty", costs.uncertainty, 0, 1e6},
           {"costs.good_margin_m", costs.good_margin_m, 1e-3, longest},
           {"costs.uncertain_m", costs.uncertain_m, 1e-6, longest},
           {"lift_m", robot.lift_m, 0, body.from_m},
           {"high_lift_m", robot.high_lift_m, robot.lift_m, longest},
           {"max_up_m", robot.max_up_m, 1e-3, longest},
           {"max_down_m", robot.max_down_m, 1e-3, longest}});
}

}  // namespace

void Biped::validate() const {
  require_common(*this);
  require({{"max_forward_m", max_forward_m, 0.05, longest},
           {"max_backward_m", max_backward_m, 0, longest},
           {"min_width_m", min_width_m, 0, longest},
           {"stance_width_m", stance_width_m, min_width_m, max_width_m},
           {"max_width_m", max_width_m, min_width_m, longest}});
}

void Quadruped::validate() const {
  require_common(*this);
  require({{"stance_length_m", stance_length_m, 0.05, longest},
           {"stance_width_m", stance_width_m, 0.05, longest},
           {"max_step_m", max_step_m, 0.05, longest},
           {"max_sideward_m", max_sideward_m, 0, longest},
           {"reach_m", reach_m, 0.01, longest},
           {"snap_m", snap_m, 0.01, reach_m},
           {"max_sway_m", max_sway_m, 0, longest},
           {"support_margin_m", support_margin_m, 0, stance_width_m / 2}});
  if (!foot.outline.empty())
    throw Error(Error::Kind::usage, "foot", "a quadruped's is a disc", "use ContactShape::disc()");
}

}  // namespace octosurf
