#pragma once

#include "io/readers/scan_list.hpp"

namespace octosurf::io {

/// Poses beside the scans, if the scans need any.
void find_poses(ListedRecording& recording, const ScanSourceOptions& options,
                std::vector<std::string>& notes);

/// Assigns the poses of one file: by time if both sides have it, else by order.
void pose_all(const std::vector<ListedRecording*>& recordings, PoseFile poses,
              const ScanSourceOptions& options, std::vector<std::string>& notes);

/// Files called like the scans, with one pose each (ScanNet's pose/12.txt for depth/12.png). False if there
/// is none for the first.
bool take_poses_in(const std::filesystem::path& folder, ListedRecording& recording,
                   std::vector<std::string>& notes);

/// Scans without a pose at their time are left out, as in TUM's own tools, but reported.
void leave_out_unposed(ScanList& list);

}  // namespace octosurf::io
