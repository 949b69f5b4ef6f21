#pragma once

#include "check/meaning.hpp"
#include "judgement/common_error.hpp"

#include <functional>
#include <string>
#include <vector>

namespace octosurf::check {

/// One thing that recordings were found to mean.
struct Row {
  /// Meanings that differ from this one by it.
  std::vector<Meaning> (*alternatives)(const Recording&, const Meaning&);
  /// What it says of a recording.
  std::function<std::string(const Recording&, const Meaning&)> words;
  /// Ones for the numbers to fit, from each alternative on.
  judgement::CommonParameters fitted = judgement::CommonParameters::Zero();
};

const std::vector<Row>& rows();
inline constexpr std::size_t row_of_forms = 2, row_of_scales = 3;

/// Of the row of forms, those that are often met: of a wrong scale, too, which hides them.
std::vector<Meaning> common_forms();

/// Readings and poses of one scale may both be off: which is, as far as units and sensors tell.
void settle_scale(const Recording& recording, Meaning& meaning);

}  // namespace octosurf::check
