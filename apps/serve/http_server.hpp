#pragma once

#include "serve/http_guard.hpp"

#include <memory>
#include <string>

namespace octosurf {

class Api;

/// Answers HTTP requests; GET and HEAD only, without a body.
///
/// 1. A thread for each connection, of which two at a time make answers, and one a slow one (at most four
///    wait), so that neither a plan nor a client that is slow keeps others waiting.
/// 2. A request that is not HTTP, or has a head of more than 8 KB or a body, is refused (4xx, the connection
///    closed); a head has to arrive within 20 s, an answer to leave within 30. Of more than 64 connections,
///    the one that has been silent longest makes room; if none is silent, the next gets 503.
/// 3. With a token: "Authorization: Bearer TOKEN", or Basic with it as the password, so that browsers
///    prompt for it; else 401. Compared in constant time.
/// 4. On a loopback address, requests for other hosts are refused, as are those of another site's page
///    (Origin): otherwise any page could resolve its own name to this address (DNS rebinding).
/// 5. `live_path` is answered by server-sent events, at most five a second, to 32 clients beside the
///    connections, else 503. The next event is made once the one before is sent: who is slow gets fewer and
///    larger ones. Who does not take one within 30 s is dropped, and may come back with the revision it has.
/// 6. What Api throws is answered: Error(usage) 400, Error(data) 404, all else 500.
class HttpServer {
 public:
  /// Listens from now on. `api` has to outlive this. Throws Error(usage) for an address that is none of this
  /// machine or a port that is taken.
  HttpServer(const HttpPlace& place, Api& api);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer();

  std::string url() const;  ///< "http://127.0.0.1:8080/"

  void end_on_signals();  ///< from now on SIGINT and SIGTERM do what stop() does; a second one ends at once
  void run();             ///< until stop(); then answers that are being made have 2 s to be sent
  void stop();            ///< from any thread

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
