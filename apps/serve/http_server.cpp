#include "serve/http_server.hpp"

#include "serve/http_guard.hpp"
#include "serve/live_session.hpp"
#include "serve/questions.hpp"

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/version.hpp>
#include <boost/beast/websocket.hpp>
#include <list>
#include <new>
#include <optional>
#include <utility>

namespace octosurf {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using Body = http::span_body<const char>;

std::string text(beast::string_view view) { return {view.data(), view.size()}; }

HttpReply refusal_of(const error_code& failure) {
  if (failure == http::error::body_limit)
    return refusal(413, "the request's body is too large", "body", "ask for less at a time");
  if (failure == http::error::header_limit || failure == http::error::buffer_overflow)
    return refusal(431, "the request's header is too large", "header", "send fewer or shorter fields");
  return refusal(400, "no HTTP request: " + failure.message(), "request", "send HTTP/1.1");
}

}  // namespace

struct HttpServer::Impl {
  class Session;

  Impl(const HttpPlace& where, Answer answer_, IsSlow is_slow_, std::shared_ptr<LiveFeed> live_,
       const HttpLimits& limits_)
      : place(where),
        limits(limits_),
        answer(std::move(answer_)),
        is_slow(std::move(is_slow_)),
        live(std::move(live_)),
        guard(where) {
    try {
      const tcp::endpoint endpoint(asio::ip::make_address(place.address), place.port);
      acceptor.open(endpoint.protocol());
      acceptor.set_option(asio::socket_base::reuse_address(true));
      acceptor.bind(endpoint);
      acceptor.listen();
    } catch (const boost::system::system_error& error) {
      throw Error(Error::Kind::usage, place.address + " port " + std::to_string(place.port),
                  "cannot be listened on: " + error.code().message(),
                  "give an address of this machine and a port that is free, or port 0");
    }
    accept();
  }

  void accept();
  void answer_in_time(const std::shared_ptr<Session>& session, HttpRequest request);

  HttpReply safe_answer(const HttpRequest& request) const {
    try {
      return answer(request);
    } catch (const Error& error) {
      if (error.kind() == Error::Kind::usage) return refusal(400, error, error.where());
      return refusal(error.kind() == Error::Kind::data ? 404 : 500, error, error.where());
    } catch (const std::bad_alloc&) {
      return refusal(500, "out of memory", request.path, "ask for less at a time");
    } catch (const std::exception& error) {
      return refusal(500, error.what(), request.path, "");
    }
  }

  const HttpPlace place;
  const HttpLimits limits;
  const Answer answer;
  const IsSlow is_slow;
  const std::shared_ptr<LiveFeed> live;
  const HttpGuard guard;
  // Of the thread that runs `io`; sessions, which end with it at the latest, have to do with them.
  std::size_t connections = 0, waiting = 0, waiting_slow = 0, live_sessions = 0;
  std::list<Session*> silent;  ///< those that wait for a request, longest first
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};
  asio::signal_set signals{io};
  asio::thread_pool workers{2}, slow_worker{1};
};

/// A connection: reads a request, has it answered, writes the answer, and so on.
class HttpServer::Impl::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Impl& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections;
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() { --server_.connections; }

  void read() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(server_.limits.header_bytes));
    parser_->body_limit(server_.limits.body_bytes);
    place_ = server_.silent.insert(server_.silent.end(), this);
    stream_.expires_after(server_.limits.arrive);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code failure, std::size_t) {
                       self->server_.silent.erase(self->place_);
                       self->stream_.expires_never();
                       self->arrived(failure);
                     });
  }

  void make_room() { stream_.close(); }

  void write(HttpReply reply) {
    reply_ = std::move(reply);
    response_.emplace(static_cast<http::status>(reply_.status), version_);
    response_->set(http::field::content_type, reply_.type);
    response_->set(http::field::cache_control, "no-store");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("X-Frame-Options", "DENY");
    if (!reply_.allow.empty()) response_->set(http::field::allow, reply_.allow);
    if (reply_.status == 401)
      response_->set(http::field::www_authenticate, R"(Bearer, Basic realm="octosurf: any user, the token")");
    if (reply_.status == 503) response_->set(http::field::retry_after, "1");
    response_->body() = {reply_.body->data(), reply_.body->size()};
    response_->prepare_payload();
    response_->keep_alive(keep_alive_);
    serializer_.emplace(*response_);
    stream_.expires_after(server_.limits.leave);
    const auto written = [self = shared_from_this()](error_code failure, std::size_t) {
      if (failure) return;
      self->keep_alive_ ? self->read() : self->end();
    };
    if (only_header_)
      http::async_write_header(stream_, *serializer_, written);
    else
      http::async_write(stream_, *serializer_, written);
  }

  void refuse(HttpReply reply) {
    keep_alive_ = false;
    write(std::move(reply));
  }

 private:
  void arrived(const error_code& failure) {
    // Who closes, is reset or too slow has nobody who would read an answer.
    if (failure == http::error::end_of_stream || failure == http::error::partial_message) return end();
    only_header_ = false;
    if (failure.category() == http::make_error_code(http::error::end_of_stream).category())
      return refuse(refusal_of(failure));
    if (failure) return;
    http::request<http::string_body> request = parser_->release();
    keep_alive_ = request.keep_alive();
    version_ = request.version();
    only_header_ = request.method() == http::verb::head;
    const auto value = [&](http::field name) -> std::optional<std::string> {
      const auto found = request.find(name);
      return found == request.end() ? std::nullopt : std::optional(text(found->value()));
    };
    if (auto refused = server_.guard.refuses(value(http::field::host), value(http::field::origin),
                                             value(http::field::authorization)))
      return write(std::move(*refused));
    const std::string target = text(request.target());
    const std::size_t mark = target.find('?');
    HttpRequest asked{text(request.method_string()),
                      target.substr(0, mark),
                      mark == std::string::npos ? std::string() : target.substr(mark + 1),
                      value(http::field::content_type).value_or(""),
                      {}};
    if (asked.path == live_question().path) return follow(request, asked);
    asked.body = std::move(request.body());
    server_.answer_in_time(shared_from_this(), std::move(asked));
  }

  /// Goes on as a WebSocket; this session ends.
  void follow(const http::request<http::string_body>& request, const HttpRequest& asked) {
    if (!beast::websocket::is_upgrade(request))
      return write(refusal(426, "this is a WebSocket", asked.path, "ask for an upgrade to one"));
    if (server_.live_sessions >= server_.limits.live)
      return refuse(refusal(503, "too many follow the map", asked.path, "try again"));
    try {
      const Values values(live_question(), asked);
      std::optional<std::uint64_t> known;
      if (values.has("since")) known = static_cast<std::uint64_t>(values.number("since"));
      const LivePlace place{server_.io, server_.workers, server_.live_sessions};
      std::make_shared<LiveSession>(std::move(stream_), server_.live, place, known,
                                    values.has("run") ? values.text("run") : "")
          ->accept(request);
    } catch (const Error& error) {
      write(refusal(400, error, error.where()));
    }
  }

  /// Tells the other side that this was all, and takes what it still sends for a while: closed with unread
  /// bytes, the connection would be reset, and the last answer lost with it.
  void end() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(std::chrono::seconds(2));
    drain(16 * server_.limits.body_bytes);
  }

  void drain(std::size_t most) {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(4096),
                            [self = shared_from_this(), most](error_code failure, std::size_t bytes) {
                              if (!failure && bytes < most) self->drain(most - bytes);
                            });
  }

  Impl& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{128 << 10};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::list<Session*>::iterator place_;
  HttpReply reply_;
  std::optional<http::response<Body>> response_;
  std::optional<http::response_serializer<Body>> serializer_;
  unsigned version_ = 11;
  bool keep_alive_ = false, only_header_ = false;
};

void HttpServer::Impl::accept() {
  acceptor.async_accept([this](error_code failure, tcp::socket socket) {
    if (!acceptor.is_open()) return;
    if (failure) {  // no file descriptors left, say: later
      pause.expires_after(std::chrono::milliseconds(100));
      pause.async_wait([this](error_code stopped) {
        if (!stopped) accept();
      });
      return;
    }
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const bool full = connections >= limits.connections;
    const auto session = std::make_shared<Session>(*this, std::move(socket));
    if (full && silent.empty())
      session->refuse(refusal(503, "too many connections", "server", "try again"));
    else
      session->read();
    if (full && silent.size() > 1) silent.front()->make_room();
    accept();
  });
}

void HttpServer::Impl::answer_in_time(const std::shared_ptr<Session>& session, HttpRequest request) {
  const bool slow = is_slow(request);
  std::size_t& count = slow ? waiting_slow : waiting;
  if (count >= (slow ? limits.waiting_slow : limits.waiting))
    return session->write(refusal(503, "too many questions at a time", request.path, "try again"));
  ++count;
  asio::post(slow ? slow_worker : workers, [this, session, &count, request = std::move(request)]() mutable {
    HttpReply reply = safe_answer(request);
    // The session belongs to the other thread, its end too: nothing of it is left here.
    asio::post(io, [session = std::move(session), &count, reply = std::move(reply)]() mutable {
      --count;
      session->write(std::move(reply));
    });
  });
}

HttpServer::HttpServer(const HttpPlace& place, Answer answer, IsSlow is_slow, std::shared_ptr<LiveFeed> live,
                       const HttpLimits& limits)
    : impl_(std::make_unique<Impl>(place, std::move(answer), std::move(is_slow), std::move(live), limits)) {}

HttpServer::~HttpServer() = default;

std::string HttpServer::url() const {
  const tcp::endpoint endpoint = impl_->acceptor.local_endpoint();
  const std::string address = endpoint.address().to_string();
  return "http://" + (endpoint.address().is_v6() ? "[" + address + "]" : address) + ":" +
         std::to_string(endpoint.port()) + "/";
}

void HttpServer::end_on_signals() {
  impl_->signals.add(SIGINT);
  impl_->signals.add(SIGTERM);
  impl_->signals.async_wait([this](error_code failure, int) {
    if (!failure) impl_->io.stop();
  });
}

void HttpServer::run() {
  impl_->io.run();
  impl_->signals.clear();
  impl_->workers.stop();
  impl_->slow_worker.stop();
  impl_->workers.join();
  impl_->slow_worker.join();
}

void HttpServer::stop() { impl_->io.stop(); }

bool is_loopback(const std::string& address) {
  error_code failure;
  const asio::ip::address parsed = asio::ip::make_address(address, failure);
  return !failure && parsed.is_loopback();
}

}  // namespace octosurf
