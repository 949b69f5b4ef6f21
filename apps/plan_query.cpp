#include "plan_query.hpp"

#include "geometry/degrees.hpp"
#include "planning/questions.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <variant>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

/// A limit of a robot in a file, and where each has it; null: the robot has none.
struct RobotLimit {
  template <class Field>
  RobotLimit(const char* called, double given_in, Field)
      : name(called), unit(given_in), of([](Robot& robot) {
          return std::visit(
              [](auto& kind) -> double* {
                if constexpr (std::is_invocable_v<Field, decltype(kind)>) return Field()(kind);
                return nullptr;
              },
              robot);
        }) {}

  const char* name;
  double unit;  ///< in which it is given, in SI
  double* (*of)(Robot&);
};

const std::vector<RobotLimit>& robot_limits() {
  using B = Biped;
  using Q = Quadruped;
  static const std::vector<RobotLimit> limits{
      {"max_forward_m", 1, [](B& r) { return &r.max_forward_m; }},
      {"max_backward_m", 1, [](B& r) { return &r.max_backward_m; }},
      {"min_width_m", 1, [](B& r) { return &r.min_width_m; }},
      {"max_width_m", 1, [](B& r) { return &r.max_width_m; }},
      {"max_step_m", 1, [](Q& r) { return &r.max_step_m; }},
      {"reach_m", 1, [](Q& r) { return &r.reach_m; }},
      {"max_up_m", 1, [](auto& r) { return &r.max_up_m; }},
      {"max_down_m", 1, [](auto& r) { return &r.max_down_m; }},
      {"max_turn_deg", rad_per_deg, [](auto& r) { return &r.max_turn_rad; }},
      {"max_slope_deg", rad_per_deg, [](auto& r) { return &r.contact.max_slope_rad; }},
      {"edge_margin_m", 1, [](auto& r) { return &r.contact.edge_margin_m; }},
      {"lift_m", 1, [](auto& r) { return &r.lift_m; }},
      {"high_lift_m", 1, [](auto& r) { return &r.high_lift_m; }},
      {"stance_width_m", 1, [](auto& r) { return &r.stance_width_m; }},
      {"stance_length_m", 1, [](Q& r) { return &r.stance_length_m; }},
      {"body_length_m", 1, [](auto& r) { return &r.body.length_m; }},
      {"body_width_m", 1, [](auto& r) { return &r.body.width_m; }},
      {"body_from_m", 1, [](auto& r) { return &r.body.from_m; }},
      {"body_to_m", 1, [](auto& r) { return &r.body.to_m; }}};
  return limits;
}

}  // namespace

std::string name_of(const Robot& robot) {
  return std::holds_alternative<Biped>(robot) ? "biped" : "quadruped";
}

Robot robot_in(const std::string& name_or_file) {
  if (name_or_file == "biped") return Biped{};
  if (name_or_file == "quadruped") return Quadruped{};
  const std::string& file = name_or_file;
  std::ifstream in(file);
  if (!in)
    throw Error(Error::Kind::usage, "--robot " + file, "is no robot, and no file that can be read",
                "give biped, quadruped, or a JSON file");
  const auto json = nlohmann::json::parse(in, nullptr, false);
  const auto refuse = [&](const std::string& what, const std::string& hint = "") {
    throw Error(Error::Kind::data, file, what, hint);
  };
  if (!json.is_object() || !json.contains("robot") ||
      (json["robot"] != "biped" && json["robot"] != "quadruped"))
    refuse("is no robot", R"(write {"robot": "biped"} or "quadruped", and what differs from it)");
  Robot robot = robot_in(json["robot"]);
  for (const auto& [key, value] : json.items()) {
    if (key == "robot") continue;
    if (key == "foot") {
      if (!value.is_string()) refuse("has a foot that is no text", R"(write "0.22x0.11" or "0.03")");
      std::visit([&](auto& kind) { kind.foot = planning::foot_of(value); }, robot);
      continue;
    }
    const auto& all = robot_limits();
    const auto limit = std::ranges::find_if(all, [&](const RobotLimit& l) { return l.name == key; });
    double* const field = limit != all.end() ? limit->of(robot) : nullptr;
    if (field == nullptr) {
      std::string known = "foot";
      for (const RobotLimit& one : all)
        if (one.of(robot) != nullptr) known += std::string(", ") + one.name;
      refuse("has " + key + ", which is none of a " + name_of(robot) + "'s limits", "these are: " + known);
    }
    if (!value.is_number()) refuse("has no number for " + key);
    *field = value.get<double>() * limit->unit;
  }
  std::visit([](const auto& kind) { kind.validate(); }, robot);
  return robot;
}

Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up) {
  Robot robot = query.robot;
  std::visit(
      [&](auto& kind) {
        kind.contact.up = up;
        kind.foot = query.foot.value_or(kind.foot);
        if (query.unknown_is_free) kind.contact.unknown_to_m = 0;
      },
      robot);
  return robot;
}

void add_robot_options(CLI::App& verb, Robot& robot, std::optional<ContactShape>& foot,
                       bool& unknown_is_free) {
  verb.add_option_function<std::string>(
          "--robot", [&robot](const std::string& given) { robot = robot_in(given); },
          "biped or quadruped: whose foot and limits hold (or a JSON file)")
      ->default_str("biped");
  verb.add_option_function<std::string>(
      "--foot", [&foot](const std::string& given) { foot = planning::foot_of(given); },
      "LENGTHxWIDTH of a sole, or the radius of a disc, m [the robot's]");
  verb.add_option_function<std::string>(
          "--unknown", [&unknown_is_free](const std::string& given) { unknown_is_free = given == "free"; },
          "what space over a foot is that nobody saw: blocked or free")
      ->check(CLI::IsMember({"blocked", "free"}))
      ->default_str("blocked");
}

}  // namespace octosurf
