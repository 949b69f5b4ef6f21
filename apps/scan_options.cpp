#include "scan_options.hpp"

#include <CLI/CLI.hpp>

namespace octosurf {

void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range) {
  const char* const group = "Scans";
  verb.add_option("--poses", source.poses, "file with a pose per scan, or a stamped trajectory")
      ->group(group);
  verb.add_option("--intrinsics", source.intrinsics, "file with K (3x3) or fx fy cx cy")->group(group);
  verb.add_option("--depth-scale", source.depth_scale,
                  "units of a depth image per metre [5000 for TUM, else 1000]")
      ->group(group);
  verb.add_option("--rate", source.rate_hz, "scans per second if they have no time stamps [30, lidar 10]")
      ->group(group);
  verb.add_flag("--skip-bad", source.skip_bad,
                "go on without scans that cannot be read or have no rigid pose")
      ->group(group);
  verb.add_option("--skip", range.skip, "leave out so many scans at the start")->group(group);
  verb.add_option("--every", range.every, "take every K-th scan only")
      ->check(CLI::PositiveNumber)
      ->group(group);
  verb.add_option("--first", range.first, "take so many scans at most")
      ->check(CLI::PositiveNumber)
      ->group(group);
}

}  // namespace octosurf
