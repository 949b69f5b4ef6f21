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

/// The fields of a request that decide whether it is let in.
struct HttpCredentials {
  std::optional<std::string> host, origin, authorization;
};

/// The refusal, if the request is not let in at `place`.
std::optional<HttpReply> guard(const HttpPlace& place, const HttpCredentials& given);

}  // namespace octosurf
