#pragma once

#include <memory>
#include <string>

namespace octosurf {

class Api;

struct HttpPlace {
  std::string address = "127.0.0.1";  ///< an address of this machine
  unsigned short port = 0;            ///< 0: any that is free
  std::string token;                  ///< a client must send it; empty: every client is let in
};

/// Whether `address` is one that only this machine can reach.
bool is_loopback(const std::string& address);

/// Answers HTTP requests; GET and HEAD without a body, and POST of JSON to `clear_path`. For a few clients on
/// this machine or of one owner: a client that is slow keeps one of its threads, of which there are 64.
///
/// 1. A connection is closed after its answer. A request that is not HTTP is refused (4xx).
/// 2. With a token: "Authorization: Bearer TOKEN", or Basic with it as the password, so that browsers
///    prompt for it; else 401. Compared in constant time.
/// 3. On a loopback address, requests for other hosts are refused, as are those of another site's page
///    (Origin): otherwise any page could resolve its own name to this address (DNS rebinding).
/// 4. `live_path` is answered by server-sent events, at most five a second, to 32 clients, else 503. The next
///    event is made once the one before is sent: a slow client gets fewer and larger ones. Who takes nothing
///    for 5 s is dropped, and may come back with the revision it has.
/// 5. What Api throws is answered: Error(usage) 400, Error(data) 404, all else 500.
class HttpServer {
 public:
  /// Answers from now on, on threads that take no signals. `api` has to outlive this. Throws Error(usage) for
  /// an address that is none of this machine or a port that is taken.
  HttpServer(const HttpPlace& place, Api& api);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Answers that are being made are sent first, to clients that take them: no 5 s without a byte taken.
  ~HttpServer();

  std::string url() const;  ///< "http://127.0.0.1:8080/"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
