#pragma once

#include "check/meaning.hpp"
#include "check/views.hpp"

#include <optional>
#include <string>
#include <vector>

namespace octosurf::check {

/// What was found of a recording whose scans contradict each other.
struct Finding {
  Judgement as_given;
  std::optional<Meaning> meaning;  ///< by which it agrees; empty: it agrees as given, or no cause is known
  Judgement as_meant;
  std::vector<std::string> causes;  ///< what that meaning changes, one line each
  /// Hardly a pair contradicts, and what makes them agree was fitted: poses that drift a little look the
  /// same.
  bool or_drift = false;
};

/// Whether views have enough in common that they would contradict each other if they were wrong.
bool sees_enough(const Judgement& judgement);

/// Tries what recordings were found to mean, each by itself, then two together. Some ten seconds.
Finding search(const Recording& recording, int threads);

}  // namespace octosurf::check
