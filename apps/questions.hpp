#pragma once

#include "planning/questions.hpp"

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace octosurf {

/// Numbers and options of a question.
struct Request {
  std::vector<double> numbers;        ///< after the question's flag, as many as it takes
  planning::ContactQuestion contact;  ///< other questions use its slope, too
};

/// A question of `octosurf query`. Where the map has no answer, Error(data) is thrown.
struct Question {
  const char *flag, *takes, *summary;
  int numbers;
  nlohmann::ordered_json (*answer)(const planning::AskedMap&, const Request&);
  void (*print)(const planning::AskedMap&,
                const Request&) = nullptr;  ///< for readers; null: print_readable()
};
const std::vector<Question>& questions();

}  // namespace octosurf
