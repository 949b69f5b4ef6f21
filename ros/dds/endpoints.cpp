#include "endpoints.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::dds {
namespace {

dds_entity_t checked(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error(what + ": " + dds_strretcode(entity));
  return entity;
}

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Qos qos_of(Profile profile, int depth) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  const bool reliable = profile != Profile::sensor;
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  dds_qset_durability(qos.get(),
                      profile == Profile::latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

// A depth image arrives as ten or more datagrams at once: Cyclone's default of 1 MB is one image. Requests
// beyond the kernel's limit (net.core.rmem_max) are not repeated.
constexpr const char* more_buffer =
    "<CycloneDDS><Domain id='any'><Internal><SocketReceiveBufferSize "
    "max='16MB'/></Internal></Domain></CycloneDDS>";

}  // namespace

std::string topic_over_dds(const std::string& topic) {
  const auto allowed = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '/'; };
  if (topic.size() < 2 || topic.front() != '/' || topic.back() == '/' ||
      topic.find("//") != std::string::npos || !std::all_of(topic.begin(), topic.end(), allowed))
    throw Error(Error::Kind::usage, "'" + topic + "'", "is no whole topic name",
                "give it as in /camera/depth/image_raw");
  return "rt" + topic;
}

std::string type_over_dds(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

Participant::Participant(std::uint32_t domain) {
  const char* own = std::getenv("CYCLONEDDS_URI");
  const std::string configuration = more_buffer + (own == nullptr ? std::string() : std::string(",") + own);
  domain_ = dds_create_domain(domain, configuration.c_str());
  entity_ = domain_ < 0 ? domain_ : dds_create_participant(domain, nullptr, nullptr);
  if (entity_ < 0)
    throw Error(Error::Kind::usage, "--domain " + std::to_string(domain),
                std::string("cannot be joined (") + dds_strretcode(entity_) + ")",
                "domains are 0 to 232; check CYCLONEDDS_URI and that there is a network interface");
}

Writer::Writer(const Participant& participant, const std::string& topic, const std::string& type,
               Profile profile) {
  const RawTopic raw = make_raw_topic(participant.entity(), topic, type);
  type_ = raw.type;
  const int depth = profile == Profile::latched ? 1 : 10;
  writer_ =
      checked(dds_create_writer(participant.entity(), raw.entity, qos_of(profile, depth).get(), nullptr),
              "no writer of " + topic);
}

bool Writer::write(std::string cdr) const {
  const dds_return_t done = dds_writecdr(writer_, raw_message(type_, std::move(cdr)));
  if (done != DDS_RETCODE_TIMEOUT) checked(done, "cannot publish");
  return done >= 0;
}

std::size_t Writer::readers() const {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(writer_, &status);
  return status.current_count;
}

Reader::Reader(const Participant& participant, const std::string& topic, const std::string& type,
               Profile profile, int depth) {
  const RawTopic raw = make_raw_topic(participant.entity(), topic, type);
  reader_ =
      checked(dds_create_reader(participant.entity(), raw.entity, qos_of(profile, depth).get(), nullptr),
              "no reader of " + topic);
}

std::optional<RawMessage> Reader::take() const {
  for (;;) {
    ddsi_serdata* data = nullptr;
    dds_sample_info_t info{};
    if (dds_takecdr(reader_, &data, 1, &info, DDS_ANY_STATE) <= 0) return std::nullopt;
    RawMessage message(data, info.source_timestamp);
    if (info.valid_data) return message;  // else: a writer is gone
  }
}

std::size_t Reader::lost() const {
  dds_sample_lost_status_t status{};
  dds_get_sample_lost_status(reader_, &status);
  return status.total_count;
}

std::size_t Reader::writers() const {
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(reader_, &status);
  return status.current_count;
}

Waiting::Waiting(const Participant& participant, const std::vector<const Reader*>& readers)
    : set_(checked(dds_create_waitset(participant.entity()), "cannot wait for messages")) {
  for (const Reader* reader : readers) {
    const dds_entity_t unread = dds_create_readcondition(reader->entity(), DDS_ANY_STATE);
    checked(dds_waitset_attach(set_, unread, 0), "cannot wait for messages");
  }
}

void Waiting::wait(std::chrono::milliseconds longest) const {
  dds_waitset_wait(set_, nullptr, 0, DDS_MSECS(longest.count()));
}

}  // namespace octosurf::dds
