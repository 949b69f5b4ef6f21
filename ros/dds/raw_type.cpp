#include "raw_type.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <dds/ddsi/ddsi_keyhash.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>
#include <new>
#include <stdexcept>
#include <utility>

// What Cyclone asks of a type that is not made by its IDL compiler. ROS 2's topics have no keys, so that all
// messages of a topic are of one instance, and whatever concerns keys is trivial here.

namespace octosurf::dds {
namespace {

struct RawData : ddsi_serdata {
  std::string bytes;
};

const std::string& bytes_of(const ddsi_serdata* data) { return static_cast<const RawData*>(data)->bytes; }

/// Cyclone is C: no exception may pass through it. Without memory a message is lost.
RawData* make(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) try {
  auto data = std::make_unique<RawData>();
  data->bytes.resize(size);
  ddsi_serdata_init(data.get(), type, kind);
  return data.release();
} catch (const std::bad_alloc&) {
  return nullptr;
}

/// Fragments come in order, and may overlap.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                             std::size_t size) {
  RawData* data = make(type, kind, size);
  std::size_t done = 0;
  for (; data != nullptr && fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= done || fragment->min > done || fragment->maxp1 > size) continue;
    const unsigned char* payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(data->bytes.data() + done, payload + (done - fragment->min), fragment->maxp1 - done);
    done = fragment->maxp1;
  }
  return data;
}

ddsi_serdata* from_parts(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                         const ddsrt_iovec_t* parts, std::size_t size) {
  RawData* data = make(type, kind, size);
  std::size_t done = 0;
  for (ddsrt_msg_iovlen_t i = 0; data != nullptr && i < count && done < size; ++i) {
    const std::size_t part = std::min<std::size_t>(parts[i].iov_len, size - done);
    std::memcpy(data->bytes.data() + done, parts[i].iov_base, part);
    done += part;
  }
  return data;
}

ddsi_serdata* key_alone(const ddsi_sertype* type, const ddsi_keyhash*) { return make(type, SDK_KEY, 0); }

ddsi_serdata* untyped(const ddsi_serdata* data) {
  RawData* key = make(data->type, SDK_KEY, 0);
  if (key != nullptr) key->type = nullptr;
  return key;
}

/// What is asked for may end up to 3 bytes behind a message that came from elsewhere: Cyclone counts by
/// fours.
void copy_out(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
  const std::string& bytes = bytes_of(data);
  const std::size_t there = offset < bytes.size() ? std::min(size, bytes.size() - offset) : 0;
  if (there > 0) std::memcpy(to, bytes.data() + offset, there);
  std::memset(static_cast<char*>(to) + there, 0, size - there);
}

ddsi_serdata* lend(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* to) {
  to->iov_base = const_cast<char*>(bytes_of(data).data() + offset);  // raw_message() has padded it
  to->iov_len = size;
  return ddsi_serdata_ref(data);
}

const ddsi_serdata_ops data_operations = [] {
  ddsi_serdata_ops operations{};
  operations.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  operations.get_size = [](const ddsi_serdata* data) {
    return static_cast<std::uint32_t>(bytes_of(data).size());
  };
  operations.from_ser = from_fragments;
  operations.from_ser_iov = from_parts;
  operations.from_keyhash = key_alone;
  // Messages are written and taken as they are, by dds_writecdr() and dds_takecdr(); there are no samples.
  operations.from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind, const void*) {
    return key_alone(type, nullptr);
  };
  operations.to_ser = copy_out;
  operations.to_ser_ref = lend;
  operations.to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); };
  operations.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  operations.to_untyped = untyped;
  operations.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
    return true;
  };
  operations.free = [](ddsi_serdata* data) { delete static_cast<RawData*>(data); };
  operations.print = [](const ddsi_sertype*, const ddsi_serdata* data, char* text, std::size_t size) {
    return static_cast<std::size_t>(std::snprintf(text, size, "%zu bytes", bytes_of(data).size()));
  };
  operations.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash, bool) { *hash = {}; };
  return operations;
}();

const ddsi_sertype_ops type_operations = [] {
  ddsi_sertype_ops operations{};
  operations.version = ddsi_sertype_v0;
  operations.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete type;
  };
  operations.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  operations.realloc_samples = [](void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {};
  operations.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  operations.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // names were compared
  operations.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  // ROS 2 is of the time before XTypes: XCDR1, whatever the other side may offer.
  operations.derive_sertype = [](const ddsi_sertype* type, dds_data_representation_id_t,
                                 dds_type_consistency_enforcement_qospolicy_t) {
    return const_cast<ddsi_sertype*>(type);
  };
  return operations;
}();

}  // namespace

RawMessage::RawMessage(ddsi_serdata* data, std::int64_t sent_ns)
    : data_(data, [](ddsi_serdata* held) { ddsi_serdata_unref(held); }), sent_ns_(sent_ns) {}

std::string_view RawMessage::bytes() const {
  if (!data_) return {};
  return bytes_of(data_.get());
}

RawTopic make_raw_topic(dds_entity_t participant, const std::string& name, const std::string& type) {
  auto made = std::make_unique<ddsi_sertype>();
  ddsi_sertype_init(made.get(), type.c_str(), &type_operations, &data_operations, true);
  made->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  RawTopic topic;
  topic.type = made.release();
  topic.entity = dds_create_topic_sertype(participant, name.c_str(), &topic.type, nullptr, nullptr, nullptr);
  if (topic.entity >= 0) return topic;
  ddsi_sertype_unref(topic.type);
  throw std::runtime_error("no topic " + name + ": " + dds_strretcode(topic.entity));
}

ddsi_serdata* raw_message(const ddsi_sertype* type, std::string cdr) {
  RawData* data = make(type, SDK_DATA, 0);
  if (data == nullptr) throw std::bad_alloc();
  cdr.resize((cdr.size() + 3) / 4 * 4);  // Cyclone sends by fours, and lend() gives it these bytes
  data->bytes = std::move(cdr);
  return data;
}

}  // namespace octosurf::dds
