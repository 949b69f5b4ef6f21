#pragma once

#include "serve/live_feed.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace octosurf {

/// Where sessions run, and how many there are.
struct LivePlace {
  boost::asio::io_context& io;  ///< of the one thread that sessions belong to
  boost::asio::thread_pool& workers;
  std::size_t& sessions;
};

/// One who follows the map over a WebSocket.
///
/// 1. At most one message is on its way, and the next is made of what has changed until then: who is slow
/// gets fewer
///    and larger ones, and nobody's messages pile up.
/// 2. Who has not answered a ping within 20 s is dropped, a client that reads nothing, say; it may come back
/// with the
///    revision it knows.
/// 3. All that a client may send is "voxels" or "slices" (text), for the voxels (with slices of free space)
/// as they are
///    now. Anything else ends the session (1008 policy, 1009 too big, 1002 no WebSocket).
class LiveSession : public std::enable_shared_from_this<LiveSession> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  /// `known`: the revision that the client has, of `run`.
  LiveSession(boost::beast::tcp_stream&& stream, std::shared_ptr<LiveFeed> feed, const LivePlace& place,
              std::optional<std::uint64_t> known, std::string run);
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  ~LiveSession() { --place_.sessions; }

  /// Answers the request to become a WebSocket, and begins.
  void accept(const Request& request);

 private:
  using Error = boost::system::error_code;

  void read();
  void arrived();
  void look_again();
  /// Sends what is new or was asked for, if nothing is on its way.
  void tell();
  void tell_changes();
  void tell_voxels();
  template <typename Make, typename Then>
  void make(Make make_message, Then then);
  void write(LiveFeed::Message message);
  void end(boost::beast::websocket::close_code code, const char* why);

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  const std::shared_ptr<LiveFeed> feed_;
  const LivePlace place_;
  std::optional<std::uint64_t> known_;
  std::string run_;
  boost::asio::steady_timer timer_;
  boost::beast::flat_buffer buffer_;
  LiveFeed::Message on_its_way_;
  bool busy_ = false, voxels_ = false, slices_ = false, ended_ = false;
};

}  // namespace octosurf
