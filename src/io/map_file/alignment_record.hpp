#pragma once

#include "surfaces/alignment_state.hpp"

#include <optional>
#include <string>

namespace octosurf::map_file {
class Alignment;
class SeenPatches;
}  // namespace octosurf::map_file

namespace octosurf::io {

void write_alignment(const surfaces::AlignmentState& state, map_file::Alignment& record);

/// Inverse. Throws Error(data) unless every number is present, finite and valid.
surfaces::AlignmentState read_alignment(const map_file::Alignment& record, const std::string& where);

void write_patch(const surfaces::SeenPatches::Change& patch, map_file::SeenPatches& record);

/// Inverse, into `patches`, whose keys are all below the record's. Throws likewise.
void read_patches(const map_file::SeenPatches& record, const std::string& where,
                  surfaces::SeenPatches& patches, std::optional<surfaces::SeenPatches::Key>& last);

}  // namespace octosurf::io
