#include "query_fields.hpp"

#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "io/text_file.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

QuestionField foot_field(std::optional<ContactShape>& to) {
  return text_field("foot", "LENGTHxWIDTH of a sole, or the radius of a disc, m [the robot's]", {},
                    [&to](const std::string& text) { to = planning::foot_of(text); });
}

QuestionField robot_field(Robot& to) {
  QuestionField field =
      text_field("robot", "biped or quadruped: whose foot and limits hold", {"biped", "quadruped"},
                 [&to](const std::string& text) { to = robot_in(text); });
  field.or_file = " (or a JSON file)";
  return std::move(field).by_default("biped");
}

QuestionField unknown_field(bool& is_free) {
  return text_field("unknown", "what space over a foot is that nobody saw: blocked or free",
                    {"blocked", "free"}, [&is_free](const std::string& text) { is_free = text == "free"; })
      .by_default("blocked");
}

}  // namespace

std::string QuestionField::option() const {
  std::string text = "--" + name;
  for (const char* unit : {"_m", "_deg", "_s"})
    if (text.ends_with(unit)) text.erase(text.rfind('_'));
  std::ranges::replace(text, '_', '-');
  return text;
}

void QuestionField::put(const std::vector<double>& given, const std::string& called) const {
  for (const double value : given) {
    // Written so that NaN is refused, too.
    if (!(value >= low && value <= high))
      throw Error(Error::Kind::usage, called, "is not within its limits",
                  io::formatted("give %.16g to %.16g", low, high));
    if (whole && value != std::floor(value))
      throw Error(Error::Kind::usage, called, "is no whole number", "give one");
  }
  take(given);
}

QuestionField text_field(const char* name, const char* description, std::vector<std::string> words,
                         std::function<void(const std::string&)> take) {
  QuestionField field{name, description, 0};
  field.words = std::move(words);
  field.take_text = std::move(take);
  return field;
}

QuestionField standing_field(const char* name, const char* description, Standing& to, double farthest) {
  const auto take = [&to](const std::vector<double>& v) { to = {{v[0], v[1], v[2]}, v[3] * rad_per_deg}; };
  return {name, description, 4, -farthest, farthest, take, false, true};
}

QuestionFields contact_fields(planning::ContactQuestion& q) {
  const auto metres = [](const char* name, const char* description, std::optional<double>& to) {
    return number_field(name, description, to, 0, largest_robot_m);
  };
  return {
      robot_field(q.robot),
      foot_field(q.foot),
      number_field("max_slope_deg",
                   "degrees: leave out steeper surfaces; 90 leaves out ceilings [180; of a foot 30]",
                   q.max_slope_rad, 0, 180, rad_per_deg),
      metres("edge_margin_m", "m: from the foot to every edge [the map's resolution]", q.edge_margin_m),
      metres("obstacle_margin_m", "m: from the foot to obstacles up to the clearance [the map's resolution]",
             q.obstacle_margin_m),
      metres("clearance_m", "m: height over the foot that must be clear; 0: not checked [the robot's height]",
             q.clearance_m),
      number_field("as_mapped",
                   "outlines of the readings, which are no ground: without margins, clearance and voids",
                   q.as_mapped, 0, 1)
          .by_default("0"),
      number_field("unseen", "widest unseen gap that a foot may span, as a share of its narrower side",
                   q.unseen_share, 0, 1)
          .by_default("0.25"),
      unknown_field(q.unknown_is_free)};
}

QuestionFields region_fields(planning::ContactQuestion& q) {
  QuestionFields fields = contact_fields(q);
  fields.push_back(number_field("yaw_deg", "heading of the foot, degrees [any heading]", q.yaw_rad, -3600,
                                3600, rad_per_deg));
  fields.push_back(
      number_field("pieces", "also the region as at most N convex pieces", q.pieces, 0, 200).by_default("0"));
  fields.push_back(
      point_field("about", "X Y Z: of the region only what is near this place [all of it]", q.at));
  fields.push_back(
      number_field("reach_m", "m: from a place, along the surface's axes", q.reach_m, 0.001, largest_robot_m)
          .by_default("1"));
  return fields;
}

QuestionFields plan_fields(PlanQuery& q) {
  return {standing_field("from", "X Y Z YAW: start, on the ground between the feet, and the heading, degrees",
                         q.from),
          standing_field("to", "X Y Z YAW: goal", q.to), robot_field(q.robot), foot_field(q.foot),
          unknown_field(q.unknown_is_free)};
}

void add_options(CLI::App& verb, const QuestionFields& fields) {
  for (const QuestionField& field : fields) {
    const std::string name = field.option();
    CLI::Option* option = nullptr;
    if (field.take_text) {
      option =
          verb.add_option_function<std::string>(name, field.take_text, field.description + field.or_file);
      if (!field.words.empty() && field.or_file.empty()) option->check(CLI::IsMember(field.words));
    } else if (field.whole && field.high == 1) {
      verb.add_flag_callback(
          name, [take = field.take] { take({1}); }, field.description);
      continue;
    } else if (field.whole) {
      option = verb.add_option_function<std::size_t>(
          name, [take = field.take](std::size_t n) { take({static_cast<double>(n)}); }, field.description);
    } else {
      option = verb.add_option_function<std::vector<double>>(name, field.take, field.description)
                   ->expected(static_cast<int>(field.numbers));
      if (field.name.ends_with("_deg") || field.high == 1)
        option->check(between(field.low, field.high));
      else if (field.low >= 0)
        option->check(at_least(field.low));
    }
    if (!field.usual.empty()) option->default_str(field.usual);
    option->required(field.required);
  }
}

}  // namespace octosurf
