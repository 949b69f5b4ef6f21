#pragma once

#include "dds/fast_dds.hpp"
#include "dds/messages.hpp"

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

// A robot of another vendor: Fast DDS.

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

template <class EndpointQos>
void apply(Qos qos, int depth, EndpointQos& to) {
  to.reliability().kind =
      qos == Qos::best_effort ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
  to.durability().kind =
      qos == Qos::latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  to.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  to.history().depth = depth;
  to.endpoint().history_memory_policy = fast_rtps::DYNAMIC_RESERVE_MEMORY_MODE;
}

template <class Entity>
Entity* made(Entity* entity, const std::string& what) {
  if (entity == nullptr) throw std::runtime_error("Fast DDS makes no " + what);
  return entity;
}

/// A participant on the loopback alone.
class Vendor {
 public:
  explicit Vendor(std::uint32_t domain) {
    fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
    qos.transport().use_builtin_transports = false;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().user_transports.push_back(udp);
    fast_rtps::Locator_t here;
    fast_rtps::IPLocator::setIPv4(here, "127.0.0.1");
    auto& builtin = qos.wire_protocol().builtin;
    builtin.initialPeersList.push_back(here);
    builtin.metatrafficUnicastLocatorList.push_back(here);
    listener_.discovered = [this](const std::string& topic, const std::string& user_data) {
      const std::lock_guard lock(mutex_);
      user_data_[topic] = user_data;
    };
    participant_ = made(fast::DomainParticipantFactory::get_instance()->create_participant(
                            domain, qos, &listener_, fast::StatusMask::none()),
                        "participant");
    publisher_ = made(participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT), "publisher");
    subscriber_ = made(participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT), "subscriber");
  }
  ~Vendor() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Vendor(const Vendor&) = delete;
  Vendor& operator=(const Vendor&) = delete;

  fast::DataWriter* writer(const std::string& name, const std::string& type, Qos qos, int depth,
                           const std::string& user_data) {
    fast::DataWriterQos wanted = fast::DATAWRITER_QOS_DEFAULT;
    apply(qos, depth, wanted);
    // What sends messages larger than a datagram. And Cyclone takes what a reliable writer sends before its
    // first heartbeat for the past; that comes every 3 s.
    wanted.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;
    set_heartbeat(wanted, 50'000'000);
    wanted.user_data().setValue({user_data.begin(), user_data.end()});
    return made(publisher_->create_datawriter(topic(name, type), wanted), "writer");
  }
  fast::DataReader* reader(const std::string& name, const std::string& type, Qos qos,
                           fast::DataReaderListener* listener, const std::string& user_data) {
    fast::DataReaderQos wanted = fast::DATAREADER_QOS_DEFAULT;
    wanted.user_data().setValue({user_data.begin(), user_data.end()});
    apply(qos, 10, wanted);
    return made(subscriber_->create_datareader(topic(name, type), wanted, listener), "reader");
  }
  /// Of the publishers of a topic that were discovered, the last one's.
  std::string user_data(const std::string& topic) const {
    const std::lock_guard lock(mutex_);
    const auto found = user_data_.find(topic);
    return found == user_data_.end() ? std::string() : found->second;
  }

 private:
  fast::Topic* topic(const std::string& name, const std::string& type) {
    if (auto* known = dynamic_cast<fast::Topic*>(participant_->lookup_topicdescription(name))) return known;
    if (participant_->find_type(type).empty())
      fast::TypeSupport(new RawSupport(type)).register_type(participant_);
    return made(participant_->create_topic(name, type, fast::TOPIC_QOS_DEFAULT), "topic " + name);
  }

  mutable std::mutex mutex_;  // of the next
  std::map<std::string, std::string> user_data_;
  WriterListener listener_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
};

class Publisher {
 public:
  /// `type`: as dds_name() has it.
  Publisher(Vendor& vendor, const std::string& topic, std::string type, Qos qos, int depth = 100,
            const std::string& user_data = {})
      : type_(std::move(type)), writer_(vendor.writer(topic, dds_name(type_), qos, depth, user_data)) {}
  bool publish(std::string cdr) const { return succeeded(writer_->write(&cdr)); }
  bool publish(const Json& message) const { return publish(encoded(type_, message)); }

 private:
  // What DataWriter::write() returns: until Fast DDS 2 whether it did, since 3 a code that is 0 if it did.
  static bool succeeded(bool written) { return written; }
  static bool succeeded(std::int32_t code) { return code == 0; }

  std::string type_;
  fast::DataWriter* writer_;
};

/// What has come last on a topic, and how much.
class Subscription : private fast::DataReaderListener {
 public:
  Subscription(Vendor& vendor, const std::string& topic, std::string type, Qos qos,
               const std::string& user_data = {})
      : type_(std::move(type)),
        last_(encoded(type_, {})),
        reader_(vendor.reader(topic, dds_name(type_), qos, this, user_data)) {}
  ~Subscription() override { reader_->set_listener(nullptr); }

  /// Zero and empty until there is one.
  Json last() const { return decoded(type_, last_bytes()); }
  std::string last_bytes() const {
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
    std::string message;
    fast::SampleInfo info;
    while (take(*reader, &message, info)) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex_);
      last_ = std::move(message);
      ++count_;
    }
  }

  std::string type_;
  mutable std::mutex mutex_;
  std::string last_;
  int count_ = 0;
  fast::DataReader* reader_;
};

/// A client of a service of the node, as rmw_cyclonedds_cpp has them: "Save" of /octosurf/save.
class Client {
 public:
  Client(Vendor& vendor, const std::string& service, const std::string& type)
      : requests_(vendor, "rq" + service + "Request", type + "_Request", Qos::reliable),
        replies_(vendor, "rr" + service + "Reply", type + "_Response", Qos::reliable) {}

  /// The answer; false in `success` without one.
  Json call(Json request = Json::object()) {
    constexpr std::uint64_t me = 0x0123456789abcdefULL;
    const Json asked = request["call"] = {{"client", me}, {"number", ++number_}};
    wait_until([&] { return replies_.writers() > 0; });
    const auto answered = [&] { return replies_.last().at("call") == asked; };
    if (spoken_until([&] { requests_.publish(request); }, answered, std::chrono::seconds(5)))
      return replies_.last();
    return {{"success", false}, {"message", "no answer"}};
  }

 private:
  Publisher requests_;
  Subscription replies_;
  std::int64_t number_ = 0;
};

}  // namespace octosurf::test
