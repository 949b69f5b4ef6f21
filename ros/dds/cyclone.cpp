#include "cyclone.hpp"

#include "io/exporters/message_writer.hpp"
#include "raw_type.hpp"
#include "type_hashes.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <random>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::dds {
namespace {

using node::Profile;
using node::RawMessage;
using node::Request;

dds_entity_t checked(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error(what + ": " + dds_strretcode(entity));
  return entity;
}

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

/// `type`: as DDS names it. `also`: more user data, "key=value;".
Qos qos_of(Profile profile, int depth, const std::string& type, const std::string& also) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  std::string user_data = also;
  for (const auto& [name, hash] : type_hashes)
    if (name == type) user_data += "typehash=" + std::string(hash) + ";";
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  const bool reliable = profile != Profile::sensor;
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  dds_qset_durability(qos.get(),
                      profile == Profile::latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

/// "/a/b" as ROS 2 calls it over DDS, "rt/a/b". Throws Error(usage) unless it is a whole topic name.
std::string topic_over_dds(const std::string& topic) {
  const auto allowed = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '/'; };
  if (topic.size() < 2 || topic.front() != '/' || topic.back() == '/' ||
      topic.find("//") != std::string::npos || !std::all_of(topic.begin(), topic.end(), allowed))
    throw Error(Error::Kind::usage, "'" + topic + "'", "is no whole topic name",
                "give it as in /camera/depth/image_raw");
  return "rt" + topic;
}

/// "sensor_msgs/PointCloud2" as ROS 2 calls it over DDS.
std::string type_over_dds(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

/// What `key` has in an endpoint's user data; empty: nothing.
std::string user_data_of(const dds_builtintopic_endpoint_t* endpoint, const std::string& key) {
  void* data = nullptr;
  std::size_t size = 0;
  if (endpoint == nullptr || !dds_qget_userdata(endpoint->qos, &data, &size) || data == nullptr) return {};
  const std::string text = ";" + std::string(static_cast<const char*>(data), size);
  dds_free(data);
  const std::size_t at = text.find(";" + key + "=");
  if (at == std::string::npos) return {};
  const std::size_t begin = at + key.size() + 2;
  return text.substr(begin, text.find(';', begin) - begin);
}

using Endpoint = std::unique_ptr<dds_builtintopic_endpoint_t, decltype(&dds_builtintopic_free_endpoint)>;

class Writer final : public node::Publisher {
 public:
  /// `topic` and `type` as DDS names them.
  Writer(dds_entity_t participant, const std::string& topic, const std::string& type, Profile profile,
         const std::string& user_data = {}) {
    const RawTopic raw = make_raw_topic(participant, topic, type);
    type_ = raw.type;
    const int depth = profile == Profile::latched ? 1 : 10;
    writer_ = checked(
        dds_create_writer(participant, raw.entity, qos_of(profile, depth, type, user_data).get(), nullptr),
        "no writer of " + topic);
  }
  ~Writer() override { dds_delete(writer_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  bool publish(std::string cdr) override {
    const dds_return_t done = dds_writecdr(writer_, raw_message(type_, std::move(cdr)));
    if (done != DDS_RETCODE_TIMEOUT) checked(done, "cannot publish");
    return done >= 0;
  }

  std::size_t subscribers() const override {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(writer_, &status);
    return status.current_count;
  }

  /// Whether the reader of a service's client has been discovered. Its writer is alone a while; a client of
  /// others than rmw_cyclonedds_cpp has no id, and may be any.
  bool reaches(const std::string& client) const {
    if (client.empty()) return subscribers() > 0;
    std::array<dds_instance_handle_t, 256> readers{};
    const dds_return_t count = dds_get_matched_subscriptions(writer_, readers.data(), readers.size());
    for (dds_return_t i = 0; i < std::min<dds_return_t>(count, readers.size()); ++i) {
      const Endpoint reader(dds_get_matched_subscription_data(writer_, readers[static_cast<std::size_t>(i)]),
                            dds_builtintopic_free_endpoint);
      if (user_data_of(reader.get(), "clientid") == client) return true;
    }
    return false;
  }

  dds_entity_t entity() const { return writer_; }

 private:
  dds_entity_t writer_ = 0;
  ddsi_sertype* type_ = nullptr;
};

// A depth image arrives as ten or more datagrams at once: Cyclone's default of 1 MB is one image. Requests
// beyond the kernel's limit (net.core.rmem_max) are not repeated.
constexpr const char* more_buffer =
    "<CycloneDDS><Domain id='any'><Internal><SocketReceiveBufferSize "
    "max='16MB'/></Internal><Discovery><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery>"
    "</Domain></CycloneDDS>,";

std::string environment(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? std::string() : text;
}

/// What ROS 2's variables mean to Cyclone (rmw_cyclonedds_cpp does the same).
std::string discovery_of_environment() {
  std::string range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (environment("ROS_LOCALHOST_ONLY") == "1") range = "LOCALHOST";  // until Iron; it overrules the other
  const bool everywhere = range.empty() || range == "SUBNET", here = range == "LOCALHOST";
  if (range == "SYSTEM_DEFAULT") return {};
  if (!everywhere && !here && range != "OFF")
    throw Error(Error::Kind::usage, "ROS_AUTOMATIC_DISCOVERY_RANGE", "is '" + range + "'",
                "it is one of SUBNET, LOCALHOST, OFF and SYSTEM_DEFAULT");
  std::string peers = here ? "<Peer address='localhost'/>" : "";
  std::istringstream list(environment("ROS_STATIC_PEERS"));
  for (std::string peer; std::getline(list, peer, ';');)
    if (!peer.empty() && range != "OFF") peers += "<Peer address='" + peer + "'/>";
  if (everywhere && peers.empty()) return {};
  std::string xml = "<CycloneDDS><Domain id='any'>";
  if (!everywhere) xml += "<General><AllowMulticast>false</AllowMulticast></General>";
  xml += "<Discovery>";
  if (range == "OFF")
    xml += "<ParticipantIndex>none</ParticipantIndex><Tag>octosurf_" +
           std::to_string(std::random_device()()) + "</Tag>";
  else  // a process each, as many as rmw_cyclonedds_cpp looks for
    xml +=
        "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
        "<Peers>" +
        peers + "</Peers>";
  return xml + "</Discovery></Domain></CycloneDDS>,";
}

}  // namespace

/// A subscription, or the requests of a service.
class Cyclone::Reader final : public node::Subscription {
 public:
  using Receive = std::function<void(RawMessage, const Reader&, dds_instance_handle_t writer)>;

  Reader(Cyclone& home, const std::string& topic, const std::string& type, Profile profile, int depth,
         Receive receive, const std::string& user_data = {})
      : home_(home), receive_(std::move(receive)) {
    const RawTopic raw = make_raw_topic(home.participant_, topic, type);
    entity_ = checked(dds_create_reader(home.participant_, raw.entity,
                                        qos_of(profile, depth, type, user_data).get(), nullptr),
                      "no reader of " + topic);
    const std::lock_guard lock(home_.mutex_);
    const dds_entity_t unread = checked(dds_create_readcondition(entity_, DDS_ANY_STATE), topic);
    checked(dds_waitset_attach(home_.waitset_, unread, 0), "cannot wait for messages of " + topic);
    home_.readers_.push_back(this);
    home_.made_.push_back(entity_);
  }
  ~Reader() override {
    {
      const std::lock_guard lock(home_.mutex_);  // no callback is under way
      std::erase(home_.readers_, this);
    }
    dds_delete(entity_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  void receive_all() const {
    for (;;) {
      ddsi_serdata* data = nullptr;
      dds_sample_info_t info{};
      if (dds_takecdr(entity_, &data, 1, &info, DDS_ANY_STATE) <= 0) return;
      RawMessage message = owned(data, info.source_timestamp);
      if (info.valid_data)
        receive_(std::move(message), *this, info.publication_handle);  // else: a writer is gone
    }
  }

  /// The id of a writer that is a client of rmw_cyclonedds_cpp; else empty.
  std::string client_of(dds_instance_handle_t writer) const {
    const Endpoint known(dds_get_matched_publication_data(entity_, writer), dds_builtintopic_free_endpoint);
    return user_data_of(known.get(), "clientid");
  }

  std::size_t lost() const override {
    dds_sample_lost_status_t status{};
    dds_get_sample_lost_status(entity_, &status);
    return status.total_count;
  }
  std::size_t publishers() const override {
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(entity_, &status);
    return status.current_count;
  }
  std::string mismatch() const override {
    dds_requested_incompatible_qos_status_t status{};
    dds_get_requested_incompatible_qos_status(entity_, &status);
    if (status.total_count == 0) return {};
    switch (status.last_policy_id) {
      case DDS_RELIABILITY_QOS_POLICY_ID:
        return "reliability";
      case DDS_DURABILITY_QOS_POLICY_ID:
        return "durability";
      default:
        return "policy " + std::to_string(status.last_policy_id);
    }
  }

 private:
  Cyclone& home_;
  Receive receive_;
  dds_entity_t entity_ = 0;
};

Cyclone::Cyclone(std::uint32_t domain) {
  const std::string configuration = more_buffer + discovery_of_environment() + environment("CYCLONEDDS_URI");
  domain_ = dds_create_domain(domain, configuration.c_str());
  participant_ = domain_ < 0 ? domain_ : dds_create_participant(domain, nullptr, nullptr);
  if (participant_ < 0) {
    dds_delete(domain_);
    throw Error(Error::Kind::usage, "--domain " + std::to_string(domain),
                std::string("cannot be joined (") + dds_strretcode(participant_) + ")",
                "domains are 0 to 232; check CYCLONEDDS_URI and that there is a network interface; with a "
                "range of LOCALHOST a machine has room for 33 participants, of any program");
  }
  waitset_ = checked(dds_create_waitset(participant_), "cannot wait for messages");
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Cyclone::~Cyclone() {
  thread_.request_stop();
  thread_.join();
  dds_delete(domain_);
}

void Cyclone::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    dds_waitset_wait(waitset_, nullptr, 0, DDS_MSECS(100));
    const std::lock_guard lock(mutex_);
    for (const Reader* reader : readers_) reader->receive_all();
  }
}

std::unique_ptr<node::Publisher> Cyclone::advertise(const std::string& topic, const std::string& type,
                                                    Profile profile) {
  auto writer = std::make_unique<Writer>(participant_, topic_over_dds(topic), type_over_dds(type), profile);
  const std::lock_guard lock(mutex_);
  made_.push_back(writer->entity());
  return writer;
}

std::unique_ptr<node::Subscription> Cyclone::subscribe(const std::string& topic, const std::string& type,
                                                       Profile profile, int depth,
                                                       std::function<void(RawMessage)> receive) {
  return std::make_unique<Reader>(
      *this, topic_over_dds(topic), type_over_dds(type), profile, depth,
      [receive = std::move(receive)](RawMessage message, const Reader&, dds_instance_handle_t) {
        receive(std::move(message));
      });
}

struct Cyclone::Service {
  std::shared_ptr<Writer> replies;
  std::unique_ptr<Reader> requests;
};

std::shared_ptr<void> Cyclone::serve(const std::string& name, const std::string& type,
                                     std::function<void(Request)> receive) {
  // Both messages are 4 bytes of encapsulation, 16 of the call, and the service's own.
  static constexpr std::size_t head = 4, call = 16;
  const std::string place = topic_over_dds(name).substr(2), types = "octosurf_msgs::srv::dds_::" + type;
  std::random_device random;
  std::string id;  // as rmw_cyclonedds_cpp prints it
  for (int i = 0; i < 16; ++i) (id += i > 0 ? "." : "") += std::to_string(random() % 256);
  const std::string user_data = "serviceid=" + id + ";";
  auto service = std::make_shared<Service>();
  service->replies = std::make_shared<Writer>(participant_, "rr" + place + "Reply", types + "_Response_",
                                              Profile::reliable, user_data);
  const auto take = [replies = service->replies, receive = std::move(receive)](
                        const RawMessage& message, const Reader& reader, dds_instance_handle_t writer) {
    auto bytes = std::make_shared<std::string>(message.bytes);
    std::string identity = bytes->size() < head + call ? std::string() : bytes->substr(head, call);
    bytes->erase(std::min(head, bytes->size()), call);
    const auto reply = [replies, identity = std::move(identity),
                        client = reader.client_of(writer)](std::string cdr) {
      // A new client's request writer may be discovered before its reply reader.
      for (int tenths = 0; tenths < 10 && !replies->reaches(client); ++tenths)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      replies->publish(cdr.insert(head, identity));
    };
    receive({{*bytes, bytes, message.sent_ns}, reply});
  };
  service->requests = std::make_unique<Reader>(*this, "rq" + place + "Request", types + "_Request_",
                                               Profile::reliable, 10, take, user_data);
  return service;
}

void Cyclone::announce(const std::string& name) {
  const auto gid_of = [](dds_entity_t entity) {
    return [entity](io::MessageWriter& out) {
      dds_guid_t guid{};
      dds_get_guid(entity, &guid);
      for (const std::uint8_t byte : guid.v) out.write(byte);
    };
  };
  const std::size_t slash = name.rfind('/');
  info_ = std::make_unique<Writer>(participant_, "ros_discovery_info",
                                   "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", Profile::latched);
  const std::lock_guard lock(mutex_);
  std::vector<dds_entity_t> readers, writers;
  for (const dds_entity_t entity : made_)
    (dds_get_subscriber(entity) > 0 ? readers : writers).push_back(entity);
  const auto gids = [&](const std::vector<dds_entity_t>& entities) {
    return io::each(entities, [&](io::MessageWriter& out, dds_entity_t entity) { gid_of(entity)(out); });
  };
  info_->publish(io::cdr_of([&](io::MessageWriter& out) {
    out.message("gid", gid_of(participant_), "node_entities_info_seq", [&](io::MessageWriter& list) {
      list.begin_list(1);
      list.message("node_namespace", slash == 0 ? "/" : name.substr(0, slash), "node_name",
                   name.substr(slash + 1), "reader_gid_seq", gids(readers), "writer_gid_seq", gids(writers));
    });
  }));
}

}  // namespace octosurf::dds
