// `octosurf view`: a page to look at a map, or a picture of it.
#include "bounds.hpp"
#include "io/new_file.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "serve/served_map.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

#include <octosurf/export.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/map.hpp>
#include <octosurf/page.hpp>

namespace octosurf {
namespace {

constexpr const char* view_description =
    R"(Writes a page to look at a map in a browser, or draws a picture of it.

The page is one HTML file that fetches nothing: surfaces, cylinders, voxels
and stairs. Without --html it is written to MAP.html in the current folder.

Examples:
  octosurf view maps/office                                   office.html
  octosurf view maps/office --html out/page.html --force
  octosurf view maps/hall --max-mb 30                         finer voxels, if they need more than 10 MB
  octosurf view maps/office --png office.png
  octosurf view maps/office --png plan.png --from top
  octosurf view maps/kitchen --png kitchen.png --up -y         up, if the map does not know it; or auto

)";

struct ViewArguments {
  std::string map, html, png, from = "iso", up;
  PictureOptions picture;
  double max_mb = PageOptions{}.max_mb;
  bool force = false;
};

void write_html(const ViewArguments& arguments) {
  const std::string title = title_of(arguments.map);
  const std::string html = arguments.html.empty() ? title + ".html" : arguments.html;
  require_apart("--html", html, files_of_map(arguments.map));
  const LoadedMap loaded = open_map(arguments.map);
  io::NewFile output(html, arguments.force);  // first, because making a page takes a while
  if (arguments.up.empty()) warn_of_up(loaded.map);
  const ServedMap map(asked_map(loaded, title, arguments.up), arguments.max_mb);
  const std::string page = map.page();
  output.write([&](std::ostream& out) { out << page; });
  output.commit();
  std::printf("%s: %.1f MB, %zu surfaces\n", html.c_str(), static_cast<double>(page.size()) / 1e6,
              map.asked.snapshot->surfaces.size());
}

void draw_png(ViewArguments& arguments) {
  require_apart("--png", arguments.png, files_of_map(arguments.map));
  const LoadedMap loaded = open_map(arguments.map);
  PictureOptions& options = arguments.picture;
  const auto at = std::ranges::find(view_names, arguments.from);
  options.from = static_cast<ViewFrom>(at - view_names.begin());
  if (arguments.up.empty()) warn_of_up(loaded.map);
  options.up = up_in_force(loaded.map, arguments.up).direction;
  options.force = arguments.force;
  GroundRules rules;
  rules.widest_unseen_m = 0;
  const std::shared_ptr<const Snapshot> snapshot =
      GroundView(loaded.map.snapshot(), loaded.map.octree(), rules).solid();
  render_png(*snapshot, arguments.png, options);
  std::printf("%s: %zu surfaces\n", arguments.png.c_str(), snapshot->surfaces.size());
}

void add_picture_options(CLI::App& verb, ViewArguments& arguments, CLI::Option* png) {
  PictureOptions& picture = arguments.picture;
  for (CLI::Option* option :
       {verb.add_option("--from", arguments.from, "iso: obliquely from above; top: from above")
            ->check(CLI::IsMember({"iso", "top"}))
            ->capture_default_str(),
        verb.add_option("--width", picture.width, "pixels")->capture_default_str(),
        verb.add_option("--height", picture.height, "pixels")->capture_default_str()})
    option->needs(png)->group("Of a picture");
}

}  // namespace

void add_view(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("view", view_description);
  const auto arguments = std::make_shared<ViewArguments>();
  verb->add_option("map", arguments->map, "map to look at: name without ending, as given to map -o")
      ->required();
  CLI::Option* html = verb->add_option("--html", arguments->html, "page to write [MAP.html]");
  CLI::Option* png =
      verb->add_option("--png", arguments->png, "picture to draw instead")->type_name("FILE")->excludes(html);
  add_up_option(*verb, arguments->up);
  verb->add_option("--max-mb", arguments->max_mb,
                   "size limit of the page in MB (10⁶ bytes): voxels are merged until it fits")
      ->check(more_than(0))
      ->excludes(png)
      ->capture_default_str();
  add_picture_options(*verb, *arguments, png);
  verb->add_flag("--force", arguments->force, "overwrite the file");
  verb->callback([arguments] { arguments->png.empty() ? write_html(*arguments) : draw_png(*arguments); });
}

}  // namespace octosurf
