// The `octosurf` command: one verb per file beside this one. Exit code 0: done, 1: the work failed,
// 2: wrong use. Errors are one line on stderr.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>

namespace octosurf {

void add_diff(CLI::App& app);
void add_evaluate(CLI::App& app);
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
void add_simulate(CLI::App& app);
void add_view(CLI::App& app);

namespace {

enum ExitCode { done = 0, failed = 1, wrong_use = 2 };

constexpr const char* description =
    R"(octosurf: contact surfaces for legged robots, found and kept on an OctoMap.

Examples:
  octosurf simulate office -o office
  octosurf map office -o maps/office --report report.json
  octosurf info maps/office
  octosurf export maps/office --to office.json
  octosurf VERB --help
)";

/// Lists the verbs by the first line of their descriptions; the rest of it is for their own help.
class Formatter : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* verb) const override {
    const std::string text = verb->get_description();
    char line[160];
    std::snprintf(line, sizeof line, "  %-10s %s\n", verb->get_name().c_str(),
                  text.substr(0, text.find('\n')).c_str());
    return line;
  }
};

/// The verb the command line names, or nothing.
std::string verb_of(const CLI::App& app, int argc, char** argv) {
  if (argc < 2) return {};
  const std::string word = argv[1];
  const auto verbs = app.get_subcommands([&](const CLI::App* verb) { return verb->get_name() == word; });
  return verbs.empty() ? std::string() : word;
}

/// One line. Takes no memory, because there may be none.
int complain(const std::string& verb, std::string_view message, ExitCode code) {
  std::array<char, 4096> line;
  const std::size_t length = std::min(message.size(), line.size() - 1);
  std::replace_copy(message.begin(), message.begin() + length, line.begin(), '\n', ' ');
  line[length] = 0;
  std::fprintf(stderr, "octosurf%s%s: %s\n", verb.empty() ? "" : " ", verb.c_str(), line.data());
  return code;
}

bool is_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// The arguments for CLI11, last first, with the three numbers of `--up X Y Z` made one: an option that
/// takes one word or three numbers would swallow the map's name behind the word.
std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t i = 0; i + 3 < words.size(); ++i) {
    const auto first = words.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    if (words[i] != "--up" || !std::all_of(first, first + 3, is_number)) continue;
    *first = *first + " " + *(first + 1) + " " + *(first + 2);
    words.erase(first + 1, first + 3);
  }
  std::reverse(words.begin(), words.end());
  return words;
}

int run(CLI::App& app, int argc, char** argv) {
  const std::string verb = verb_of(app, argc, argv);
  if (argc < 2) return complain({}, "a verb is missing; octosurf --help lists them", wrong_use);
  const std::string first = argv[1];
  if (verb.empty() && first != "--help" && first != "-h" && first != "--version")
    return complain({}, "'" + first + "' is not a verb; octosurf --help lists them", wrong_use);
  try {
    app.parse(arguments_of(argc, argv));
  } catch (const CLI::Success& asked) {  // help, version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    const std::string help = verb.empty() ? "octosurf --help" : "octosurf " + verb + " --help";
    return complain(verb, std::string(error.what()) + "; see " + help, wrong_use);
  } catch (const Error& error) {
    return complain(verb, error.what(), error.kind() == Error::Kind::usage ? wrong_use : failed);
  } catch (const std::bad_alloc&) {
    return complain(verb, "out of memory; map fewer scans at once or use a coarser resolution", failed);
  } catch (const std::exception& error) {
    return complain(verb, error.what(), failed);
  }
  return done;
}

}  // namespace
}  // namespace octosurf

int main(int argc, char** argv) {
  octosurf::enable_paper_detector();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow further is an error like a full disk
#if !defined(__OPTIMIZE__) || !defined(NDEBUG)
  std::fputs("octosurf: note: not an optimised build, many times slower; use -DCMAKE_BUILD_TYPE=Release\n",
             stderr);
#endif
  CLI::App app{octosurf::description, "octosurf"};
  app.formatter(std::make_shared<octosurf::Formatter>());
  app.get_formatter()->label("SUBCOMMAND", "VERB");
  app.set_version_flag("--version", "octosurf " OCTOSURF_VERSION);
  app.require_subcommand(1);
  octosurf::add_map(app);
  octosurf::add_localize(app);
  octosurf::add_remap(app);
  octosurf::add_merge(app);
  octosurf::add_info(app);
  octosurf::add_export(app);
  octosurf::add_view(app);
  octosurf::add_serve(app);
  octosurf::add_query(app);
  octosurf::add_plan(app);
  octosurf::add_explain(app);
  octosurf::add_diff(app);
  octosurf::add_simulate(app);
  octosurf::add_evaluate(app);
  for (CLI::App* verb : app.get_subcommands({})) verb->group("Verbs");
  return octosurf::run(app, argc, argv);
}
