// Plans as written by plan_files.hpp: checks them, and extracts the part that a page draws.
#include "io/exporters/page_parts.hpp"

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

constexpr std::size_t most_steps = 100'000, most_corners = 1000;

class PlanReader {
 public:
  explicit PlanReader(const std::string& name) : name_(name) {}

  /// The part that the page draws.
  Json drawn(const std::string& text) const {
    const Json plan = Json::parse(text, nullptr, false);
    require(plan.is_object() && plan.value("format", Json()) == "octosurf-plan", "is no plan");
    require(plan.value("version", Json()) == 1, "is a plan of another version");
    require(plan.contains("found") && plan["found"].is_boolean(), "does not say whether it was found");
    const bool found = plan["found"].get<bool>();
    Json result{{"name", name_}, {"found", found}};
    result["cost"] = found ? number(plan, "cost") : Json();
    result["start"] = steps(plan, "start");
    result["steps"] = steps(plan, "steps");
    result["body"] = bodies(plan);
    result["sentence"] = sentence(plan);
    return result;
  }

 private:
  void require(bool well, const std::string& what) const {
    if (!well)
      throw Error(Error::Kind::data, name_, what, "give what octosurf plan -o FILE.json has written");
  }

  Json number(const Json& object, const char* key) const {
    const auto found = object.find(key);
    require(found != object.end() && found->is_number() && std::isfinite(found->get<double>()),
            std::string("has no number for ") + key);
    return *found;
  }

  const Json& list(const Json& object, const char* key, std::size_t most) const {
    const auto found = object.find(key);
    require(found != object.end() && found->is_array() && found->size() <= most,
            std::string("has no list of ") + key);
    return *found;
  }

  Json point(const Json& value) const {
    require(value.is_array() && value.size() == 3, "has a place that is not three numbers");
    for (const Json& x : value)
      require(x.is_number() && std::isfinite(x.get<double>()), "has a place that is not three numbers");
    return value;
  }

  Json steps(const Json& plan, const char* key) const {
    Json result = Json::array();
    for (const Json& step : list(plan, key, most_steps)) {
      require(step.is_object() && step.contains("at"), std::string("has no place in ") + key);
      const Json foot = step.value("foot", Json());
      bool known = false;
      for (const std::string_view name : foot_names) known = known || foot == std::string(name);
      require(known, "has a foot of no such name");
      Json outline = Json::array();
      for (const Json& corner : list(step, "outline", most_corners)) outline.push_back(point(corner));
      result.push_back({{"foot", foot},
                        {"surface", number(step, "surface")},
                        {"at", point(step["at"])},
                        {"yaw_deg", number(step, "yaw_deg")},
                        {"margin_m", number(step, "margin_m")},
                        {"outline", std::move(outline)}});
    }
    return result;
  }

  Json bodies(const Json& plan) const {
    Json result = Json::array();
    for (const Json& body : list(plan, "body", most_steps + 1)) {
      require(body.is_object() && body.contains("at"), "has no place in body");
      result.push_back({{"at", point(body["at"])}});
    }
    return result;
  }

  Json sentence(const Json& plan) const {
    const auto refusal = plan.find("refusal");
    if (refusal == plan.end() || !refusal->is_object()) return nullptr;
    const Json text = refusal->value("sentence", Json());
    return text.is_string() ? text : Json();
  }

  const std::string& name_;
};

}  // namespace

void add_plans(PageBlock& block, const PageMap& map) {
  Json plans = Json::array();
  for (const PagePlan& plan : map.plans) plans.push_back(PlanReader(plan.name).drawn(plan.json));
  block.json["plans"] = std::move(plans);
}

}  // namespace octosurf::io
