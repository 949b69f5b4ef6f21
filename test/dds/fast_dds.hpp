#pragma once

// Fast DDS 2 (Debian 12, Ubuntu 22.04 and 24.04) or 3 (Debian 13) under one set of names: 3 has moved and
// renamed most of what is used here.

#include <algorithm>
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
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#else
#define OCTOSURF_FAST_DDS 3
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

/// Messages as their bytes (std::string), behind the encapsulation header, under the name of a type.
class RawSupport : public fast::TopicDataType {
 public:
#if OCTOSURF_FAST_DDS == 2
  explicit RawSupport(const std::string& type) {
    setName(type.c_str());
    m_typeSize = most;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, fast_rtps::SerializedPayload_t* payload) override {
    return write(data, *payload);
  }
  bool deserialize(fast_rtps::SerializedPayload_t* payload, void* data) override {
    return read(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return size(data); };
  }
  bool getKey(void*, fast_rtps::InstanceHandle_t*, bool) override { return false; }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
#else
  explicit RawSupport(const std::string& type) {
    set_name(type);
    max_serialized_type_size = most;
    is_compute_key_provided = false;
  }
  bool serialize(const void* data, fast_rtps::SerializedPayload_t& payload,
                 fast::DataRepresentationId_t) override {
    return write(data, payload);
  }
  bool deserialize(fast_rtps::SerializedPayload_t& payload, void* data) override {
    return read(payload, data);
  }
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
  static constexpr std::uint32_t most = 1 << 20;
  static std::uint32_t size(const void* data) {
    return static_cast<std::uint32_t>(static_cast<const std::string*>(data)->size());
  }
  static bool write(const void* data, fast_rtps::SerializedPayload_t& payload) {
    const std::string& bytes = *static_cast<const std::string*>(data);
    if (bytes.size() > payload.max_size) return false;
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(payload.data));
    payload.length = size(data);
    return true;
  }
  static bool read(const fast_rtps::SerializedPayload_t& payload, void* data) {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload.data), payload.length);
    return true;
  }
};

}  // namespace octosurf::test
