#pragma once

#include <span>
#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace octosurf {

/// Runs the verb that the arguments name; the result is the exit code. 0: done, 1: the work failed, 2: wrong
/// use. Errors are one line on stderr.
int run_command(CLI::App& app, int argc, char** argv);

std::string shell_word(const std::string& word);  ///< after a blank, in quotes if it needs them
/// Of the arguments that were given to a verb, those that `reader` takes, too, but for options of these
/// names: words for a shell, each after a blank.
std::string words_for(const CLI::App& reader, const CLI::App& given, std::span<const std::string_view> but);

}  // namespace octosurf
