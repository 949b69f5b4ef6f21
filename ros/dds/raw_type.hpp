#pragma once

#include "node/middleware.hpp"

#include <cstdint>
#include <dds/dds.h>
#include <string>

namespace octosurf::dds {

/// Takes a reference over, as dds_takecdr() gives it: the message shares the one copy that Cyclone made of
/// it.
node::RawMessage owned(ddsi_serdata* data, std::int64_t sent_ns);

/// A topic whose messages Cyclone passes on as raw bytes, as in rmw_cyclonedds_cpp: only reader and writer
/// interpret them, and a damaged message reaches the reader, which rejects and counts it. `type` is for
/// raw_message().
struct RawTopic {
  dds_entity_t entity = 0;
  ddsi_sertype* type = nullptr;  ///< the topic's
};

/// Both as DDS names them. Throws std::runtime_error.
RawTopic make_raw_topic(dds_entity_t participant, const std::string& name, const std::string& type);

/// For dds_writecdr(), which takes the reference over.
ddsi_serdata* raw_message(const ddsi_sertype* type, std::string cdr);

}  // namespace octosurf::dds
