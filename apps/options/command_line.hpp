#pragma once

namespace CLI {
class App;
}

namespace octosurf {

/// Runs the verb that the arguments name; the result is the exit code. 0: done, 1: the work failed, 2: wrong
/// use. Errors are one line on stderr.
int run_command(CLI::App& app, int argc, char** argv);

}  // namespace octosurf
