#include "services.hpp"

#include "messages.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>

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

const services::AskedMap& Services::asked() {
  std::shared_ptr<const Snapshot> snapshot = mapping_.moment().snapshot;
  if (!asked_ || asked_->snapshot != snapshot)
    asked_ = std::make_unique<services::AskedMap>(std::move(snapshot), asked_.get(), mapping_.up());
  return *asked_;
}

void Services::query(io::MessageReader& in, io::MessageWriter& out) {
  services::PlaceQuestion question;
  question.kind = in.u8();
  question.point = read_point(in);
  question.corner = read_point(in);
  question.direction = read_point(in);
  question.distance = in.f64();
  question.max_slope = in.f64();
  question.surface = in.u32();
  const services::AskedMap& map = asked();
  services::PlaceAnswer found;
  write_outcome(out, [&] {
    found = services::answer(map, question);
    return std::string();
  });
  out.fields("revision", map.snapshot->revision, "found", found.found, "surfaces", found.surfaces, "point",
             found.point, "distance", found.distance, "normal", found.normal, "front", found.front, "state",
             found.state, "log_odds", found.log_odds, "ground", found.ground);
}

void Services::contact_regions(io::MessageReader& in, io::MessageWriter& out) {
  services::RegionsQuestion question;
  question.surface = in.u32();
  for (double* value : {&question.length, &question.width, &question.radius}) *value = in.f64();
  question.any_heading = in.u8() != 0;
  for (double* value : {&question.yaw, &question.max_slope, &question.edge_margin, &question.obstacle_margin,
                        &question.clearance})
    *value = in.f64();
  in.f64();  // gap_depth
  question.pieces = in.u32();
  const services::AskedMap& map = asked();
  std::vector<services::FoundRegion> regions;
  write_outcome(out, [&] {
    regions = services::answer(map, question);
    return std::string();
  });
  out.fields("revision", map.snapshot->revision, "regions", io::each(regions, write_region));
}

void Services::plan(io::MessageReader& in, io::MessageWriter& out) {
  services::PlanQuestion question;
  question.robot = in.text();
  question.start = read_standing(in);
  question.goal = read_standing(in);
  question.expansions = in.u32();
  question.time_limit = in.f64();
  const services::AskedMap& map = asked();
  FootstepPlan plan;
  bool found = false;
  write_outcome(out, [&] {
    plan = services::answer(map, question);
    found = plan.found();
    return plan.refusal ? plan.refusal->sentence : std::string();
  });
  out.fields("revision", map.snapshot->revision, "found", found, "start",
             io::each(plan.start, write_footstep), "steps", io::each(plan.steps, write_footstep), "cost",
             plan.cost, "lower_bound", plan.lower_bound, "expansions",
             static_cast<std::uint32_t>(plan.expansions));
}

}  // namespace octosurf::dds
