#pragma once

#include "serve/http_reply.hpp"

#include <optional>
#include <string>

namespace octosurf {

struct HttpPlace {
  std::string address = "127.0.0.1";  ///< an address of this machine
  unsigned short port = 0;            ///< 0: any that is free
  std::string token;                  ///< a client must send it; empty: every client is let in
};

/// Whether `address` is one that only this machine can reach.
bool is_loopback(const std::string& address);

/// The refusal, if a request with these fields is not let in at `place`.
std::optional<HttpReply> guard(const HttpPlace& place, const std::optional<std::string>& host,
                               const std::optional<std::string>& origin,
                               const std::optional<std::string>& authorization);

}  // namespace octosurf
