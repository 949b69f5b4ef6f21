#pragma once

#include <string>

/// Where this checkout and what was built of it are, absolute. Compiled in one file, so that the objects of
/// the tests themselves are the same in every checkout (ccache).
namespace octosurf::test::paths {

std::string source();   ///< The checkout.
std::string data();     ///< Recordings beside it; may not exist.
std::string command();  ///< The program `octosurf`.
std::string lab();      ///< The program `octosurf-lab`.

}  // namespace octosurf::test::paths
