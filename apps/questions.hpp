#pragma once

#include "query_fields.hpp"

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace octosurf {

/// What may be asked of a map; each question has its part of it.
struct Request {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), corner = point, direction = point;
  double radius_m = 0;
  planning::ContactQuestion contact;  ///< its slope and surface are other questions', too
  Standing base;                      ///< of a patch
};

/// A question of `octosurf query`, whose flag takes what is required together. Where the map has no answer,
/// Error(data) is thrown.
struct Question {
  const char *flag, *takes, *summary;
  QuestionFields (*fields)(Request&);  ///< makes it the question that is asked
  nlohmann::ordered_json (*answer)(const planning::AskedMap&, const Request&);
  void (*print)(const planning::AskedMap&,
                const Request&) = nullptr;  ///< for readers; null: print_readable()
};
const std::vector<Question>& questions();

}  // namespace octosurf
