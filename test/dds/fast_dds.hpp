#pragma once

// Fast DDS 2 (Debian 12, Ubuntu 22.04 and 24.04) or 3 (Debian 13) under one set of names: 3 has moved and
// renamed most of what is used here, and its fastddsgen writes headers that end otherwise.

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <string>
#if __has_include(<fastrtps/config.h>)
#define OCTOSURF_FAST_DDS 2
#include "octosurf_msgsPubSubTypes.h"
#include "ros2PubSubTypes.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#else
#define OCTOSURF_FAST_DDS 3
#include "octosurf_msgsPubSubTypes.hpp"
#include "ros2PubSubTypes.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#endif

namespace octosurf::test {

namespace fast = eprosima::fastdds::dds;
#if OCTOSURF_FAST_DDS == 2
namespace fast_rtps = eprosima::fastrtps::rtps;
#else
namespace fast_rtps = eprosima::fastdds::rtps;
#endif

/// Whether `reader` had another sample.
inline bool take(fast::DataReader& reader, void* message, fast::SampleInfo& info) {
#if OCTOSURF_FAST_DDS == 2
  return reader.take_next_sample(message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
#else
  return reader.take_next_sample(message, &info) == fast::RETCODE_OK;
#endif
}

inline void set_heartbeat(fast::DataWriterQos& qos, std::uint32_t nanoseconds) {
#if OCTOSURF_FAST_DDS == 2
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, nanoseconds};
#else
  qos.reliable_writer_qos().times.heartbeat_period = {0, nanoseconds};
#endif
}

/// Calls back with topic and user data of each publisher that is discovered.
class WriterListener : public fast::DomainParticipantListener {
 public:
  std::function<void(const std::string& topic, const std::string& user_data)> discovered;

 private:
#if OCTOSURF_FAST_DDS == 2
  void on_publisher_discovery(fast::DomainParticipant*, fast_rtps::WriterDiscoveryInfo&& writer) override {
    const auto& data = writer.info.m_qos.m_userData;
    discovered(writer.info.topicName().to_string(), {data.begin(), data.end()});
  }
#else
  void on_data_writer_discovery(fast::DomainParticipant*, fast_rtps::WriterDiscoveryStatus,
                                const fast::PublicationBuiltinTopicData& writer, bool&) override {
    discovered(writer.topic_name.to_string(), {writer.user_data.begin(), writer.user_data.end()});
  }
#endif
};

/// As Fast DDS serialises it, behind its encapsulation header; nothing where it cannot.
template <class Support>
std::string serialised(typename Support::type message) {
  Support support;
#if OCTOSURF_FAST_DDS == 2
  fast_rtps::SerializedPayload_t payload(support.getSerializedSizeProvider(&message)());
  if (!support.serialize(&message, &payload)) return {};
#else
  constexpr auto cdr = fast::XCDR_DATA_REPRESENTATION;
  fast_rtps::SerializedPayload_t payload(support.calculate_serialized_size(&message, cdr));
  if (!support.serialize(&message, payload, cdr)) return {};
#endif
  return {reinterpret_cast<const char*>(payload.data), payload.length};
}

template <class Support>
bool deserialise(fast_rtps::SerializedPayload_t& payload, typename Support::type& message) {
  Support support;
#if OCTOSURF_FAST_DDS == 2
  return support.deserialize(&payload, &message);
#else
  return support.deserialize(payload, &message);
#endif
}

/// Bytes as they are, under the name of a type: what a publisher sends that is broken.
class RawSupport : public fast::TopicDataType {
 public:
  explicit RawSupport(const std::string& type);
#if OCTOSURF_FAST_DDS == 2
  bool serialize(void* data, fast_rtps::SerializedPayload_t* payload) override {
    return copy(data, *payload);
  }
  bool deserialize(fast_rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return size(data); };
  }
  bool getKey(void*, fast_rtps::InstanceHandle_t*, bool) override { return false; }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
#else
  bool serialize(const void* data, fast_rtps::SerializedPayload_t& payload,
                 fast::DataRepresentationId_t) override {
    return copy(data, payload);
  }
  bool deserialize(fast_rtps::SerializedPayload_t&, void*) override { return false; }
  std::uint32_t calculate_serialized_size(const void* data, fast::DataRepresentationId_t) override {
    return size(data);
  }
  bool compute_key(fast_rtps::SerializedPayload_t&, fast_rtps::InstanceHandle_t&, bool) override {
    return false;
  }
  bool compute_key(const void*, fast_rtps::InstanceHandle_t&, bool) override { return false; }
  void* create_data() override { return new std::string; }
  void delete_data(void* data) override { delete static_cast<std::string*>(data); }
#endif

 private:
  static bool copy(const void* data, fast_rtps::SerializedPayload_t& payload);
  static std::uint32_t size(const void* data) {
    return static_cast<std::uint32_t>(static_cast<const std::string*>(data)->size());
  }
};

}  // namespace octosurf::test
