#pragma once

#include "serve/api.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace octosurf {

/// Answers GET and HEAD requests of this machine.
/// 1. A request has 5 s to arrive, of 8 KB at most and without a body; its answer has a minute to be sent.
///    Slow clients take no thread.
/// 2. At most 256 clients; others get 503. Each answer closes its connection.
/// 3. Requests for other hosts are refused, as are those of another site's page (against DNS rebinding).
/// 4. What is thrown is answered: Error(usage) 400, Error(data) 404, all else 500. Without memory for a
///    client it is dropped.
class HttpServer {
 public:
  /// Answers from now on, in threads of its own. Throws Error(usage) for a port that is taken.
  HttpServer(std::uint16_t port, LatestMap map);  ///< 0: any port that is free
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Interrupts what is being made (geometry::interruption), and gives clients a second to take their
  /// answers.
  ~HttpServer();

  std::string url() const;  ///< "http://127.0.0.1:8080/"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
