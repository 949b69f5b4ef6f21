#include "serve/live_session.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <chrono>
#include <exception>
#include <utility>

namespace octosurf {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;

constexpr std::chrono::milliseconds between{200};  // pictures need no more, and the mapper has its processor
constexpr std::chrono::seconds silent{20}, shaking_hands{10};
constexpr std::size_t longest_message = 64;

}  // namespace

LiveSession::LiveSession(boost::beast::tcp_stream&& stream, std::shared_ptr<LiveFeed> feed,
                         const LivePlace& place, std::optional<std::uint64_t> known, std::string run)
    : socket_(std::move(stream)),
      feed_(std::move(feed)),
      place_(place),
      known_(known),
      run_(std::move(run)),
      timer_(place.io) {
  ++place_.sessions;
}

void LiveSession::accept(const Request& request) {
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = shaking_hands;
  timeout.idle_timeout = silent / 2;  // after one, Beast sends a ping; after two, it ends the session
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
  socket_.read_message_max(longest_message);
  socket_.binary(true);
  socket_.async_accept(request, [self = shared_from_this()](Error failure) {
    if (failure) return;
    self->read();
    self->look_again();
  });
}

void LiveSession::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](Error failure, std::size_t) {
    if (failure) {
      self->ended_ = true;
      self->timer_.cancel();
      return;
    }
    self->arrived();
  });
}

void LiveSession::arrived() {
  const std::string text = boost::beast::buffers_to_string(buffer_.data());
  buffer_.clear();
  if (!socket_.got_text() || (text != "voxels" && text != "slices"))
    return end(websocket::close_code::policy_error, "only 'voxels' and 'slices' can be asked for");
  voxels_ = true;
  slices_ = slices_ || text == "slices";
  tell();
  read();
}

void LiveSession::look_again() {
  if (ended_) return;
  tell();
  timer_.expires_after(between);
  timer_.async_wait([self = shared_from_this()](Error stopped) {
    if (!stopped) self->look_again();
  });
}

void LiveSession::tell() {
  if (busy_ || ended_) return;
  // Changes first: voxels are of surfaces that the client should know.
  if (!known_ || run_ != feed_->run() || *known_ != feed_->revision()) return tell_changes();
  if (voxels_) tell_voxels();
}

template <typename Make, typename Then>
void LiveSession::make(Make make_message, Then then) {
  busy_ = true;
  asio::post(place_.workers, [self = shared_from_this(), make_message, then]() mutable {
    decltype(make_message()) made{};
    bool failed = false;
    try {
      made = make_message();
    } catch (const std::exception&) {  // no memory, say
      failed = true;
    }
    // The session belongs to the other thread, its end too: nothing of it is left here.
    asio::io_context& io = self->place_.io;
    asio::post(io, [self = std::move(self), made = std::move(made), failed, then]() mutable {
      self->busy_ = false;
      if (self->ended_) return;
      if (failed) return self->end(websocket::close_code::internal_error, "out of memory");
      then(*self, std::move(made));
    });
  });
}

void LiveSession::tell_changes() {
  make([feed = feed_, known = known_, run = run_] { return feed->changes(known, run); },
       [](LiveSession& self, LiveFeed::Changes changes) {
         self.known_ = changes.revision;
         self.run_ = self.feed_->run();
         self.write(std::move(changes.message));
       });
}

void LiveSession::tell_voxels() {
  make([feed = feed_, slices = slices_] { return feed->voxels(slices); },
       [](LiveSession& self, LiveFeed::Message message) { self.write(std::move(message)); });
  voxels_ = slices_ = false;
}

void LiveSession::write(LiveFeed::Message message) {
  busy_ = true;
  on_its_way_ = std::move(message);
  socket_.async_write(asio::buffer(*on_its_way_), [self = shared_from_this()](Error failure, std::size_t) {
    self->busy_ = false;
    self->on_its_way_.reset();
    if (failure) self->ended_ = true;
  });
}

void LiveSession::end(websocket::close_code code, const char* why) {
  ended_ = true;
  timer_.cancel();
  socket_.async_close({code, why}, [self = shared_from_this()](Error) {});
}

}  // namespace octosurf
