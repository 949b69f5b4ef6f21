#pragma once

#include "dds/fast_dds.hpp"

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

// A robot of another vendor: Fast DDS, with types that its fastddsgen has made of ros/dds/idl.

namespace octosurf::test {

enum class Qos { best_effort, reliable, latched };

/// Polls until `holds` or the time is over; returns whether it holds. On a machine that does
/// anything at all it is a matter of tenths of a second.
inline bool wait_until(const std::function<bool()>& holds,
                       std::chrono::milliseconds longest = std::chrono::minutes(1)) {
  const auto end = std::chrono::steady_clock::now() + longest;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// The same for a message that only peers which have discovered its publisher receive: repeats it.
inline bool spoken_until(const std::function<void()>& speak, const std::function<bool()>& holds,
                         std::chrono::milliseconds pause = std::chrono::seconds(1)) {
  return wait_until([&] {
    speak();
    return wait_until(holds, pause);
  });
}

/// A participant on the loopback alone.
class Vendor {
 public:
  explicit Vendor(std::uint32_t domain);
  ~Vendor();
  Vendor(const Vendor&) = delete;
  Vendor& operator=(const Vendor&) = delete;

  fast::DataWriter* writer(const std::string& topic, const fast::TypeSupport& type, Qos qos, int depth,
                           const std::string& user_data = {});
  fast::DataReader* reader(const std::string& topic, const fast::TypeSupport& type, Qos qos,
                           fast::DataReaderListener* listener, const std::string& user_data = {});
  /// Of the publishers of a topic that were discovered, the last one's.
  std::string user_data(const std::string& topic) const;

 private:
  fast::Topic* topic(const std::string& name, const fast::TypeSupport& type);

  mutable std::mutex mutex_;  // of the next
  std::map<std::string, std::string> user_data_;
  WriterListener listener_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
};

template <class Support>
class Publisher {
 public:
  using Message = typename Support::type;

  Publisher(Vendor& vendor, const std::string& topic, Qos qos, int depth = 100,
            const std::string& user_data = {})
      : writer_(vendor.writer(topic, fast::TypeSupport(new Support), qos, depth, user_data)) {}
  bool publish(Message message) const { return succeeded(writer_->write(&message)); }

 private:
  // What DataWriter::write() returns: until Fast DDS 2 whether it did, since 3 a code that is 0 if it did.
  static bool succeeded(bool written) { return written; }
  static bool succeeded(std::int32_t code) { return code == 0; }

  fast::DataWriter* writer_;
};

/// What has come last on a topic, and how much.
template <class Support>
class Subscription : private fast::DataReaderListener {
 public:
  using Message = typename Support::type;

  Subscription(Vendor& vendor, const std::string& topic, Qos qos, const std::string& user_data = {})
      : reader_(vendor.reader(topic, fast::TypeSupport(new Support), qos, this, user_data)) {}
  ~Subscription() override { reader_->set_listener(nullptr); }

  Message last() const {
    const std::lock_guard lock(mutex_);
    return last_;
  }
  int count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  int writers() const {
    fast::SubscriptionMatchedStatus status;
    reader_->get_subscription_matched_status(status);
    return status.current_count;
  }

 private:
  void on_data_available(fast::DataReader* reader) override {
    Message message;
    fast::SampleInfo info;
    while (take(*reader, &message, info)) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex_);
      last_ = std::move(message);
      ++count_;
    }
  }

  mutable std::mutex mutex_;
  Message last_;
  int count_ = 0;
  fast::DataReader* reader_;
};

/// A client of a service, as rmw_cyclonedds_cpp has them.
template <class RequestSupport, class ResponseSupport>
class Client {
 public:
  Client(Vendor& vendor, const std::string& service)
      : requests_(vendor, "rq" + service + "Request", Qos::reliable),
        replies_(vendor, "rr" + service + "Reply", Qos::reliable) {}

  /// The answer; false in `success` without one.
  typename ResponseSupport::type call(typename RequestSupport::type request) {
    constexpr std::uint64_t me = 0x0123456789abcdefULL;
    request.call().client(me);
    request.call().number(++number_);
    wait_until([&] { return replies_.writers() > 0; });
    const auto answered = [&] {
      return replies_.last().call().number() == number_ && replies_.last().call().client() == me;
    };
    if (spoken_until([&] { requests_.publish(request); }, answered, std::chrono::seconds(5)))
      return replies_.last();
    return {};
  }

 private:
  Publisher<RequestSupport> requests_;
  Subscription<ResponseSupport> replies_;
  std::int64_t number_ = 0;
};

/// Throws std::runtime_error unless the bytes are such a message.
template <class Support>
typename Support::type deserialised(std::string_view bytes) {
  fast_rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(payload.data));
  payload.length = static_cast<std::uint32_t>(bytes.size());
  typename Support::type message;
  if (!deserialise<Support>(payload, message)) throw std::runtime_error("no such message");
  return message;
}

}  // namespace octosurf::test
