#pragma once

#include "query_fields.hpp"
#include "serve/served_map.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace octosurf {

/// What may be asked of a map; each question has its part of it.
struct Request {
  planning::PlaceQuestion place;
  planning::ContactQuestion contact;  ///< its slope and surface are other questions', too
  Standing base;                      ///< of a patch
  std::optional<std::uint64_t> since;
  std::string run;
};

/// A question of `octosurf query`, of `octosurf serve`, or of both. The command's flag takes what is required
/// together. Where the map has no answer, Error(data) is thrown.
struct Question {
  const char *flag, *takes, *path, *summary;                  ///< empty: no flag, no URL
  QuestionFields (*fields)(Request&);                         ///< makes it the question that is asked
  std::string (*answer)(const ServedMap&, const Request&);    ///< JSON; null: of another type
  void (*print)(const ServedMap&, const Request&) = nullptr;  ///< for readers; null: print_readable()
};
const std::vector<Question>& questions();

constexpr const char* voxels_path = "/api/voxels";

}  // namespace octosurf
