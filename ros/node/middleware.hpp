#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

// What the node needs of ROS 2: everything else of it is the same over DDS (ros/dds) and in a process of ROS
// 2 (ros/octosurf_ros). Names are ROS 2's: topics "/a/b", types "sensor_msgs/Image".

namespace octosurf::node {

/// The QoS profiles of ROS 2 used here. A reader accepts writers that offer at least its own level: `sensor`
/// accepts all, `reliable` only writers that resend lost messages.
enum class Profile {
  sensor,    ///< best effort, volatile
  reliable,  ///< reliable, volatile: /tf
  latched    ///< reliable, transient local: the last message for all who come later; /tf_static, maps
};

/// A message as it came from the network.
struct RawMessage {
  std::string_view bytes;             ///< CDR behind its encapsulation header
  std::shared_ptr<const void> owner;  ///< of the bytes
  std::int64_t sent_ns = 0;           ///< since 1970, by the publisher's clock
};

class Publisher {
 public:
  virtual ~Publisher() = default;
  /// Sends a message in CDR. False if subscribers that are too slow have kept it waiting for a tenth of a
  /// second; it is not sent then.
  virtual bool publish(std::string cdr) = 0;
  virtual std::size_t subscribers() const = 0;
};

class Subscription {
 public:
  virtual ~Subscription() = default;
  virtual std::size_t lost() const = 0;  ///< messages, by the gaps in the numbers of received ones
  virtual std::size_t publishers() const = 0;
  /// Of a publisher that is not heard, as it offers less: the policy ("reliability"). Empty: all are heard.
  virtual std::string mismatch() const = 0;
};

/// A request of a service; may be answered later and from any thread.
struct Request {
  RawMessage message;
  std::function<void(std::string cdr)> reply;
};

/// Callbacks come one after the other from a thread of its own, those subscribed to first first; they end
/// with the object that subscribe() or serve() returns, which must not outlive the middleware.
class Middleware {
 public:
  virtual ~Middleware() = default;
  virtual std::unique_ptr<Publisher> advertise(const std::string& topic, const std::string& type,
                                               Profile profile) = 0;
  /// Keeps the last `depth` messages that were not yet received.
  virtual std::unique_ptr<Subscription> subscribe(const std::string& topic, const std::string& type,
                                                  Profile profile, int depth,
                                                  std::function<void(RawMessage)> receive) = 0;
  /// `type`: one of octosurf_msgs/srv, "Save".
  virtual std::shared_ptr<void> serve(const std::string& name, const std::string& type,
                                      std::function<void(Request)> receive) = 0;
};

}  // namespace octosurf::node
