#include "services.hpp"

#include "messages.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <variant>

#include <octosurf/error.hpp>

namespace octosurf::dds {
namespace {

Eigen::Vector3d read_point(io::MessageReader& in) {
  Eigen::Vector3d point;
  for (double& value : point) value = in.f64();
  return point;
}

Standing read_standing(io::MessageReader& in) {
  Standing standing;
  standing.at = read_point(in);
  standing.yaw_rad = in.f64();
  return standing;
}

/// `success` and `message`, with which every reply begins: what `work` says, or what it throws.
void write_outcome(io::MessageWriter& out, const std::function<std::string()>& work) {
  bool success = true;
  std::string message;
  try {
    message = work();
  } catch (const std::exception& error) {
    success = false;
    message = error.what();
    if (message.empty()) message = "failed";
  }
  out.fields("success", success, "message", message);
}

}  // namespace

Services::Services(const Participant& participant, Mapping& mapping, const NodeOptions& options)
    : mapping_(mapping), options_(options) {
  services_.reserve(5);
  add(participant, "save", "Save", [this](auto& in, auto& out) { save(in, out); });
  add(participant, "load", "Load", [this](auto& in, auto& out) { load(in, out); });
  add(participant, "query", "Query", [this](auto& in, auto& out) { query(in, out); });
  add(participant, "contact_regions", "ContactRegions",
      [this](auto& in, auto& out) { contact_regions(in, out); });
  add(participant, "plan", "Plan", [this](auto& in, auto& out) { plan(in, out); });
  std::vector<const Reader*> readers;
  for (const Service& service : services_) readers.push_back(&service.requests);
  requests_.emplace(participant, readers);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Services::add(const Participant& participant, const std::string& name, const std::string& type,
                   Answer answer) {
  const std::string place = topic_over_dds(options_.name + "/" + name).substr(2);
  const std::string types = "octosurf_msgs::srv::dds_::" + type;
  services_.push_back(
      {place, Reader(participant, "rq" + place + "Request", types + "_Request_", Profile::reliable, 10),
       Writer(participant, "rr" + place + "Reply", types + "_Response_", Profile::reliable),
       std::move(answer)});
}

void Services::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    requests_->wait(std::chrono::milliseconds(100));
    for (const Service& service : services_)
      while (const std::optional<RawMessage> request = service.requests.take()) answer(service, *request);
  }
}

void Services::answer(const Service& service, const RawMessage& request) try {
  const auto in = io::message_reader(request.bytes(), MessageEncoding::cdr);
  const std::uint64_t client = in->u64(), number = in->u64();
  std::string reply = io::cdr_of([&](io::MessageWriter& out) {
    out.write(client);
    out.write(number);
    service.answer(*in, out);
  });
  // A new client's request writer may be discovered before its reply reader.
  for (int tenths = 0; tenths < 10 && service.replies.readers() == 0; ++tenths)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  service.replies.write(std::move(reply));
} catch (const std::exception& error) {
  std::fprintf(stderr, "refused: a request of %s: %s\n", service.name.c_str(), error.what());
}

/// Restricted to the folder of the node's own map: clients on the network must not write or read elsewhere.
/// Empty for the node's own.
std::string Services::stem_of(const std::string& name) const {
  if (name.empty()) return {};
  const auto allowed = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  if (name.front() == '.' || name.size() > 100 || !std::all_of(name.begin(), name.end(), allowed))
    throw Error(Error::Kind::usage, "file", "is no plain name of a map",
                "give letters, digits, '_', '-' and '.', or nothing for the node's own map");
  return (std::filesystem::path(options_.output).parent_path() / name).string();
}

void Services::save(io::MessageReader& in, io::MessageWriter& out) {
  const std::string file = in.text();
  write_outcome(out, [&] { return mapping_.save(stem_of(file)); });
}

void Services::load(io::MessageReader& in, io::MessageWriter& out) {
  const std::string file = in.text();
  write_outcome(out, [&] { return mapping_.load(stem_of(file)); });
}

void Services::query(io::MessageReader& in, io::MessageWriter& out) {
  planning::PlaceQuestion question;
  question.kind = in.u8();
  question.point = read_point(in);
  question.corner = read_point(in);
  question.direction = read_point(in);
  const double distance = in.f64(), max_slope = in.f64();
  question.surface = in.u32();
  using Kind = planning::PlaceQuestion;
  if (distance != 0 || question.kind == Kind::sphere) question.distance_m = distance;
  if (max_slope != 0) question.max_slope_rad = max_slope;
  planning::PlaceAnswer found;
  const MapMoment moment = mapping_.moment();
  write_outcome(out, [&] {
    found = planning::answer(*mapping_.asked(moment), question);
    return std::string();
  });
  out.fields("revision", moment.snapshot->revision, "found", found.found, "surfaces", found.surfaces, "point",
             found.point, "distance", found.distance_m, "normal", found.normal, "front", found.front, "state",
             static_cast<std::uint8_t>(found.voxel.state), "log_odds",
             static_cast<double>(found.voxel.log_odds), "ground",
             question.kind == Kind::ground && found.found ? ground_name(found.ground) : "");
}

void Services::contact_regions(io::MessageReader& in, io::MessageWriter& out) {
  planning::ContactQuestion question;
  const auto given = [&in]() -> std::optional<double> {
    const double value = in.f64();
    return value == 0 ? std::optional<double>() : value;
  };
  question.surface = in.u32();
  const double length = in.f64(), width = in.f64(), radius = in.f64();
  const bool any_heading = in.u8() != 0, is_sole = length != 0 || width != 0;
  const double yaw = in.f64();
  if (!any_heading) question.yaw_rad = yaw;
  question.max_slope_rad = given();
  question.edge_margin_m = given();
  question.obstacle_margin_m = given();
  question.clearance_m = given();
  question.as_mapped = in.u8() != 0;
  const Eigen::Vector3d about = read_point(in);
  if (const auto reach = given()) question.at = about, question.reach_m = *reach;
  question.pieces = in.u32();
  std::vector<planning::FoundRegion> regions;
  const MapMoment moment = mapping_.moment();
  write_outcome(out, [&] {
    if (is_sole == (radius != 0))
      throw Error(Error::Kind::usage, "length, width, radius", "say no foot, or two",
                  "give length and width, or a radius");
    question.foot = is_sole ? ContactShape::rectangle(length, width) : ContactShape::disc(radius);
    const auto asked = mapping_.asked(moment);
    if (question.surface != 0) {
      regions.push_back(planning::find_region(*asked, question));
    } else {
      for (const SurfacePtr& surface : moment.snapshot->surfaces) {
        question.surface = surface->id;
        regions.push_back(planning::find_region(*asked, question));
      }
    }
    return std::string();
  });
  out.fields("revision", moment.snapshot->revision, "regions", io::each(regions, write_region));
}

void Services::plan(io::MessageReader& in, io::MessageWriter& out) {
  // The client waits for the answer, and no search may occupy the node indefinitely.
  constexpr double usual_plan_s = 30, longest_plan_s = 600;
  const std::string name = in.text();
  const Standing start = read_standing(in), goal = read_standing(in);
  PlanBudget budget;
  if (const std::uint32_t expansions = in.u32()) budget.expansions = expansions;
  const double time_limit = in.f64();
  budget.time_s = time_limit == 0 ? usual_plan_s : std::min(time_limit, longest_plan_s);
  FootstepPlan plan;
  bool found = false;
  const MapMoment moment = mapping_.moment();
  write_outcome(out, [&] {
    if (!name.empty() && name != "biped" && name != "quadruped")
      throw Error(Error::Kind::usage, "robot", "is neither biped nor quadruped: " + name.substr(0, 40));
    Robot robot = name == "quadruped" ? Robot(Quadruped{}) : Robot(Biped{});
    std::visit([&](auto& kind) { kind.contact.up = moment.up; }, robot);
    const auto asked = mapping_.asked(moment);
    const GroundView ground = asked->ground(GroundRules::of(robot, moment.snapshot->resolution));
    plan = FootstepPlanner(ground.solid(), asked->octree, robot).plan(start, goal, budget);
    found = plan.found();
    return plan.refusal ? plan.refusal->sentence : std::string();
  });
  out.fields("revision", moment.snapshot->revision, "found", found, "start",
             io::each(plan.start, write_footstep), "steps", io::each(plan.steps, write_footstep), "cost",
             plan.cost, "lower_bound", plan.lower_bound, "expansions",
             static_cast<std::uint32_t>(plan.expansions));
}

}  // namespace octosurf::dds
