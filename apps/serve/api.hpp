#pragma once

#include "serve/served_map.hpp"

#include <functional>
#include <map>
#include <memory>
#include <string>

#include <octosurf/error.hpp>

// What `octosurf serve` answers: the page, and what it asks. For any thread.

namespace octosurf {

struct HttpReply {
  int status = 200;
  std::string type;
  std::shared_ptr<const std::string> body;  ///< shared, because pages are large and requested often
};

/// {"error": `what`, "where": …, "hint": …}
HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& hint);
/// Likewise; `where` in the place of the error's own.
HttpReply refusal(int status, const Error& error, const std::string& where);

/// The query of a request's URL, decoded.
using QueryParameters = std::multimap<std::string, std::string>;

/// Throws Error(usage), naming the parameter, for questions that make no sense, Error(data) where the map
/// has no answer.
HttpReply answer_to(const ServedMap& map, const std::string& path, const QueryParameters& given);

/// The map as it is now.
using LatestMap = std::function<std::shared_ptr<const ServedMap>()>;

}  // namespace octosurf
