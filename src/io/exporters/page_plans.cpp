// Plans as written by plan_files.hpp: checks them, and extracts the part that a page draws.
#include "io/exporters/page_messages.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;
using Point = std::array<double, 3>;

void require(bool holds, const char* otherwise) {
  if (!holds) throw std::runtime_error(otherwise);
}

/// Throws where a part is missing or of another type.
Json drawn(const PagePlan& plan) {
  const Json all = Json::parse(plan.json);
  require(all.at("format") == "octosurf-plan" && all.at("version") == 1, "is of another format or version");
  Json result{{"name", plan.name}, {"found", all.at("found").get<bool>()}};
  for (const char* key : {"start", "steps"}) {
    Json& steps = result[key] = Json::array();
    for (const Json& step : all.at(key)) {
      const auto foot = step.at("foot").get<std::string>();
      require(std::find(foot_names.begin(), foot_names.end(), foot) != foot_names.end(),
              "has a foot of no such name");
      steps.push_back({{"foot", foot},
                       {"at", step.at("at").get<Point>()},
                       {"outline", step.at("outline").get<std::vector<Point>>()}});
    }
  }
  result["body"] = Json::array();
  for (const Json& body : all.at("body")) result["body"].push_back({{"at", body.at("at").get<Point>()}});
  if (all.contains("refusal"))
    result["refusal"] = {{"sentence", all["refusal"].at("sentence").get<std::string>()}};
  return result;
}

}  // namespace

Json plans_json(const std::vector<PagePlan>& plans) {
  Json list = Json::array();
  for (const PagePlan& plan : plans) {
    try {
      list.push_back(drawn(plan));
    } catch (const std::exception& error) {  // JSON's are no runtime errors
      throw Error(Error::Kind::data, plan.name, std::string("is no plan: ") + error.what(),
                  "give what octosurf plan -o FILE.json has written");
    }
  }
  return list;
}

}  // namespace octosurf::io
