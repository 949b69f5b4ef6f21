// `octosurf view`: a picture of a map's surfaces.
#include "output_files.hpp"
#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/export.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

constexpr const char* description =
    R"(Draws a picture of a map's surfaces, each in its colour, over a grid of 1 m.

Examples:
  octosurf view maps/office --png office.png
  octosurf view maps/office --png plan.png --from top
  octosurf view maps/office --png door.png --eye 1 0 1.6 --target 4 2 1
  octosurf view maps/office --png office.png --pending         and the points no surface has
  octosurf view maps/kitchen --png kitchen.png --up -y         up, if the map does not know it; or auto
  octosurf view maps/office --png edges.png --from top --edges
                             edges: real green, occluded red, sensor limit blue, frontier orange
)";

struct Arguments {
  std::string map, png, from = "iso", up;
  std::vector<double> eye, target;
  int width = PictureOptions{}.width, height = PictureOptions{}.height;
  bool whole = false, pending = false, edges = false, force = false;
};

Eigen::Vector3d to_point(const std::vector<double>& xyz) { return {xyz[0], xyz[1], xyz[2]}; }

void run(const Arguments& arguments) {
  require_apart("--png", arguments.png, files_of_map(arguments.map));
  const LoadedMap loaded = load_map(arguments.map);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  PictureOptions options;
  options.width = arguments.width;
  options.height = arguments.height;
  const auto at = std::find(view_names.begin(), view_names.end(), arguments.from);
  options.from = static_cast<ViewFrom>(at - view_names.begin());
  if (!arguments.eye.empty()) options.eye = to_point(arguments.eye);
  if (!arguments.target.empty()) options.target = to_point(arguments.target);
  options.up = up_in_force(loaded.map, arguments.up).direction;
  options.cut = !arguments.whole;
  options.force = arguments.force;
  if (arguments.pending) {
    loaded.map.for_each_point([&](const Map::Voxel& voxel) {
      if (voxel.surface == 0 && voxel.point) options.points.push_back(*voxel.point);
    });
  }
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  if (arguments.edges)
    for (const SurfacePtr& surface : snapshot->surfaces)
      options.edges[surface->id] = label_edges(loaded.map, *surface);
  render_png(*snapshot, arguments.png, options);
  std::printf("%s: %zu surfaces\n", arguments.png.c_str(), snapshot->surfaces.size());
}

}  // namespace

void add_view(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("view", description);
  const auto arguments = std::make_shared<Arguments>();
  verb->add_option("map", arguments->map, "map to look at: name without ending, as given to map -o")
      ->required();
  verb->add_option("--png", arguments->png, "picture to write")->required();
  CLI::Option* from = verb->add_option("--from", arguments->from, "iso, top, front, back, left or right")
                          ->check(CLI::IsMember({"iso", "top", "front", "back", "left", "right"}))
                          ->capture_default_str();
  verb->add_option("--eye", arguments->eye, "X Y Z: look from here instead")->expected(3)->excludes(from);
  verb->add_option("--target", arguments->target, "X Y Z: look at this; default: the map's middle")
      ->expected(3);
  add_up_option(*verb, arguments->up);
  verb->add_option("--width", arguments->width, "pixels")->capture_default_str();
  verb->add_option("--height", arguments->height, "pixels")->capture_default_str();
  verb->add_flag("--whole", arguments->whole, "draw surfaces seen from behind, too: ceilings hide rooms");
  verb->add_flag("--pending", arguments->pending, "draw pending points as grey dots");
  verb->add_flag("--edges", arguments->edges, "draw edges in a colour by what lies beyond them");
  verb->add_flag("--force", arguments->force, "overwrite the picture");
  verb->callback([arguments] { run(*arguments); });
}

}  // namespace octosurf
