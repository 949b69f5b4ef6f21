#pragma once

#include "io/readers/scan_list.hpp"

namespace octosurf::io {

/// Stamps from times.txt, depth.txt, or the files' names, in seconds; none if there are none. Throws
/// Error(data).
void find_stamps(ListedRecording& recording);

}  // namespace octosurf::io
