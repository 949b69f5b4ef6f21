#pragma once

#include "raw_type.hpp"

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::dds {

/// The QoS profiles of ROS 2 used here. A reader accepts writers that offer at least its own level: `sensor`
/// accepts all, `reliable` only writers that resend lost messages.
enum class Profile {
  sensor,    ///< best effort, volatile
  reliable,  ///< reliable, volatile: /tf, services
  latched    ///< reliable, transient local: the last message for all who come later; /tf_static, maps
};

/// "/a/b" as ROS 2 calls it over DDS, "rt/a/b". Throws Error(usage) unless it is a whole topic name.
std::string topic_over_dds(const std::string& topic);
/// "sensor_msgs/PointCloud2" as ROS 2 calls it over DDS.
std::string type_over_dds(const std::string& type);

/// One participant in a domain; CYCLONEDDS_URI applies.
class Participant {
 public:
  /// Throws Error(usage) if the domain is none or cannot be joined.
  explicit Participant(std::uint32_t domain);
  ~Participant() { dds_delete(domain_); }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  dds_entity_t entity() const { return entity_; }

 private:
  dds_entity_t domain_ = 0, entity_ = 0;
};

/// Goes with its participant.
class Writer {
 public:
  /// `topic` and `type` as DDS names them.
  Writer(const Participant& participant, const std::string& topic, const std::string& type, Profile profile);
  /// False if readers that are too slow have kept it waiting for a tenth of a second; it is not sent then.
  bool write(std::string cdr) const;
  std::size_t readers() const;

 private:
  dds_entity_t writer_ = 0;
  ddsi_sertype* type_ = nullptr;
};

/// Goes with its participant.
class Reader {
 public:
  /// Keeps the last `depth` messages that were not yet taken.
  Reader(const Participant& participant, const std::string& topic, const std::string& type, Profile profile,
         int depth);
  std::optional<RawMessage> take() const;
  /// Number of lost messages, by the gaps in the numbers of received ones.
  std::size_t lost() const;
  std::size_t writers() const;
  dds_entity_t entity() const { return reader_; }

 private:
  dds_entity_t reader_ = 0;
};

/// Waits for messages of any of some readers.
class Waiting {
 public:
  Waiting(const Participant& participant, const std::vector<const Reader*>& readers);
  /// Until there is one, or the time is over.
  void wait(std::chrono::milliseconds longest) const;

 private:
  dds_entity_t set_ = 0;
};

}  // namespace octosurf::dds
