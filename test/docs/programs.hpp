#pragma once

#include <map>
#include <string>

namespace octosurf::docs {

using Main = int (*)();

/// The programs that documents show, by document and line.
inline std::map<std::string, Main>& programs() {
  static std::map<std::string, Main> all;
  return all;
}

/// Enters one of them.
struct Program {
  Program(const std::string& place, Main program) { programs()[place] = program; }
};

}  // namespace octosurf::docs
