#pragma once

#include <memory>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf {

struct HttpReply {
  int status = 200;
  std::string type = "application/json";
  std::shared_ptr<const std::string> body;  ///< shared, because pages are large and requested often
};

HttpReply reply_of(std::string body);

/// {"error": `what`, "where": …, "hint": …}
HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& hint);
/// Likewise; `where` in the place of the error's own.
HttpReply refusal(int status, const Error& error, const std::string& where);

}  // namespace octosurf
