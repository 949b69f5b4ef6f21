#pragma once

#include <memory>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf {

/// A request that has arrived whole and may be answered.
struct HttpRequest {
  std::string method, path, query;  ///< of "/a/b?c=1": "/a/b" and "c=1", as they were sent
  std::string type;                 ///< Content-Type
  std::string body;
};

struct HttpReply {
  int status = 200;
  std::string type = "application/json";
  std::shared_ptr<const std::string> body;  ///< shared, because pages are large and asked for often
  std::string allow{};                      ///< with 405: the methods that are allowed
};

HttpReply reply_of(std::string body, std::string type = "application/json");

/// {"error": `what`, "where": …, "mend": …}
HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& mend);
/// Likewise; `where` in the place of the error's own.
HttpReply refusal(int status, const Error& error, const std::string& where);

}  // namespace octosurf
