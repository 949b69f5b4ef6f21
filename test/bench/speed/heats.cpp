#include "bench/speed/heats.hpp"

#include <octosurf/error.hpp>

namespace octosurf::bench {

Heat& Heat::of(const std::string& key, const ScanSet& scans) {
  static std::map<std::string, std::unique_ptr<Heat>> heats;
  std::unique_ptr<Heat>& heat = heats[key];
  if (!heat) heat.reset(new Heat(scans));
  return *heat;
}

void Heat::enter(const std::string& name, const std::string& kind, const Json& settings) {
  entrants_.try_emplace(name, Entrant{kind, settings, {}, {}});
}

const std::vector<Turn>& Heat::turns(const std::string& name) { return result(name).turns; }
const Json& Heat::told(const std::string& name) { return result(name).told; }

Heat::Entrant& Heat::result(const std::string& name) {
  if (!done_) run();
  return entrants_.at(name);
}

void Heat::run() {
  Contest contest;
  for (const auto& [name, entrant] : entrants_) contest.enter(name, entrant.kind, entrant.settings);
  scans_.each([&](const Scan& scan) { contest.turn(scan); });

  static int heats_run = 0;
  const std::string stem = (scratch_folder() / ("heat" + std::to_string(++heats_run))).string();
  const std::string their_tree = stem + ".ot";
  for (auto& [name, entrant] : entrants_)
    if (entrant.kind == "octomap") entrant.told = contest.ask(name, {{"write", their_tree}});
  for (auto& [name, entrant] : entrants_) {
    entrant.turns = contest.turns(name);
    if (entrant.kind == "octomap") continue;
    Json question = Json::object();
    if ((entrant.kind == "occupancy" || entrant.kind == "plain") && std::filesystem::exists(their_tree))
      question["compare"] = their_tree;
    if (entrant.kind == "mapper") question["save"] = stem;
    entrant.told = contest.ask(name, question);
    if (entrant.kind == "mapper") entrant.told["stem"] = stem;
  }
  std::filesystem::remove(their_tree);
  done_ = true;
}

}  // namespace octosurf::bench
