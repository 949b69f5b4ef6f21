// Footstep plans over simulated scenes and terrains, judged by the truth: is every sole on true ground, does
// anything touch, and are as many goals reached as by the same planner on the true surfaces.

#include "bench/plan_world.hpp"
#include "bench/support.hpp"
#include "evaluation/evaluate.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <numbers>
#include <optional>
#include <random>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"stairs", "stones", "office", "bauzil_stairs", "darpa", "rubbles_stairs_1"};
  std::uint64_t seed = 1;
  std::size_t goals = 50;
  double shortest_m = 1;  ///< between start and goal
  PlanBudget budget;
  std::size_t way = 0;  ///< expansions that decide whether there is a way at all; 0: not looked for
  std::optional<double> edge_margin_m;  ///< in place of the robot's own
  std::string robot = "biped";
};

/// CPU time, because other work may share the machine and a planner has one thread.
double cpu_ms(const std::function<void()>& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

struct Result {
  std::size_t goals = 0, mapped = 0, ways = 0, truth = 0, only_mapped = 0, only_truth = 0;
  std::size_t unsupported = 0, off_plane = 0, touching = 0, refuted = 0, unreachable = 0, budget = 0,
              steps = 0;
  std::vector<double> ms;
  double first_ms = 0;
};

Result run(const Options& options, const World& world) {
  Robot robot = options.robot == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  if (options.edge_margin_m)
    std::visit([&](auto& kind) { kind.contact.edge_margin_m = *options.edge_margin_m; }, robot);
  const ContactShape foot = std::visit([](const auto& kind) { return kind.foot; }, robot);
  FootstepPlanner on_map(world.mapped, world.octree, robot), on_truth(world.truth, world.true_octree, robot);
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  const auto standing = [&]() {
    for (;;) {  // where the planner on the truth says that one can stand
      Standing drawn = world.candidates[random() % world.candidates.size()];
      drawn.yaw_rad = turn(random);
      if (on_truth.plan(drawn, drawn).found()) return drawn;
    }
  };
  Result result;
  for (; result.goals < options.goals; ++result.goals) {
    const Standing from = standing();
    Standing to = standing();
    for (int tries = 0; (to.at - from.at).norm() < options.shortest_m && tries < 100; ++tries)
      to = standing();
    const FootstepPlan truth = on_truth.plan(from, to, options.budget);
    FootstepPlan mapped;
    (result.goals == 0 ? result.first_ms : result.ms.emplace_back()) =
        cpu_ms([&] { mapped = on_map.plan(from, to, options.budget); });
    result.truth += truth.found();
    result.mapped += mapped.found();
    result.ways += mapped.found() || (options.way > 0 && on_map.plan(from, to, {options.way, 0, {}}).found());
    result.only_mapped += mapped.found() && !truth.found();
    result.only_truth += truth.found() && !mapped.found();
    if (!mapped.found()) {
      result.unreachable += mapped.refusal->why != NoPlan::Why::budget;
      result.budget += mapped.refusal->why == NoPlan::Why::budget;
      continue;
    }
    result.steps += mapped.steps.size();
    std::size_t off = 0;
    for (const Footstep& step : mapped.steps) {
      off += !supported(world, step, foot,
                        evaluation::EvaluationOptions{}.tolerance_at(world.mapped->resolution));
      result.off_plane += !supported(world, step, foot, within_m);
    }
    result.unsupported += off;
    const bool touch = touches(world, mapped, robot);
    result.touching += touch;
    const std::vector<std::string> wrong = verify_plan(mapped, *world.mapped, world.octree, robot);
    result.refuted += !wrong.empty();
  }
  return result;
}

/// The mesh of a terrain's name; empty for a scene. Nothing if the data are missing.
std::optional<std::filesystem::path> mesh_of(const std::string& scene) {
  for (const char* name : {"stairs", "stones", "office", "room", "corridor"})
    if (scene == name) return std::filesystem::path();
  const std::filesystem::path file =
      std::filesystem::path(OCTOSURF_DATA_DIR) / "terrain_meshes" / (scene + ".stl");
  if (!std::filesystem::exists(file)) return std::nullopt;
  return file;
}

void body(const Options& options) {
  TextTable table({"scene", "goals", "found", "ways", "truth's", "only map", "only truth", "steps",
                   "soles off", "1 cm", "touch", "refuted", "refused", "budget", "first ms", "p50", "p95"});
  for (const std::string& scene : options.scenes) {
    const auto mesh = mesh_of(scene);
    if (!mesh) {
      std::printf("%s: skipped, its mesh is missing\n", scene.c_str());
      continue;
    }
    const World world = make_world(scene, *mesh, options.seed);
    const Result r = run(options, world);
    table.add({scene, std::to_string(r.goals), std::to_string(r.mapped), std::to_string(r.ways),
               std::to_string(r.truth), std::to_string(r.only_mapped), std::to_string(r.only_truth),
               std::to_string(r.steps), std::to_string(r.unsupported), std::to_string(r.off_plane),
               std::to_string(r.touching), std::to_string(r.refuted), std::to_string(r.unreachable),
               std::to_string(r.budget), fixed(r.first_ms, 0), fixed(percentile(r.ms, 0.5), 1),
               fixed(percentile(r.ms, 0.95), 1)});
    std::fprintf(stderr, "%s done\n", scene.c_str());
  }
  std::printf(
      "%s, seed %zu. \"ways\": found, or found with --way expansions; \"truth's\": found by the same planner "
      "on what was seen of the true surfaces, and a "
      "noise-free octree; \"off\": steps of which a part lies more than 1 cm beside all true ground (3 cm "
      "off its plane counts as on it), \"1 cm\": or more than 1 cm off its plane; \"touch\": plans whose "
      "body or swinging leg meets a true "
      "point by more than 1 cm; \"refuted\": by verify_plan(); \"refused\": start or goal not standable, or "
      "proven unreachable; ms of CPU, the first plan with all preparation apart.\n%s",
      options.robot.c_str(), static_cast<std::size_t>(options.seed), table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"footstep plans over simulated scenes and terrains, judged by the truth"};
  app.add_option("--scenes", options.scenes, "scenes, and meshes of ../shared/data/terrain_meshes by name")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--goals", options.goals)->capture_default_str();
  app.add_option("--shortest", options.shortest_m, "m, between start and goal at least")
      ->capture_default_str();
  app.add_option("--way", options.way, "expansions after which there is said to be no way; 0: not looked for")
      ->capture_default_str();
  app.add_option("--robot", options.robot)
      ->check(CLI::IsMember({"biped", "quadruped"}))
      ->capture_default_str();
  app.add_option("--budget", options.budget.expansions, "expansions to find a plan")->capture_default_str();
  app.add_option("--improving", options.budget.improving, "further ones to find a better one")
      ->capture_default_str();
  app.add_option("--edge-margin", options.edge_margin_m, "of footholds, m, in place of the robot's own");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
