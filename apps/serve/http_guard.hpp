#pragma once

#include "serve/http_server.hpp"

#include <optional>
#include <string>

namespace octosurf {

/// Says who may ask.
class HttpGuard {
 public:
  explicit HttpGuard(const HttpPlace& place);

  /// What to answer, by these fields of the request, if it is not to be let in.
  std::optional<HttpReply> refuses(const std::optional<std::string>& host,
                                   const std::optional<std::string>& origin,
                                   const std::optional<std::string>& authorization) const;

 private:
  bool has_token(const std::string& authorization) const;

  bool loopback_;
  std::string token_;
};

/// The name in a Host field, without its port and brackets.
std::string host_name(const std::string& host);

/// Takes as long wherever the two differ.
bool same_in_constant_time(const std::string& given, const std::string& expected);

}  // namespace octosurf
