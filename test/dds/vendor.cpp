#include "dds/vendor.hpp"

#include <memory>
#include <stdexcept>

namespace octosurf::test {
namespace {

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

}  // namespace

Vendor::Vendor(std::uint32_t domain) {
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

Vendor::~Vendor() {
  participant_->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

fast::Topic* Vendor::topic(const std::string& name, const std::string& type) {
  if (auto* known = dynamic_cast<fast::Topic*>(participant_->lookup_topicdescription(name))) return known;
  if (participant_->find_type(type).empty())
    fast::TypeSupport(new RawSupport(type)).register_type(participant_);
  return made(participant_->create_topic(name, type, fast::TOPIC_QOS_DEFAULT), "topic " + name);
}

std::string Vendor::user_data(const std::string& topic) const {
  const std::lock_guard lock(mutex_);
  const auto found = user_data_.find(topic);
  return found == user_data_.end() ? std::string() : found->second;
}

fast::DataWriter* Vendor::writer(const std::string& name, const std::string& type, Qos qos, int depth,
                                 const std::string& user_data) {
  fast::DataWriterQos wanted = fast::DATAWRITER_QOS_DEFAULT;
  apply(qos, depth, wanted);
  wanted.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;  // what sends messages larger than a datagram
  // Cyclone takes what a reliable writer sends before its first heartbeat for the past; that comes every 3 s.
  set_heartbeat(wanted, 50'000'000);
  wanted.user_data().setValue({user_data.begin(), user_data.end()});
  return made(publisher_->create_datawriter(topic(name, type), wanted), "writer");
}

fast::DataReader* Vendor::reader(const std::string& name, const std::string& type, Qos qos,
                                 fast::DataReaderListener* listener, const std::string& user_data) {
  fast::DataReaderQos wanted = fast::DATAREADER_QOS_DEFAULT;
  wanted.user_data().setValue({user_data.begin(), user_data.end()});
  apply(qos, 10, wanted);
  return made(subscriber_->create_datareader(topic(name, type), wanted, listener), "reader");
}

}  // namespace octosurf::test
