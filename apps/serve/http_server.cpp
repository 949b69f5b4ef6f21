// HTTP by cpp-httplib, which reads the head of a request and writes its answer. Sockets, deadlines and how
// many connections there are is settled here: the library knows no limit of a whole request or of
// connections.
#include "serve/http_server.hpp"

#include "serve/api.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <httplib.h>
#include <list>
#include <mutex>
#include <netdb.h>
#include <new>
#include <optional>
#include <poll.h>
#include <semaphore.h>
#include <sys/eventfd.h>
#include <thread>
#include <utility>

namespace octosurf {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::size_t most_head = 8 << 10, most_connections = 64, most_followers = 32;
constexpr int most_slow = 4;
constexpr auto arrive = 20s, leave = 30s, drain = 2s;
constexpr auto event_interval = 200ms;  // pictures need no more, and the mapper has its processor
constexpr auto silence = 10s;           // of a stream, in which a proxy may take it for dead

/// Waits until so many events of poll() or the deadline.
bool ready(int socket, short events, Clock::time_point deadline) {
  pollfd one{socket, events, 0};
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  return left.count() > 0 && ::poll(&one, 1, static_cast<int>(left.count())) > 0;
}

/// A connection as the library sees it: the head of one request, and what takes the answer.
class Line final : public httplib::Stream {
 public:
  explicit Line(int socket) : socket_(socket) {}
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() override { ::close(socket_); }

  enum class Arrived { whole, never, too_large };
  Arrived wait_for_head() {
    const auto deadline = Clock::now() + arrive;
    for (;;) {
      const std::size_t end = bytes_.find("\r\n\r\n");
      if (end < most_head) {
        head_ = bytes_.substr(0, end + 4);
        bytes_.erase(0, end + 4);
        taken_ = 0;
        return Arrived::whole;
      }
      if (bytes_.size() >= most_head) return Arrived::too_large;
      if (!receive(deadline)) return Arrived::never;
    }
  }

  ssize_t read(char* to, std::size_t size) override {
    const std::size_t count = head_.copy(to, size, taken_);
    taken_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, std::size_t size) override {
    const auto deadline = Clock::now() + leave;
    for (std::size_t sent = 0; sent < size;) {
      const ssize_t count = ::send(socket_, from + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0 && errno != EINTR && (errno != EAGAIN || !ready(socket_, POLLOUT, deadline))) return -1;
      if (count > 0) sent += static_cast<std::size_t>(count);
    }
    return static_cast<ssize_t>(size);
  }
  bool is_readable() const override { return taken_ < head_.size(); }
  /// A follower that sends no more is gone; others may still wait for their answer.
  bool is_writable() const override {
    pollfd one{socket_, static_cast<short>(follows ? POLLRDHUP : 0), 0};
    return ::poll(&one, 1, 0) == 0;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const {}  // the library's in all but its oldest versions
  socket_t socket() const override { return socket_; }

  void refuse(const HttpReply& reply) {
    const std::string text = "HTTP/1.1 " + std::to_string(reply.status) +
                             " Refused\r\nContent-Type: " + reply.type +
                             "\r\nContent-Length: " + std::to_string(reply.body->size()) +
                             "\r\nConnection: close\r\n\r\n" + *reply.body;
    write(text.data(), text.size());
  }

  /// Says that this was all, and takes what still comes for a while: closed with unread bytes, the connection
  /// would be reset, and the last answer lost with it.
  void end() {
    ::shutdown(socket_, SHUT_WR);
    const auto deadline = Clock::now() + drain;
    for (std::size_t taken = 0; taken < 1 << 20; taken += bytes_.size()) {
      bytes_.clear();
      if (!receive(deadline)) return;
    }
  }

  bool silent = true;  ///< waits for a request, and not for its end
  bool follows = false;

 private:
  bool receive(Clock::time_point deadline) {
    char piece[4096];
    if (!ready(socket_, POLLIN, deadline)) return false;
    const ssize_t count = ::recv(socket_, piece, sizeof piece, 0);
    if (count > 0) bytes_.append(piece, static_cast<std::size_t>(count));
    return count > 0;
  }

  const int socket_;
  std::string bytes_, head_;  ///< received after the head; the head
  std::size_t taken_ = 0;     ///< of the head
};

/// Lets so many threads at a time through. Not std::counting_semaphore, which may sleep on (GCC bug 104928).
class Gate {
 public:
  explicit Gate(unsigned most) { ::sem_init(&free_, 0, most); }
  HttpReply through(const std::function<HttpReply()>& make) {
    while (::sem_wait(&free_) != 0) continue;  // a signal
    HttpReply reply = make();
    ::sem_post(&free_);
    return reply;
  }

 private:
  sem_t free_{};
};

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

std::optional<std::string> field(const httplib::Request& request, const char* name) {
  if (!request.has_header(name)) return std::nullopt;
  return request.get_header_value(name);
}

void set_fields(httplib::Response& response) {
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_header("X-Frame-Options", "DENY");
}

void set_reply(httplib::Response& response, const HttpReply& reply) {
  response.status = reply.status;
  set_fields(response);
  if (reply.status == 405) response.set_header("Allow", "GET, HEAD");
  if (reply.status == 401)
    response.set_header("WWW-Authenticate", R"(Bearer, Basic realm="octosurf: any user, the token")");
  if (reply.status == 503) response.set_header("Retry-After", "1");
  response.set_content_provider(
      reply.body->size(), reply.type.c_str(),
      [body = reply.body](std::size_t at, std::size_t size, httplib::DataSink& sink) {
        return sink.write(body->data() + at, size), true;
      });
}

/// The library's reading and writing of one request, which it keeps for its own servers.
class Http : public httplib::Server {
 public:
  Http() = default;

  /// `look` at the request before it is answered.
  template <typename Stream>
  void process(Stream& stream, const std::function<void(httplib::Request&)>& look) {
    bool closed = false;
    if constexpr (requires { this->process_request(stream, false, closed, look); })
      this->process_request(stream, false, closed, look);
    else
      this->process_request(stream, {}, 0, {}, 0, false, closed, look);
  }
  void set_listener(int socket) { svr_sock_ = socket; }  // the library ends answers without one
};

std::atomic<int> signalled_fd = -1;  ///< who is to know of signals

int listener(const HttpPlace& place) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_PASSIVE;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  std::string why = "not an address in digits";
  if (::getaddrinfo(place.address.c_str(), std::to_string(place.port).c_str(), &hints, &found) == 0) {
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
    const int socket = ::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0), yes = 1;
    if (socket >= 0 && ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
        ::bind(socket, found->ai_addr, found->ai_addrlen) == 0 && ::listen(socket, SOMAXCONN) == 0)
      return socket;
    why = std::strerror(errno);
    if (socket >= 0) ::close(socket);
  }
  throw Error(Error::Kind::usage, place.address + " port " + std::to_string(place.port),
              "cannot be listened on: " + why,
              "give an address of this machine and a port that is free, or port 0");
}

}  // namespace

struct HttpServer::Impl {
  Impl(const HttpPlace& where, Api& api_) : place(where), api(api_), listening(listener(where)) {
    http.set_keep_alive_timeout(arrive.count());
    http.set_keep_alive_max_count(1000);
    http.set_listener(listening);
    http.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      answer(request, response);
      return httplib::Server::HandlerResponse::Handled;
    });
    // Only what the library refuses by itself has no reply yet.
    const httplib::Server::Handler handle_error = [](const httplib::Request&, httplib::Response& response) {
      if (!response.has_header("X-Frame-Options"))
        set_reply(response, refusal(response.status, "no HTTP request", "request", "send HTTP/1.1"));
    };
    http.set_error_handler(handle_error);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    ::close(listening);
    ::close(stopped);
  }

  void answer(const httplib::Request& request, httplib::Response& response) {
    const std::string& path = request.path;
    if (const auto refused =
            guard(place, {field(request, "Host"), field(request, "Origin"), field(request, "Authorization")}))
      return set_reply(response, *refused);
    if (request.method != "GET" && request.method != "HEAD")
      return set_reply(response, refusal(405, "this method is not supported", path, "use GET"));
    if (has_body(request))
      return set_reply(response, refusal(413, "a question has no body", "body",
                                         "put the parameters into the URL's query"));
    if (path == live_path) return follow(request, response);
    const auto make = [&] { return safe(path, [&] { return api.answer(path, request.params); }); };
    if (!Api::is_slow(path)) return set_reply(response, quick.through(make));
    const bool full = waiting_slow++ >= most_slow;
    set_reply(response,
              full ? refusal(503, "too many questions at a time", path, "try again") : slow.through(make));
    --waiting_slow;
  }

  static bool has_body(const httplib::Request& request) {
    return request.has_header("Transfer-Encoding") || field(request, "Content-Length").value_or("0") != "0";
  }

  void follow(const httplib::Request& request, httplib::Response& response) {
    Follower follower;
    const HttpReply checked = safe(live_path, [&] {
      follower = api.follower(request.params);
      return HttpReply{};
    });
    if (checked.status != 200) return set_reply(response, checked);
    if (request.method == "HEAD") return set_reply(response, reply_of("\n"));
    if (followers++ >= most_followers) {
      --followers;
      return set_reply(response, refusal(503, "too many follow the map", live_path, "try again"));
    }
    set_fields(response);
    response.status = 200;
    response.set_content_provider(
        "text/event-stream",
        [this, follower, last = Clock::now()](std::size_t, httplib::DataSink& sink) mutable {
          HttpReply next = quick.through([&] {
            return safe(live_path, [&] { return HttpReply{200, {}, api.next_event(follower)}; });
          });
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

  void serve(std::list<Line>::iterator line) {
    for (bool last = false; !last;) {
      const Line::Arrived arrived = line->wait_for_head();
      {
        const std::lock_guard lock(mutex);
        if (!line->silent) break;  // it has had to make room
        line->silent = false;
      }
      if (arrived == Line::Arrived::never) break;
      if (arrived == Line::Arrived::too_large) {
        line->refuse(
            refusal(431, "the request's head is too large", "header", "send fewer or shorter fields"));
        break;
      }
      last = true;  // unless it is a request
      http.process(*line, [&](httplib::Request& request) {
        line->follows = request.path == live_path;
        last = line->follows || has_body(request) || field(request, "Connection") == "close" ||
               request.version != "HTTP/1.1";
        request.ranges.clear();  // of which a few would be more than the memory
        for (const char* unwanted : {"Accept-Encoding", "Expect"}) request.headers.erase(unwanted);
        if (last) request.headers.emplace("Connection", "close");
      });
      const std::lock_guard lock(mutex);
      line->silent = true;
      lines.splice(lines.end(), lines, line);
    }
    line->end();
    const std::lock_guard lock(mutex);
    lines.erase(line);
    gone.notify_all();
  }

  void accept(int socket) {
    std::unique_lock lock(mutex);
    const auto full = [this] { return lines.size() >= most_connections + followers; };
    const auto longest =
        std::find_if(lines.begin(), lines.end(), [](const Line& line) { return line.silent; });
    if (full() && longest != lines.end()) {
      longest->silent = false;
      ::shutdown(longest->socket(), SHUT_RDWR);
      gone.wait_for(lock, 1s, [&] { return !full(); });
    }
    const bool room = !full();
    const auto line = lines.emplace(lines.end(), socket);
    try {
      if (room) return std::thread([this, line] { serve(line); }).detach();
    } catch (const std::system_error&) {  // no thread left
    }
    line->refuse(refusal(503, "too many connections", "server", "try again"));
    lines.erase(line);
  }

  const HttpPlace place;
  Api& api;
  const int listening, stopped = ::eventfd(0, EFD_CLOEXEC);
  Http http;
  Gate quick{2}, slow{1};
  std::atomic<int> waiting_slow = 0;
  std::atomic<std::size_t> followers = 0;
  std::mutex mutex;
  std::condition_variable gone;  ///< a line
  std::list<Line> lines;         ///< the silent ones in the order in which they became so
};

HttpServer::HttpServer(const HttpPlace& place, Api& api) : impl_(std::make_unique<Impl>(place, api)) {}

HttpServer::~HttpServer() = default;

std::string HttpServer::url() const {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  char host[NI_MAXHOST], port[NI_MAXSERV];
  auto* address = reinterpret_cast<sockaddr*>(&bound);
  ::getsockname(impl_->listening, address, &size);
  ::getnameinfo(address, size, host, sizeof host, port, sizeof port, NI_NUMERICHOST | NI_NUMERICSERV);
  const std::string name = host;
  return "http://" + (bound.ss_family == AF_INET6 ? "[" + name + "]" : name) + ":" + port + "/";
}

void HttpServer::end_on_signals() {
  signalled_fd = impl_->stopped;
  struct sigaction action {};
  action.sa_handler = [](int) { ::eventfd_write(signalled_fd, 1); };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int number : {SIGINT, SIGTERM}) ::sigaction(number, &action, nullptr);
}

void HttpServer::run() {
  for (;;) {
    std::array<pollfd, 2> either{{{impl_->listening, POLLIN, 0}, {impl_->stopped, POLLIN, 0}}};
    if (::poll(either.data(), either.size(), -1) < 0) continue;  // a signal
    if (either[1].revents != 0) break;
    const int socket = ::accept4(impl_->listening, nullptr, nullptr, SOCK_CLOEXEC), yes = 1;
    if (socket < 0) {  // no file descriptors left, say: later
      std::this_thread::sleep_for(100ms);
      continue;
    }
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    impl_->accept(socket);
  }
  std::unique_lock lock(impl_->mutex);
  const auto all_gone = [this] { return impl_->lines.empty(); };
  // No more requests; answers that are being made are sent first. Followers end at their next event.
  for (const Line& line : impl_->lines) ::shutdown(line.socket(), SHUT_RD);
  if (impl_->gone.wait_for(lock, drain, all_gone)) return;
  for (const Line& line : impl_->lines) ::shutdown(line.socket(), SHUT_RDWR);
  impl_->gone.wait(lock, all_gone);
}

void HttpServer::stop() { ::eventfd_write(impl_->stopped, 1); }

}  // namespace octosurf
