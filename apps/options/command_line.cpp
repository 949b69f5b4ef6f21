#include "command_line.hpp"

#include "bounds.hpp"
#include "io/text_file.hpp"

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

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

enum ExitCode { done = 0, failed = 1, wrong_use = 2 };

/// Lists the verbs by the first line of their descriptions; the rest is for their own help.
class Formatter : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* verb) const override {
    const std::string text = verb->get_description();
    return io::formatted("  %-10s %s\n", verb->get_name().c_str(), text.substr(0, text.find('\n')).c_str());
  }
};

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(verb->get_name());
  return names;
}

/// One line. Allocates no memory, because there may be none.
int complain(const std::string& program, const std::string& verb, std::string_view message, ExitCode code) {
  std::array<char, 4096> line;
  const std::size_t length = std::min(message.size(), line.size() - 1);
  std::replace_copy(message.begin(), message.begin() + length, line.begin(), '\n', ' ');
  line[length] = 0;
  std::fprintf(stderr, "%s%s%s: %s\n", program.c_str(), verb.empty() ? "" : " ", verb.c_str(), line.data());
  return code;
}

/// The end of every verb: what it printed may have gone nowhere, as to a full disk.
int finish(const std::string& program, const std::string& verb) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return done;
  return complain(program, verb, "standard output: cannot be written; is the disk full?", failed);
}

bool is_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// The arguments for CLI11, last first, with the three numbers of `--up X Y Z` joined: an option of one word
/// or three numbers would take the map's name after it.
std::vector<std::string> arguments_of(std::vector<std::string> words) {
  for (std::size_t i = 0; i + 3 < words.size(); ++i) {
    const auto first = words.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    if (words[i] != "--up" || !std::all_of(first, first + 3, is_number)) continue;
    *first = *first + " " + *(first + 1) + " " + *(first + 2);
    words.erase(first + 1, first + 3);
  }
  std::ranges::reverse(words);
  return words;
}

}  // namespace

int run_command(CLI::App& app, int argc, char** argv) {
  const std::string program = app.get_name();
  std::signal(SIGXFSZ, SIG_IGN);  // exceeding the file size limit is an error like a full disk
#if !defined(__OPTIMIZE__) || !defined(NDEBUG)
  std::fputs("octosurf: note: not an optimised build, many times slower; use -DCMAKE_BUILD_TYPE=Release\n",
             stderr);
#endif
  app.formatter(std::make_shared<Formatter>());
  app.get_formatter()->label("SUBCOMMAND", "VERB");
  app.set_version_flag("--version", program + " " OCTOSURF_VERSION);
  app.require_subcommand(1);
  for (CLI::App* verb : app.get_subcommands({})) verb->group("Verbs");
  require_finite(app);
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty())
    return complain(program, {}, "a verb is missing; " + program + " --help lists them", wrong_use);
  if (words.front() == "help") {  // of a verb, or of all
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const std::vector<std::string> verbs = verbs_of(app);
  const std::string& first = words.front();
  const std::string verb = std::ranges::find(verbs, first) == verbs.end() ? std::string() : first;
  if (verb.empty() && first != "--help" && first != "-h" && first != "--version")
    return complain(program, {}, "'" + first + "' is not a verb; " + program + " --help lists them",
                    wrong_use);
  try {
    app.parse(arguments_of(words));
  } catch (const CLI::Success& help_or_version) {
    app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    const std::string help = verb.empty() ? program + " --help" : program + " " + verb + " --help";
    return complain(program, verb, error.what() + ("; see " + help), wrong_use);
  } catch (const Error& error) {
    return complain(program, verb, error.what(), error.kind() == Error::Kind::usage ? wrong_use : failed);
  } catch (const std::bad_alloc&) {
    return complain(program, verb, "out of memory; allow more (ulimit -v) or map at a coarser resolution",
                    failed);
  } catch (const std::exception& error) {
    return complain(program, verb, error.what(), failed);
  }
  return finish(program, verb);
}

std::string shell_word(const std::string& word) {
  return word.find_first_of(" '\"$\\*?&;()<>|") == std::string::npos ? " " + word : " '" + word + "'";
}

std::string words_for(const CLI::App& reader, const CLI::App& given, std::span<const std::string_view> but) {
  std::string text;
  for (const CLI::Option* const option : given.get_options()) {
    const std::string name = option->get_positional() ? "" : option->get_name();
    const bool writes = name == "--write-poses" || name == "--force";
    const bool other = !name.empty() && reader.get_option_no_throw(name) == nullptr;
    if (option->count() == 0 || writes || other || std::ranges::find(but, name) != but.end()) continue;
    if (!name.empty()) text += shell_word(name);
    if (option->get_type_size() > 0)
      for (const std::string& value : option->results()) text += shell_word(value);
  }
  return text;
}

}  // namespace octosurf
