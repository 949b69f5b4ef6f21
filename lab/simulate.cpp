// `octosurf-lab simulate`: posed scans of a known scene, with ground truth.
#include "simulation/simulate.hpp"

#include "bounds.hpp"
#include "progress.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

constexpr const char* simulate_description =
    R"(Records a simulated scene: posed scans and the truth about its planar faces.

Examples:
  octosurf-lab simulate office -o sim/office
  octosurf-lab simulate stairs -o sim/strips --sensor tilting --seed 7
  octosurf-lab simulate corridor -o sim/long --length 60 --laps 2 --drift-m 0.1
  octosurf-lab simulate --mesh stairs.stl -o sim/terrain
  octosurf-lab simulate --mesh rubble.obj --up y --scale 0.001 -o sim/rubble --frames 300
  octosurf map sim/office -o maps/office && octosurf-lab evaluate maps/office --truth sim/office/truth.json

Scenes:
  room      table and box in a room          stones    tilted blocks, some of them close together
  office    stair, tables, clutter, a ball   corridor  rooms at its sides, as long as you like
  storeys   two floors and a stair between them
  stairs    six steps and a landing          change    a box goes, one is moved, one comes midway
  flight, landing, spiral, open   a stair of its kind, all its measures by the seed

With --mesh the scene is a terrain of yours, in its own size: its truth are the coplanar pieces of the
mesh that can be seen from outside, its path lanes over it, there and back, at the height of a walking
robot's camera that looks 30 to 40° down. How triangles are wound does not matter; solids may stand in
each other; a solid with an open side is seen from inside, too.

A depth camera's recording is a 7-Scenes folder, a laser's is PCD files with poses; truth.json and
labels (frame-*.label.png, the PCDs' field `label`) stand beside the scans.

--sensor depth has independent Gaussian noise alone. --sensor depth-real is a camera as published models
of Kinect and RealSense describe it: disparity in steps of 1/8 px (1 cm at 2 m), noise correlated over
9 pixels (6 mm at 2 m), one flying pixel a pixel of outline, no readings at grazing incidence and of dark
things, a slow bias over the image (3 mm at 2 m).
)";

struct SimulateArguments {
  simulation::SimulationOptions options;
  std::size_t frames = 0;  // 0: as many as show the scene well
  double drift_deg = 0;
  std::string dir;
};

void require_one_scene(const simulation::SimulationOptions& options) {
  const bool mesh = !options.mesh.empty();
  if (mesh && !options.scene.empty())
    throw Error(Error::Kind::usage, "simulate", "a scene and --mesh are given", "give one of them");
  if (!mesh && options.scene.empty())
    throw Error(Error::Kind::usage, "simulate", "neither a scene nor --mesh is given",
                "name room, office, stairs, stones, corridor or change, or a file with --mesh");
  if (!mesh && (!options.mesh_up.empty() || options.mesh_scale != 1))
    throw Error(Error::Kind::usage, "simulate", "--up and --scale say how to read a mesh, and none is given",
                "leave them out, or name a file with --mesh");
}

void print_mesh(const simulation::MeshSummary& mesh) {
  std::printf("%-16s %zu", "triangles", mesh.triangles);
  if (mesh.dropped > 0) std::printf(", %zu more of no width left out", mesh.dropped);
  if (mesh.open_edges > 0)
    std::printf(", %zu edges with a triangle on one side only: solids may be open there", mesh.open_edges);
  std::printf("\n");
}

void run_simulate(const SimulateArguments& arguments) {
  simulation::SimulationOptions options = arguments.options;
  require_one_scene(options);
  if (arguments.frames > 0) options.frames = arguments.frames;
  options.drift_rad = arguments.drift_deg * std::numbers::pi / 180;
  std::optional<Progress> progress;
  const simulation::SimulationSummary summary =
      simulation::simulate(options, arguments.dir, [&](std::size_t done, std::size_t total) {
        if (!progress) progress.emplace(total);
        progress->show(done);
      });
  if (summary.mesh) print_mesh(*summary.mesh);
  std::printf("%-16s %zu over %.1f s\n", "scans", summary.scans, summary.duration_s);
  std::printf("%-16s %zu\n", "points", summary.points);
  std::printf("%-16s %zu, %zu of them with 0.05 m² and more seen", "planar faces", summary.faces,
              summary.visible_faces);
  if (summary.gone_faces > 0) std::printf(" (%zu gone at the end)", summary.gone_faces);
  std::printf("\n%-16s %s\n", "written to", arguments.dir.c_str());
}

}  // namespace

void add_simulate(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("simulate", simulate_description);
  const auto arguments = std::make_shared<SimulateArguments>();
  simulation::SimulationOptions& options = arguments->options;
  options.scene.clear();
  verb->add_option("scene", options.scene, "a name of those above");
  verb->add_option("--mesh", options.mesh, "STL, OBJ, PLY or DAE: the scene is this terrain");
  verb->add_option(
      "--up", options.mesh_up,
      "axis of the mesh that is up: x, y, z, or --up=-x, -y, -z (default: z, or what a DAE says)");
  verb->add_option("--scale", options.mesh_scale, "m per unit of the mesh")->capture_default_str();
  verb->add_option("-o,--output", arguments->dir, "folder to write")->required();
  verb->add_option("--sensor", options.sensor,
                   "depth (640×480 camera), depth-real (with steps, flying pixels, drop-outs and bias), "
                   "tilting (2-D laser), spinning (3-D lidar)")
      ->capture_default_str();
  verb->add_option("--seed", options.seed, "varies dimensions and noise; turns, shifts and scales the world")
      ->capture_default_str();
  verb->add_option("--frames", arguments->frames, "number of scans (default: as many as show the scene well)")
      ->check(at_least(1));
  verb->add_option("--noise-scale", options.noise_scale,
                   "factor on the sensor's noise (0: none; steps and drop-outs remain)")
      ->capture_default_str();
  verb->add_option("--length", options.length, "m, of the corridor")->capture_default_str();
  verb->add_option("--laps", options.laps, "times the path is walked")->capture_default_str();
  verb->add_option("--drift-m", options.drift_m, "m per lap by which the recorded poses slide away")
      ->capture_default_str();
  verb->add_option("--drift-deg", arguments->drift_deg, "degrees per lap by which they turn")
      ->capture_default_str();
  verb->add_flag("--force", options.force, "replace a recording in the folder");
  verb->callback([arguments] { run_simulate(*arguments); });
}

}  // namespace octosurf
