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
#include <numeric>
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

constexpr const char* command_description =
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

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(verb->get_name());
  return names;
}

/// Letters to be put in, left out or changed to make one word of the other (Levenshtein).
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : a) {
    std::size_t before = row[0]++;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t changed = before + (letter == b[k] ? 0 : 1);
      before = row[k + 1];
      row[k + 1] = std::min({changed, before + 1, row[k] + 1});
    }
  }
  return row.back();
}

/// "; did you mean …?" of the known word that is most like one; empty if more than a third of it differs.
std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t fewest = word.size() / 3 + 1;
  for (const std::string& other : known)
    if (const std::size_t count = edits(word, other); count < fewest) {
      fewest = count;
      nearest = other;
    }
  return nearest.empty() ? std::string() : "; did you mean " + nearest + "?";
}

/// For an option that the verb does not have.
std::string suggested_option(const CLI::App& app, const std::string& verb,
                             const std::vector<std::string>& words) {
  if (verb.empty()) return {};
  std::vector<std::string> known;
  for (const CLI::Option* option : app.get_subcommand(verb)->get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--") && std::find(known.begin(), known.end(), name) == known.end())
      return suggestion(name, known);
  }
  return {};
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
std::vector<std::string> arguments_of(std::vector<std::string> words) {
  for (std::size_t i = 0; i + 3 < words.size(); ++i) {
    const auto first = words.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    if (words[i] != "--up" || !std::all_of(first, first + 3, is_number)) continue;
    *first = *first + " " + *(first + 1) + " " + *(first + 2);
    words.erase(first + 1, first + 3);
  }
  std::reverse(words.begin(), words.end());
  return words;
}

int run_command(CLI::App& app, int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) return complain({}, "a verb is missing; octosurf --help lists them", wrong_use);
  if (words.front() == "help") {  // of a verb, or of all
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const std::vector<std::string> verbs = verbs_of(app);
  const std::string& first = words.front();
  const std::string verb =
      std::find(verbs.begin(), verbs.end(), first) == verbs.end() ? std::string() : first;
  if (verb.empty() && first != "--help" && first != "-h" && first != "--version")
    return complain(
        {}, "'" + first + "' is not a verb" + suggestion(first, verbs) + "; octosurf --help lists them",
        wrong_use);
  try {
    app.parse(arguments_of(words));
  } catch (const CLI::Success& asked) {  // help, version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    const std::string help = verb.empty() ? "octosurf --help" : "octosurf " + verb + " --help";
    const bool unknown = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    return complain(
        verb, error.what() + (unknown ? suggested_option(app, verb, words) : std::string()) + "; see " + help,
        wrong_use);
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
  CLI::App app{octosurf::command_description, "octosurf"};
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
  return octosurf::run_command(app, argc, argv);
}
