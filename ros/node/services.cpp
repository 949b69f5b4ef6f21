#include "services.hpp"

#include "messages.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <variant>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>
#include <octosurf/queries.hpp>
#include <octosurf/ros_messages.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf::node {
namespace {

Standing read_standing(io::MessageReader& in) {
  Standing standing;
  standing.at = io::read_vector(in);
  standing.yaw_rad = in.f64();
  return standing;
}

/// `success` and `message`, with which every reply begins: what `work` makes of it, or what it throws.
void write_outcome(io::MessageWriter& out, const std::function<void(std::string& message)>& work) {
  bool success = true;
  std::string message;
  try {
    work(message);
  } catch (const std::exception& error) {
    success = false;
    message = error.what();
    if (message.empty()) message = "failed";
  }
  out.message("success", success, "message", message);
}

}  // namespace

Services::Services(Middleware& middleware, Mapping& mapping, Publications& publications,
                   const NodeOptions& options)
    : mapping_(mapping), publications_(publications), options_(options) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  serve(middleware, "save", "Save", &Services::save);
  serve(middleware, "load", "Load", &Services::load);
  serve(middleware, "query", "Query", &Services::query);
  serve(middleware, "contact_regions", "ContactRegions", &Services::contact_regions);
  serve(middleware, "plan", "Plan", &Services::plan);
  serve(middleware, "changes", "Changes", &Services::changes);
  serve(middleware, "publish", "Publish", &Services::publish);
  serve(middleware, "clear", "Clear", &Services::clear);
}

Services::~Services() { services_.clear(); }

void Services::serve(Middleware& middleware, const std::string& name, const std::string& type,
                     Answer method) {
  const std::string place = options_.name + "/" + name;
  services_.push_back(middleware.serve(place, type, [this, place, method](Request request) {
    const std::lock_guard lock(mutex_);
    requests_.emplace_back(
        [this, place, method, request = std::move(request)] { answer(place, method, request); });
    news_.notify_all();
  }));
}

void Services::run(const std::stop_token& stop) {
  for (;;) {
    std::unique_lock lock(mutex_);
    if (!news_.wait(lock, stop, [&] { return !requests_.empty(); }) || stop.stop_requested()) return;
    const auto work = std::move(requests_.front());
    requests_.pop_front();
    lock.unlock();
    work();
  }
}

void Services::answer(const std::string& name, Answer method, const Request& request) try {
  const auto in = io::message_reader(request.message.bytes, MessageEncoding::cdr);
  request.reply(io::cdr_of([&](io::MessageWriter& out) { (this->*method)(*in, out); }));
} catch (const std::exception& error) {
  std::fprintf(stderr, "refused: a request of %s: %s\n", name.c_str(), error.what());
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
  write_outcome(out, [&](std::string& message) { message = mapping_.save(stem_of(file)); });
}

void Services::load(io::MessageReader& in, io::MessageWriter& out) {
  const std::string file = in.text();
  write_outcome(out, [&](std::string& message) { message = mapping_.load(stem_of(file)); });
}

void Services::query(io::MessageReader& in, io::MessageWriter& out) {
  planning::PlaceQuestion question;
  question.kind = in.u8();
  question.point = io::read_vector(in);
  question.corner = io::read_vector(in);
  question.direction = io::read_vector(in);
  const double distance = in.f64(), max_slope = in.f64();
  question.surface = in.u32();
  using Kind = planning::PlaceQuestion;
  if (distance != 0 || question.kind == Kind::sphere) question.distance_m = distance;
  if (max_slope != 0) question.max_slope_rad = max_slope;
  planning::PlaceAnswer found;
  const MapMoment moment = mapping_.moment();
  write_outcome(out, [&](std::string&) { found = planning::answer(*mapping_.asked(moment), question); });
  out.message("revision", moment.snapshot->revision, "found", found.found, "surfaces", found.surfaces,
              "point", found.point, "distance", found.distance_m, "normal", found.normal, "front",
              found.front, "state", static_cast<std::uint8_t>(found.voxel.state), "log_odds",
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
  const Eigen::Vector3d about = io::read_vector(in);
  if (const auto reach = given()) question.at = about, question.reach_m = *reach;
  question.pieces = in.u32();
  std::vector<planning::FoundRegion> regions;
  const MapMoment moment = mapping_.moment();
  write_outcome(out, [&](std::string&) {
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
  });
  out.message("revision", moment.snapshot->revision, "regions", io::each(regions, write_region));
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
  write_outcome(out, [&](std::string& message) {
    if (!name.empty() && name != "biped" && name != "quadruped")
      throw Error(Error::Kind::usage, "robot", "is neither biped nor quadruped: " + name.substr(0, 40));
    Robot robot = name == "quadruped" ? Robot(Quadruped{}) : Robot(Biped{});
    std::visit([&](auto& kind) { kind.contact.up = moment.up; }, robot);
    const auto asked = mapping_.asked(moment);
    const GroundView ground = asked->ground(GroundRules::of(robot, moment.snapshot->resolution));
    plan = FootstepPlanner(ground.solid(), asked->octree, robot).plan(start, goal, budget);
    found = plan.found();
    if (plan.refusal) message = plan.refusal->sentence;
  });
  out.message("revision", moment.snapshot->revision, "found", found, "start",
              io::each(plan.start, write_footstep), "steps", io::each(plan.steps, write_footstep), "cost",
              plan.cost, "lower_bound", plan.lower_bound, "expansions",
              static_cast<std::uint32_t>(plan.expansions));
}

void Services::changes(io::MessageReader& in, io::MessageWriter& out) {
  const std::uint64_t since = in.u64();
  const Eigen::Vector3d one = io::read_vector(in), other = io::read_vector(in);
  const MapMoment moment = mapping_.moment();
  MapChanges changes;
  Snapshot changed = *moment.snapshot;
  write_outcome(out, [&](std::string&) {
    changes = changes_since(*moment.snapshot, since);
    std::vector<SurfaceId> within;
    if (one != other)
      within = mapping_.asked(moment)->index.in(ConvexSpace::box({one.cwiseMin(other), one.cwiseMax(other)}));
    std::erase_if(changed.surfaces, [&](const SurfacePtr& surface) {
      return surface->revision <= since || (one != other && !std::ranges::binary_search(within, surface->id));
    });
    std::erase_if(changed.cylinders,
                  [&](const CylinderPtr& cylinder) { return cylinder->revision <= since; });
  });
  const auto write_successor = [](io::MessageWriter& to, const auto& successor) {
    to.message("before", successor.before, "now", successor.now);
  };
  out.message("changed",
              [&](io::MessageWriter& to) { write_surfaces(to, changed, options_.frame, moment.stamp_ns); });
  out.message("gone", changes.gone, "merged", io::each(changes.merged, write_successor), "cylinders_gone",
              changes.cylinders_gone, "cylinders_merged",
              io::each(changes.cylinders_merged, write_successor));
}

void Services::publish(io::MessageReader& in, io::MessageWriter& out) {
  const double radius = in.f64();
  write_outcome(out, [&](std::string&) {
    if (!(radius >= 0)) throw Error(Error::Kind::usage, "radius", "is negative", "give 0 for everything");
    publications_.publish_all(radius);
  });
}

void Services::clear(io::MessageReader& in, io::MessageWriter& out) {
  SpacePart part;
  const Eigen::Vector3d middle = io::read_vector(in);
  Eigen::Quaterniond turn = io::read_quaternion(in);
  part.half_size = io::read_vector(in) / 2;
  part.round = in.u8() != 0;
  const bool as_free = in.u8() != 0;
  write_outcome(out, [&](std::string& message) {
    if (turn.coeffs().isZero()) turn.setIdentity();  // a message's orientation that nobody has set
    part.T_map_part = pose_from_transform(middle, turn, "part");
    message = mapping_.clear(part, as_free);
  });
  out.message("revision", mapping_.moment().snapshot->revision);
}

}  // namespace octosurf::node
