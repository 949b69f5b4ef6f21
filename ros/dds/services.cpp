#include "services.hpp"

#include "io/exporters/grid_map_message.hpp"
#include "messages.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <variant>

#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/planning.hpp>

namespace octosurf::dds {
namespace {

constexpr double longest_plan_s = 30;

Eigen::Vector3d read_point(MessageReader& in) {
  Eigen::Vector3d point;
  for (double& value : point) value = in.f64();
  return point;
}

/// `success` and `message`, with which every reply begins: whether `work` threw, and what.
void write_outcome(MessageWriter& out, const std::function<void()>& work) {
  std::string problem;
  try {
    work();
  } catch (const std::exception& error) {
    problem = error.what();
    if (problem.empty()) problem = "failed";
  }
  out.field("success", problem.empty());
  out.field("message", problem);
}

const Surface& surface_of(const Snapshot& snapshot, SurfaceId id) {
  const Surface* surface = snapshot.find(id);
  if (surface == nullptr) throw Error(Error::Kind::data, "surface " + std::to_string(id), "there is none");
  return *surface;
}

Robot robot_called(const std::string& name, const Eigen::Vector3d& up) {
  if (name != "biped" && name != "quadruped")
    throw Error(Error::Kind::usage, "robot", "'" + name + "' is neither biped nor quadruped");
  Robot robot = name == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  std::visit([&](auto& kind) { kind.contact.up = up; }, robot);
  return robot;
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
  const auto in = message_reader(request.bytes(), MessageEncoding::cdr);
  const std::uint64_t client = in->u64(), number = in->u64();
  std::string reply = cdr_of([&](MessageWriter& out) {
    out.write(client);
    out.write(number);
    service.answer(*in, out);
  });
  // A client that came a moment ago may be known as one who asks, and not yet as one who listens.
  for (int tenths = 0; tenths < 10 && service.replies.readers() == 0; ++tenths)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  service.replies.write(std::move(reply));
} catch (const std::exception& error) {
  std::fprintf(stderr, "refused: a request of %s: %s\n", service.name.c_str(), error.what());
}

/// Beside the node's own map: whoever can reach the network must not write or read elsewhere.
std::string Services::stem_of(const std::string& name) const {
  if (name.empty()) return options_.output;
  const auto allowed = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  if (name.front() == '.' || name.size() > 100 || !std::all_of(name.begin(), name.end(), allowed))
    throw Error(Error::Kind::usage, "name", "is no plain name of a map",
                "give letters, digits, '_', '-' and '.', or nothing for the node's own map");
  return (std::filesystem::path(options_.output).parent_path() / name).string();
}

void Services::save(MessageReader& in, MessageWriter& out) {
  const std::string name = in.text();
  write_outcome(out, [&] { mapping_.save(stem_of(name)); });
}

void Services::load(MessageReader& in, MessageWriter& out) {
  const std::string name = in.text();
  write_outcome(out, [&] { mapping_.load(stem_of(name)); });
}

void Services::query(MessageReader& in, MessageWriter& out) const {
  constexpr std::uint8_t is_nearest = 0, is_below = 1;
  const std::uint8_t question = in.u8();
  const Eigen::Vector3d point = read_point(in);
  const SlopeLimit limit{mapping_.up(), in.f64()};
  Nearest found;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  write_outcome(out, [&] {
    if (question != is_nearest && question != is_below)
      throw Error(Error::Kind::usage, "question", "is neither NEAREST nor BELOW");
    const auto snapshot = mapping_.snapshot();
    const auto answer =
        question == is_below ? below(*snapshot, point, limit) : nearest(*snapshot, point, limit);
    if (!answer) throw Error(Error::Kind::data, "", "there is no such surface");
    found = *answer;
    normal = surface_of(*snapshot, found.id).plane.normal;
  });
  out.field("surface", found.id);
  out.field("point");
  write_point(out, found.point);
  out.field("distance", found.distance);
  out.field("normal");
  write_point(out, normal);
}

void Services::contact_regions(MessageReader& in, MessageWriter& out) const {
  const SurfaceId id = in.u32();
  const double length = in.f64(), width = in.f64();
  const bool any_yaw = in.u8() != 0;
  const double yaw = in.f64();
  ContactLimits limits;
  limits.up = mapping_.up();
  limits.max_slope_rad = in.f64();
  limits.edge_margin_m = in.f64();
  limits.clearance_m = in.f64();
  const auto snapshot = mapping_.snapshot();
  std::vector<std::pair<const Surface*, ContactRegion>> regions;
  write_outcome(out, [&] {
    const ContactShape foot = width > 0 ? ContactShape::rectangle(length, width) : ContactShape::disc(length);
    const auto add = [&](const Surface& surface) {
      regions.emplace_back(&surface,
                           contact_region(surface, foot, any_yaw ? std::nullopt : std::optional(yaw), limits,
                                          &snapshot->octree));
    };
    if (id != 0) return add(surface_of(*snapshot, id));
    for (const SurfacePtr& surface : snapshot->surfaces) add(*surface);
  });
  out.field("regions");
  out.begin_list(regions.size());
  for (const auto& [surface, region] : regions) write_region(out, *surface, region);
  out.end_list();
}

void Services::plan(MessageReader& in, MessageWriter& out) const {
  const std::string name = in.text();
  Standing start, goal;
  for (Standing* end : {&start, &goal}) {
    end->at = read_point(in);
    end->yaw_rad = in.f64();
  }
  const double time_s = in.f64();
  FootstepPlan plan;
  write_outcome(out, [&] {
    const auto snapshot = mapping_.snapshot();
    PlanBudget budget;
    budget.time_s = time_s > 0 ? std::min(time_s, longest_plan_s) : longest_plan_s;
    plan = FootstepPlanner(snapshot, snapshot->octree, robot_called(name, mapping_.up()))
               .plan(start, goal, budget);
    if (plan.refusal) throw Error(Error::Kind::data, "", plan.refusal->sentence);
  });
  out.field("steps");
  out.begin_list(plan.start.size() + plan.steps.size());
  for (const Footstep& step : plan.start) write_footstep(out, step);
  for (const Footstep& step : plan.steps) write_footstep(out, step);
  out.end_list();
}

}  // namespace octosurf::dds
