// `octosurf serve`: the page, live, and what it asks.
#include "bounds.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "serve/http_server.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <octosurf/page.hpp>

namespace octosurf {
namespace {

constexpr const char* serve_description =
    R"help(Serves a map over HTTP to this machine: the page to look at it.

Prints one line, "serving http://127.0.0.1:PORT/", and runs until Ctrl-C or SIGTERM.

Examples:
  octosurf serve maps/office                     the page is at the address that is printed
  octosurf serve maps/office --port 8080
  curl http://127.0.0.1:8080/api/changes         the surfaces in JSON; with ?since=N what has changed since revision N
  ssh -L 8080:127.0.0.1:8080 robot               on another machine: there http://127.0.0.1:8080/ is the robot's
)help";

struct ServeArguments {
  std::string map, up;
  std::uint16_t port = 0;
  double max_mb = PageOptions{}.max_mb;
};

void run_serve(const ServeArguments& arguments) {
  const auto served = std::make_shared<const ServedMap>(
      asked_map(open_map(arguments.map), title_of(arguments.map), arguments.up), arguments.max_mb);
  sigset_t ends;
  sigemptyset(&ends);
  for (const int number : {SIGINT, SIGTERM}) sigaddset(&ends, number);
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // first: who reads the line may send one
  const HttpServer server(arguments.port, [&] { return served; });
  std::printf("serving %s\n", server.url().c_str());
  std::fflush(stdout);
  int number = 0;
  ::sigwait(&ends, &number);
  ::pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);  // a second one ends at once
}

}  // namespace

void add_serve(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("serve", serve_description);
  const auto arguments = std::make_shared<ServeArguments>();
  verb->add_option("map", arguments->map, "map to serve: name without ending, as given to map -o")
      ->required();
  verb->add_option("--port", arguments->port, "port to listen on; 0: any free port")->capture_default_str();
  verb->add_option("--max-mb", arguments->max_mb,
                   "size limit of the page in MB (10⁶ bytes): voxels are merged until it fits")
      ->check(more_than(0))
      ->capture_default_str();
  add_up_option(*verb, arguments->up);
  verb->callback([arguments] { run_serve(*arguments); });
}

}  // namespace octosurf
