#pragma once

#include "serve/http_message.hpp"

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace octosurf {

class LiveFeed;

struct HttpPlace {
  std::string address = "127.0.0.1";  ///< an address of this machine
  unsigned short port = 0;            ///< 0: any that is free
  std::string token;                  ///< who asks must have it; empty: everybody may ask
};

/// What one client, or many, can take of the server at most.
struct HttpLimits {
  std::size_t header_bytes = 8 << 10, body_bytes = 64 << 10;
  std::size_t connections = 64;
  std::size_t live = 32;            ///< WebSockets, beside those
  std::size_t waiting = 64;         ///< requests that are being answered or wait for it
  std::size_t waiting_slow = 4;     ///< likewise of slow ones
  std::chrono::seconds arrive{20};  ///< for the next whole request, once the last one is answered
  std::chrono::seconds leave{30};   ///< for an answer to be taken
};

/// Answers HTTP requests.
///
/// 1. One thread reads and writes; two others answer, and one the slow questions, so that neither a plan
///    nor a client that is slow keeps others waiting.
/// 2. What is not HTTP, too large or unfinished within `arrive` is refused (4xx, the connection closed); what
///    is more than `waiting` gets 503. If there are too many connections, the one that has been silent
///    longest makes room.
/// 3. With a token: "Authorization: Bearer TOKEN", or Basic with it as the password, so that browsers ask for
///    it; else 401. Compared in constant time.
/// 4. On a loopback address, requests for other hosts are refused, or a page anywhere could ask by giving its
///    own name this address (DNS rebinding); as are those that another site's page makes (Origin).
/// 5. /live becomes a WebSocket that `live` is told over (live_session.hpp), to who may ask by 3 and 4; at
/// most `live` of
///    HttpLimits at a time, else 503.
/// 6. What `answer` throws is answered: Error(usage) 400, Error(data) 404, all else 500.
class HttpServer {
 public:
  using Answer = std::function<HttpReply(const HttpRequest&)>;
  using IsSlow = std::function<bool(const HttpRequest&)>;

  /// Listens from now on. Both are called from other threads, `answer` from several at a time. Throws
  /// Error(usage) for an address that is none of this machine or a port that is taken.
  HttpServer(const HttpPlace& place, Answer answer, IsSlow is_slow, std::shared_ptr<LiveFeed> live,
             const HttpLimits& limits = {});
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer();

  std::string url() const;  ///< "http://127.0.0.1:8080/"

  void end_on_signals();  ///< from now on SIGINT and SIGTERM do what stop() does; a second one ends at once
  void run();             ///< until stop(); waits for answers that are being made
  void stop();            ///< from any thread

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether `address` is one that only this machine can reach.
bool is_loopback(const std::string& address);

}  // namespace octosurf
