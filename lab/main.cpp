// The program `octosurf-lab`: makes recordings with known truth, and judges maps by it.
#include "command_line.hpp"

#include <CLI/CLI.hpp>

namespace octosurf {
void add_evaluate(CLI::App& app);
void add_simulate(CLI::App& app);
}  // namespace octosurf

int main(int argc, char** argv) {
  CLI::App app{R"(octosurf-lab: makes recordings with known truth, and judges maps by it.

Examples:
  octosurf-lab simulate office -o office
  octosurf map office -o maps/office
  octosurf-lab evaluate maps/office --truth office/truth.json
)",
               "octosurf-lab"};
  octosurf::add_simulate(app);
  octosurf::add_evaluate(app);
  return octosurf::run_command(app, argc, argv);
}
