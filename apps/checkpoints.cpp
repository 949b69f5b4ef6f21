#include "checkpoints.hpp"

#include "last_line.hpp"

#include <cstdio>

namespace octosurf {

void Checkpoints::save(const Map& map, std::size_t scans, const KeptScans& kept) {
  save_map(map, stem_, kept);
  scans_ = scans;
  any_ = true;
  failing_ = false;
}

void Checkpoints::try_to_save(const Map& map, std::size_t scans, const KeptScans& kept) try {
  save(map, scans, kept);
} catch (const std::exception& error) {  // no space or no memory: the next one may succeed
  if (failing_) return;
  failing_ = true;
  LastLine line;
  line.add("warning: no checkpoint of %zu scans, %s; ", scans, reason_of(error));
  line.add_last_of(*this);
  line.add(", the run goes on");
  std::fprintf(stderr, "%s\n", line.what());
}

}  // namespace octosurf
