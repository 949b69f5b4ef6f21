#pragma once

#include <CLI/CLI.hpp>

namespace octosurf {

/// Range checks of an option's number, with messages such as "--every: '0' must be 1 or more".
CLI::Validator at_least(double low);
CLI::Validator more_than(double low);
CLI::Validator between(double low, double high);  ///< both included

/// --threads, by default one for each processor.
void add_threads(CLI::App& verb, int& threads);

/// Refuses nan and inf in all options of numbers, of the verbs, too: CLI11's own ranges take them.
void require_finite(CLI::App& app);

/// A group of options that help leaves out, once leave_out_rare() was called for their verb. (Those of
/// CLI11's own hidden group have no name in its errors.)
inline constexpr const char* rare_group = "Rare";
void leave_out_rare(CLI::App& verb);

}  // namespace octosurf
