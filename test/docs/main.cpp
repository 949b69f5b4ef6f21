// Runs one of the programs that documents show: docs_cpp DOCUMENT:LINE.
#include "docs/programs.hpp"

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  const auto& programs = octosurf::docs::programs();
  const auto found = argc == 2 ? programs.find(argv[1]) : programs.end();
  if (found == programs.end()) {
    std::fprintf(stderr, "no such program; there are:\n");
    for (const auto& entry : programs) std::fprintf(stderr, "  %s\n", entry.first.c_str());
    return 2;
  }
  try {
    return found->second();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
