// The `octosurf` command: one verb per file beside this one.
#include "command_line.hpp"

#include <CLI/CLI.hpp>

namespace octosurf {

void add_check(CLI::App& app);
void add_clear(CLI::App& app);
void add_diff(CLI::App& app);
void add_explain(CLI::App& app);
void add_export(CLI::App& app);
void add_info(CLI::App& app);
void add_map(CLI::App& app);
void add_plan(CLI::App& app);
void add_query(CLI::App& app);
void add_localize(CLI::App& app);
void add_merge(CLI::App& app);
void add_remap(CLI::App& app);
void add_serve(CLI::App& app);
void add_view(CLI::App& app);

namespace {

constexpr const char* command_description =
    R"(octosurf: contact surfaces for legged robots, found and kept on an occupancy octree.

Examples:
  octosurf map scans -o maps/office --report report.json
  octosurf info maps/office
  octosurf export maps/office --to office.json
  octosurf VERB --help
)";

}  // namespace
}  // namespace octosurf

int main(int argc, char** argv) {
  using namespace octosurf;
  CLI::App app{command_description, "octosurf"};
  for (const auto add : {add_map, add_check, add_localize, add_remap, add_merge, add_clear, add_info,
                         add_export, add_view, add_serve, add_query, add_plan, add_explain, add_diff})
    add(app);
  return run_command(app, argc, argv);
}
