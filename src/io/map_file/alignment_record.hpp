#pragma once

#include "surfaces/alignment_state.hpp"

#include <string>

namespace octosurf::map_file {
class Alignment;
}  // namespace octosurf::map_file

namespace octosurf::io {

void write_alignment(const surfaces::AlignmentState& state, map_file::Alignment& record);

/// Inverse. Throws Error(data) unless every number is there, finite and possible.
surfaces::AlignmentState read_alignment(const map_file::Alignment& record, const std::string& where);

}  // namespace octosurf::io
