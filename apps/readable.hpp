#pragma once

#include <nlohmann/json_fwd.hpp>

namespace octosurf {

/// Prints JSON for readers: a line for each field, with the unit of its name behind it ("area_m2": "area 1.28
/// m²"); a list of objects as a table, a list of lists as its length, a long object as lines below.
void print_readable(const nlohmann::ordered_json& answer);

/// Likewise, or as it is.
void print_answer(const nlohmann::ordered_json& answer, bool as_json);

}  // namespace octosurf
