#include "serve/http_server.hpp"

#include "geometry/interruption.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_static_buffer.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <charconv>
#include <chrono>
#include <exception>
#include <functional>
#include <limits>
#include <new>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

namespace octosurf {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using namespace std::chrono_literals;

constexpr int most_clients = 256, most_answers = 8;  // the latter at once
constexpr std::size_t longest_header = 8192;
constexpr auto request_time = 5s, reply_time = 60s, end_time = 1s, closing_time = 2s;

template <class Text>  // Boost's string_view, or what it became in later versions
std::string string_of(const Text& text) {
  return {text.data(), text.size()};
}

/// %41 is A. Throws Error(usage).
std::string decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char code = 0;
    const char* digits = text.data() + i + 1;
    if (text[i] != '%' || i + 2 >= text.size() ||
        std::from_chars(digits, digits + 2, code, 16).ptr != digits + 2) {
      result += text[i];
      continue;
    }
    if (code == 0) throw Error(Error::Kind::usage, "request", "holds a NUL character", "leave %00 away");
    result += static_cast<char>(code);
    i += 2;
  }
  return result;
}

/// Throws Error(usage).
QueryParameters parameters_in(std::string query) {
  std::ranges::replace(query, '+', ' ');
  QueryParameters given;
  for (std::string_view rest = query; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(one.size() + 1, rest.size()));
    const std::size_t equals = std::min(one.find('='), one.size());
    const std::string name = decoded(one.substr(0, equals));
    if (!name.empty()) given.emplace(name, decoded(one.substr(std::min(equals + 1, one.size()))));
  }
  return given;
}

HttpReply safe(const std::string& path, const std::function<HttpReply()>& make) {
  try {
    return make();
  } catch (const Error& error) {
    if (geometry::interruption) return refusal(503, "the server ends", path, "");
    if (error.kind() == Error::Kind::usage) return refusal(400, error, error.where());
    return refusal(error.kind() == Error::Kind::data ? 404 : 500, error, error.where());
  } catch (const std::bad_alloc&) {
    return refusal(500, "out of memory", path, "request less at a time");
  } catch (const std::exception& error) {
    return refusal(500, error.what(), path, "");
  }
}

/// The refusal, if the request is not let in.
std::optional<HttpReply> refused(const http::request_parser<http::empty_body>& parser,
                                 const std::string& path) {
  const auto& request = parser.get();
  if (request.count(http::field::host) == 0)
    return refusal(400, "the request names no host", "Host", "send HTTP/1.1 with a Host field");
  const std::string host = string_of(request[http::field::host]),
                    origin = string_of(request[http::field::origin]);
  const std::string name =  // without its port and brackets
      host.starts_with('[') ? host.substr(1, host.find(']') - 1) : host.substr(0, host.find(':'));
  error_code no_address;
  if (!beast::iequals(name, "localhost") && !asio::ip::make_address(name, no_address).is_loopback())
    return refusal(421, "this server is of this machine alone, not '" + name + "'", "Host",
                   "use 127.0.0.1 or localhost");
  if (request.count(http::field::origin) > 0 && origin != "http://" + host && origin != "https://" + host)
    return refusal(403, "another site's page has no access", "Origin", "use this server's page");
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return refusal(405, "this method is not supported", path, "use GET");
  if (request.count(http::field::transfer_encoding) > 0 || parser.content_length().value_or(0) > 0)
    return refusal(413, "a question has no body", "body", "put the parameters into the URL's query");
  return std::nullopt;
}

std::string head_of(const HttpReply& reply) {
  std::string head = "HTTP/1.1 " + std::to_string(reply.status) + " ";
  head += string_of(http::obsolete_reason(http::int_to_status(static_cast<unsigned>(reply.status))));
  head += "\r\nContent-Type: " + reply.type;
  head += "\r\nContent-Length: " + std::to_string(reply.body->size());
  if (reply.status == 405) head += "\r\nAllow: GET, HEAD";
  if (reply.status == 503) head += "\r\nRetry-After: 1";
  return head +
         "\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY"
         "\r\nConnection: close\r\n\r\n";
}

}  // namespace

/// Sockets and clocks have one thread, which never waits for an answer: these are made by others.
struct HttpServer::Impl {
  class Client;

  Impl(std::uint16_t port, LatestMap map) : latest(std::move(map)) {
    const tcp::endpoint place(asio::ip::address_v4::loopback(), port);
    try {
      acceptor = tcp::acceptor(io, place);
      bound_port = acceptor.local_endpoint().port();
    } catch (const boost::system::system_error& failure) {
      throw Error(Error::Kind::usage, "127.0.0.1 port " + std::to_string(port),
                  "cannot be listened on: " + failure.code().message(),
                  failure.code() == asio::error::no_descriptors ? "raise the limit of open files (ulimit -n)"
                                                                : "give a port that is free, or port 0");
    }
    sockets = std::thread([this] { run(); });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    const bool interrupted = geometry::interruption.exchange(true);
    io.stop();
    sockets.join();
    workers.stop();
    workers.join();
    if (!interrupted) geometry::interruption = false;
  }

  void run() {
    while (!io.stopped()) {
      try {
        if (!accepting) accept();
        io.run();
      } catch (const std::exception&) {  // no descriptor or no memory for a client
        std::this_thread::sleep_for(100ms);
      }
    }
    try {
      ending = true;
      acceptor.close();
      io.restart();
      io.run_for(end_time);
    } catch (const std::exception&) {  // likewise; what is left is not sent
    }
  }

  void accept();

  const LatestMap latest;
  std::atomic<int> clients = 0;
  std::uint16_t bound_port = 0;
  bool accepting = false, ending = false;  // of the thread of the sockets
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::thread_pool workers{most_answers};
  std::thread sockets;
};

/// A connection with one request. Its functions run in the thread of the sockets, but for what work() makes.
class HttpServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    ++server_.clients;
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { --server_.clients; }

  void read() {
    parser_.header_limit(longest_header);
    parser_.body_limit(std::numeric_limits<std::uint64_t>::max());  // a body is refused, not read
    stream_.expires_after(request_time);
    http::async_read_header(
        stream_, buffer_, parser_,
        [self = shared_from_this()](error_code failed, std::size_t) { self->answer(failed); });
  }

  void send(const HttpReply& reply) {
    head_ = head_of(reply);
    body_ = parser_.get().method() == http::verb::head ? nullptr : reply.body;
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                  body_ ? asio::buffer(*body_) : asio::const_buffer()};
    stream_.expires_after(reply_time);
    asio::async_write(stream_, parts, [self = shared_from_this()](error_code failed, std::size_t) {
      if (!failed) self->finish();
    });
  }

 private:
  /// Reads on until the client closes: what arrives at a closed socket resets the connection, and the client
  /// may lose the reply (RFC 9112, 9.6).
  void finish() {
    error_code gone;
    stream_.socket().shutdown(tcp::socket::shutdown_send, gone);
    if (gone) return;
    stream_.expires_after(closing_time);
    read_on();
  }
  void read_on() {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(longest_header),
                            [self = shared_from_this()](error_code failed, std::size_t) {
                              if (!failed) self->read_on();
                            });
  }

  void answer(error_code failed) {
    if (failed == beast::error::timeout) return;
    if (failed)
      return send(refusal(400, "no HTTP request, or too long a one", "request",
                          "send HTTP/1.1 with a header of 8 KB at most"));
    const std::string target = string_of(parser_.get().target());
    const std::size_t end = std::min(target.find('?'), target.size());
    path_ = target.substr(0, end);
    if (const auto why = refused(parser_, path_)) return send(*why);
    make(target.substr(std::min(end + 1, target.size())));
  }

  /// The reply, in another thread, which is then sent by that of the sockets.
  void make(std::string query) {
    auto task = [self = shared_from_this(), query = std::move(query),
                 busy = asio::make_work_guard(server_.io)] {
      try {
        HttpReply reply = safe(self->path_, [&] {
          return answer_to(*self->server_.latest(), self->path_, parameters_in(query));
        });
        asio::post(self->server_.io, [self, reply = std::move(reply)] { self->send(reply); });
      } catch (const std::exception&) {  // no memory for a client
      }
    };
    asio::post(server_.workers, std::move(task));
  }

  Impl& server_;
  beast::tcp_stream stream_;
  beast::flat_static_buffer<longest_header> buffer_;
  http::request_parser<http::empty_body> parser_;
  std::string path_, head_;
  std::shared_ptr<const std::string> body_;
};

void HttpServer::Impl::accept() {
  acceptor.async_accept([this](error_code failed, tcp::socket socket) {
    accepting = false;
    if (ending) return;
    if (failed) throw boost::system::system_error(failed);
    accept();
    const auto client = std::make_shared<Client>(*this, std::move(socket));
    if (clients > most_clients)
      return client->send(refusal(503, "too many requests at once", "request", "try again"));
    client->read();
  });
  accepting = true;
}

HttpServer::HttpServer(std::uint16_t port, LatestMap map)
    : impl_(std::make_unique<Impl>(port, std::move(map))) {}

HttpServer::~HttpServer() = default;

std::string HttpServer::url() const { return "http://127.0.0.1:" + std::to_string(impl_->bound_port) + "/"; }

}  // namespace octosurf
