#include "support/paths.hpp"

namespace octosurf::test::paths {

std::string source() { return OCTOSURF_SOURCE_DIR; }
std::string data() { return OCTOSURF_SOURCE_DIR "/../shared/data"; }
std::string command() { return OCTOSURF_COMMAND; }
std::string lab() { return OCTOSURF_COMMAND "-lab"; }

}  // namespace octosurf::test::paths
