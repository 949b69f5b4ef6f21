#pragma once

#include "surfaces/alignment_state.hpp"

#include <string>

namespace octosurf {

namespace map_file {
class Alignment;
}

void write_alignment(const AlignmentState& state, map_file::Alignment& record);

/// Inverse. Throws Error(data) unless every number is there, finite and possible.
AlignmentState read_alignment(const map_file::Alignment& record, const std::string& where);

}  // namespace octosurf
