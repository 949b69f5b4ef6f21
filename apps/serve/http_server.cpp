#include "serve/http_server.hpp"

#include "serve/api.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <exception>
#include <functional>
#include <httplib.h>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace octosurf {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr int most_threads = 64, most_followers = 32;
constexpr std::size_t largest_body = 4096;
constexpr auto event_interval = 200ms;  // pictures need no more, and the mapper has its processor
constexpr auto silence = 10s;           // of a stream, in which a proxy may take it for dead

HttpReply safe(const std::string& path, const std::function<HttpReply()>& make) {
  try {
    return make();
  } catch (const Error& error) {
    if (error.kind() == Error::Kind::usage) return refusal(400, error, error.where());
    return refusal(error.kind() == Error::Kind::data ? 404 : 500, error, error.where());
  } catch (const std::bad_alloc&) {
    return refusal(500, "out of memory", path, "request less at a time");
  } catch (const std::exception& error) {
    return refusal(500, error.what(), path, "");
  }
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The password of "Basic base64(user:password)"; empty if it is none.
std::string password_in(std::string_view base64) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  unsigned bits = 0, count = 0;
  for (const char c : base64) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string_view::npos) break;  // padding
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    text += static_cast<char>(bits >> count & 0xff);
  }
  const std::size_t colon = text.find(':');
  return colon == std::string::npos ? std::string() : text.substr(colon + 1);
}

/// The name in a Host field, without its port and brackets.
std::string host_name(const std::string& host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') - 1);
  return lower(host.substr(0, host.find(':')));
}

bool same_in_constant_time(const std::string& given, const std::string& expected) {
  // Volatile, so that no compiler ends the loop at the first difference. As many rounds as `given` is long,
  // which its sender knows already.
  volatile unsigned difference = given.size() == expected.size() ? 0 : 1;
  for (std::size_t i = 0; i < given.size(); ++i)
    difference = difference | static_cast<unsigned>(given[i] ^ expected[i % (expected.size() + 1)]);
  return difference == 0;
}

bool has_token(const std::string& authorization, const std::string& token) {
  const std::size_t blank = authorization.find(' ');
  if (blank == std::string::npos) return false;
  const std::string scheme = lower(authorization.substr(0, blank)), rest = authorization.substr(blank + 1);
  if (scheme == "bearer") return same_in_constant_time(rest, token);
  return scheme == "basic" && same_in_constant_time(password_in(rest), token);
}

std::optional<std::string> field(const httplib::Request& request, const char* name) {
  if (!request.has_header(name)) return std::nullopt;
  return request.get_header_value(name);
}

/// The refusal, if the request is not let in at `place`.
std::optional<HttpReply> guard(const HttpPlace& place, const httplib::Request& request) {
  const std::optional<std::string> host = field(request, "Host"), origin = field(request, "Origin");
  if (!host) return refusal(400, "the request names no host", "Host", "send HTTP/1.1 with a Host field");
  if (is_loopback(place.address)) {
    const std::string name = host_name(*host);
    if (name != "localhost" && !is_loopback(name))
      return refusal(421, "this server is of this machine alone, not '" + name + "'", "Host",
                     "use 127.0.0.1 or localhost");
  }
  if (origin && *origin != "http://" + *host && *origin != "https://" + *host)
    return refusal(403, "another site's page has no access", "Origin", "use this server's page");
  if (!place.token.empty() && !has_token(request.get_header_value("Authorization"), place.token))
    return refusal(401, "the token is missing or wrong", "Authorization",
                   "send 'Authorization: Bearer TOKEN', or the token as the password");
  return std::nullopt;
}

void set_fields(httplib::Response& response) {
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_header("X-Frame-Options", "DENY");
}

void set_reply(httplib::Response& response, const HttpReply& reply) {
  response.status = reply.status;
  set_fields(response);
  if (reply.status == 401)
    response.set_header("WWW-Authenticate", R"(Bearer, Basic realm="octosurf: any user, the token")");
  if (reply.status == 503) response.set_header("Retry-After", "1");
  response.set_content(*reply.body, reply.type);
}

/// Only what the library refuses by itself has no reply yet.
void set_refusal(const httplib::Request&, httplib::Response& response) {
  if (!response.has_header("X-Frame-Options"))
    set_reply(response, refusal(response.status, "no HTTP request, or too long a one", "request",
                                "send HTTP/1.1, no line of more than 8 KB and no body of more than 4"));
}

/// The threads that are made in its scope take no signals, which are for the main thread.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

/// Threads that answer, each made when it is needed: where there are no more to be had, those that there are.
class Workers : public httplib::TaskQueue {
 public:
  explicit Workers(std::size_t most) : most_(most) {}

  void enqueue(std::function<void()> answer) override {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(answer));
    if (idle_ < waiting_.size() && threads_.size() < most_) add_thread();
    ready_.notify_one();
  }
  void shutdown() override {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    ready_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  void add_thread() {
    try {
      const SignalsBlocked blocked;
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      if (threads_.empty()) throw;
    }
  }
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      ++idle_;
      ready_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
      --idle_;
      if (waiting_.empty()) return;
      const std::function<void()> answer = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      answer();
      lock.lock();
    }
  }

  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::function<void()>> waiting_;
  std::size_t idle_ = 0;
  bool ended_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace

bool is_loopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  return ::inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6) != 0;
}

struct HttpServer::Impl {
  Impl(const HttpPlace& where, Api& api_) : place(where), api(api_) {
    http.new_task_queue = [] { return new Workers(most_threads); };
    http.set_keep_alive_max_count(1);
    http.set_keep_alive_timeout(1);  // s that a silent connection keeps a thread
    http.set_tcp_nodelay(true);
    http.set_socket_options([](socket_t socket) {  // the library's own would share a port that is taken
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http.set_payload_max_length(largest_body);
    http.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      using Routing = httplib::Server::HandlerResponse;
      return answered(request, response) ? Routing::Handled : Routing::Unhandled;
    });
    http.Post(clear_path, [this](const httplib::Request& request, httplib::Response& response) {
      set_reply(response, safe(clear_path, [&] { return api.clear(request.body); }));
    });
    http.set_error_handler(httplib::Server::Handler(set_refusal));
    errno = 0;
    if (place.port == 0)
      port = http.bind_to_any_port(place.address);
    else
      port = http.bind_to_port(place.address, place.port) ? place.port : -1;
    if (port < 0)
      throw Error(Error::Kind::usage, place.address + " port " + std::to_string(place.port),
                  std::string("cannot be listened on") + (errno != 0 ? ": " : "") +
                      (errno != 0 ? std::strerror(errno) : ""),
                  "give an address of this machine and a port that is free, or port 0");
    const SignalsBlocked blocked;
    listening = std::thread([this] { listen(); });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    // The library forgets a stop that comes before it listens.
    while (!http.is_running() && !ended) std::this_thread::sleep_for(1ms);
    stopping = true;
    http.stop();
    listening.join();
  }

  void listen() {
    try {
      if (!http.listen_after_bind() && !stopping)
        std::fprintf(stderr, "warning: the map is served no longer: no connection can be taken\n");
    } catch (const std::exception& error) {  // no thread left, say: the map is worth more than its page
      std::fprintf(stderr, "warning: the map is served no longer: %s\n", error.what());
    }
    ended = true;
  }

  /// Whether it is answered: what is posted has its body read first.
  bool answered(const httplib::Request& request, httplib::Response& response) {
    // Answers are sent whole, and as they are: parts that overlap may take more memory than there is, and the
    // library's packing more time than the answer.
    auto& changed = const_cast<httplib::Request&>(request);
    changed.ranges.clear();
    changed.headers.erase("Accept-Encoding");
    changed.headers.erase("Content-Encoding");
    const std::string& path = request.path;
    if (const auto refused = refusal_of(request)) {
      set_reply(response, *refused);
      if (refused->status == 405) response.set_header("Allow", path == clear_path ? "POST" : "GET, HEAD");
      return true;
    }
    if (path == clear_path) return false;
    if (path == live_path)
      follow(request, response);
    else
      set_reply(response, safe(path, [&] { return api.answer(path, request.params); }));
    return true;
  }

  std::optional<HttpReply> refusal_of(const httplib::Request& request) const {
    if (auto refused = guard(place, request)) return refused;
    const bool posted = request.path == clear_path;
    if (posted ? request.method != "POST" : request.method != "GET" && request.method != "HEAD")
      return refusal(405, "this method is not supported", request.path, posted ? "use POST" : "use GET");
    const std::optional<std::string> length = field(request, "Content-Length");
    if (posted) {
      // Another site's page can send other types without asking first.
      if (lower(request.get_header_value("Content-Type")).rfind("application/json", 0) != 0)
        return refusal(415, "is not said to be JSON", "body", "send 'Content-Type: application/json'");
      if (request.has_header("Transfer-Encoding") || !length)
        return refusal(411, "has no length", "body", "send Content-Length");
    } else if (request.has_header("Transfer-Encoding") || length.value_or("0") != "0") {
      return refusal(413, "a question has no body", "body", "put the parameters into the URL's query");
    }
    return std::nullopt;
  }

  void follow(const httplib::Request& request, httplib::Response& response) {
    Follower follower;
    const HttpReply checked = safe(live_path, [&] {
      follower = api.follower(request.params);
      return reply_of("\n");
    });
    if (checked.status != 200 || request.method == "HEAD") return set_reply(response, checked);
    if (followers++ >= most_followers) {
      --followers;
      return set_reply(response, refusal(503, "too many follow the map", live_path, "try again"));
    }
    set_fields(response);
    response.status = 200;
    response.set_content_provider(
        "text/event-stream",
        [this, follower, last = Clock::now()](std::size_t, httplib::DataSink& sink) mutable {
          HttpReply next = safe(live_path, [&] { return HttpReply{200, {}, api.next_event(follower)}; });
          if (next.status != 200) return false;
          if (!next.body && Clock::now() - last > silence) next.body = std::make_shared<std::string>(":\n\n");
          if (next.body) {
            if (!sink.write(next.body->data(), next.body->size())) return false;
            last = Clock::now();
          }
          std::this_thread::sleep_for(event_interval);
          return sink.is_writable();
        },
        [this](bool) { --followers; });
  }

  const HttpPlace place;
  Api& api;
  httplib::Server http;
  int port = -1;
  std::atomic<int> followers = 0;
  std::atomic<bool> stopping = false, ended = false;
  std::thread listening;
};

HttpServer::HttpServer(const HttpPlace& place, Api& api) : impl_(std::make_unique<Impl>(place, api)) {}

HttpServer::~HttpServer() = default;

std::string HttpServer::url() const {
  const std::string& address = impl_->place.address;
  const bool v6 = address.find(':') != std::string::npos;
  return "http://" + (v6 ? "[" + address + "]" : address) + ":" + std::to_string(impl_->port) + "/";
}

}  // namespace octosurf
