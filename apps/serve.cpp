// `octosurf serve`: the page, and a planner's questions over HTTP.
#include "bounds.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "serve/api.hpp"
#include "serve/http_server.hpp"
#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/page.hpp>

namespace octosurf {
namespace {

constexpr const char* serve_description =
    R"help(Serves a map over HTTP: the page to look at it, and answers in JSON.

Prints one line, "serving http://127.0.0.1:PORT/", and runs until Ctrl-C or SIGTERM. Only this machine is
served; --listen serves others, who need a token.

Examples:
  octosurf serve maps/office                     the page is at the address that is printed
  octosurf serve maps/office --port 8080
  curl 'http://127.0.0.1:8080/api/query/below?point=-4.6,-0.6,1'
  curl 'http://127.0.0.1:8080/api/regions?surface=1&foot=0.22x0.11&yaw_deg=90&edge_margin_m=0.02&pieces=8'
  curl 'http://127.0.0.1:8080/api/plan?from=-4.6,-0.6,0.6,-135&to=-6.6,-2.7,1.5,-135'
  curl http://127.0.0.1:8080/api                 all questions and their parameters
  openssl rand -hex 32 > token; chmod 600 token
  octosurf serve maps/office --listen 0.0.0.0 --port 8080 --token token
  curl -H "Authorization: Bearer $(cat token)" http://robot:8080/api/surfaces

/api/query/{box,sphere,ray,voxel,nearest,below,foothold}, /api/regions and /api/plan answer as octosurf query
--json and octosurf plan --json do; parameters are called as their options, with _ and a unit.
/live sends an event for what changes, as the page of map --serve follows its map.
A token goes over the network as it is; where others listen, tunnel instead: ssh -L 8080:127.0.0.1:8080 robot
)help";

constexpr const char* token_variable = "OCTOSURF_TOKEN";
// Guessed at a thousand a second, 16 letters and digits take longer than the universe has.
constexpr std::size_t shortest_token = 16, longest_token = 4096;

struct ServeArguments {
  std::string map, up, token_file;
  HttpPlace place;
  double max_mb = PageOptions{}.max_mb;
};

/// Of the file, or of the environment; empty if neither is given.
std::string token_of(const ServeArguments& arguments) {
  std::string token, where = token_variable;
  if (!arguments.token_file.empty()) {
    where = arguments.token_file;
    std::ifstream in(where, std::ios::binary);
    token.resize(longest_token + 1);
    in.read(token.data(), static_cast<std::streamsize>(token.size()));
    token.resize(static_cast<std::size_t>(in.gcount()));
    if (in.bad() || !in.eof() || token.empty())
      throw Error(Error::Kind::data, where, "cannot be read as a token",
                  "write one into it, of up to 4096 letters");
    while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
  } else if (const char* given = std::getenv(token_variable)) {
    token = given;
  } else {
    return {};
  }
  // The library decodes %41 in fields.
  const bool plain =
      std::all_of(token.begin(), token.end(), [](char c) { return '!' <= c && c <= '~' && c != '%'; });
  if (token.size() < shortest_token || !plain)
    throw Error(Error::Kind::usage, where, "holds no token of 16 letters or more, without blanks and %",
                "openssl rand -hex 32 makes one");
  return token;
}

void run_serve(const ServeArguments& arguments) {
  HttpPlace place = arguments.place;
  if (place.address == "localhost") place.address = "127.0.0.1";
  place.token = token_of(arguments);
  if (place.token.empty() && !is_loopback(place.address))
    throw Error(Error::Kind::usage, "--listen " + place.address, "lets others ask, too",
                std::string("give a token they must know by --token FILE or ") + token_variable);
  LoadedMap map = open_map(arguments.map);
  const auto served = std::make_shared<const ServedMap>(std::move(map), title_of(arguments.map), arguments.up,
                                                        arguments.max_mb);
  Api api([&] { return served; });
  sigset_t ends;
  sigemptyset(&ends);
  for (const int number : {SIGINT, SIGTERM}) sigaddset(&ends, number);
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // first: who reads the line may send one
  const HttpServer server(place, api);
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
  verb->add_option("--listen", arguments->place.address, "address of this machine to listen on")
      ->type_name("ADDRESS")
      ->capture_default_str();
  verb->add_option("--port", arguments->place.port, "port to listen on; 0: any free port")
      ->capture_default_str();
  verb->add_option("--token", arguments->token_file,
                   "file with the token that clients must send; or set OCTOSURF_TOKEN")
      ->type_name("FILE");
  verb->add_option("--max-mb", arguments->max_mb,
                   "size limit of the page in MB (10⁶ bytes): voxels are merged until it fits")
      ->check(more_than(0))
      ->capture_default_str();
  add_up_option(*verb, arguments->up);
  verb->callback([arguments] { run_serve(*arguments); });
}

}  // namespace octosurf
