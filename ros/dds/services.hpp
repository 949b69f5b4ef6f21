#pragma once

#include "endpoints.hpp"
#include "io/exporters/message_writer.hpp"
#include "io/readers/message_reader.hpp"
#include "mapping.hpp"
#include "options.hpp"

#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace octosurf::dds {

/// The services of octosurf_msgs/srv, as rmw_cyclonedds_cpp has services over DDS: a topic of requests and
/// one of replies, both with the client's id and the request's number before the message. (rmw_fastrtps_cpp
/// sends those beside the message, and does not understand these.) One request after the other, in a thread
/// of their own.
class Services {
 public:
  Services(const Participant& participant, Mapping& mapping, const NodeOptions& options);

 private:
  /// Reads the request, writes the reply.
  using Answer = std::function<void(io::MessageReader&, io::MessageWriter&)>;
  struct Service {
    std::string name;
    Reader requests;
    Writer replies;
    Answer answer;
  };

  void add(const Participant& participant, const std::string& name, const std::string& type, Answer answer);
  void run(const std::stop_token& stop);
  void answer(const Service& service, const RawMessage& request);
  void save(io::MessageReader& in, io::MessageWriter& out);
  void load(io::MessageReader& in, io::MessageWriter& out);
  void query(io::MessageReader& in, io::MessageWriter& out);
  void contact_regions(io::MessageReader& in, io::MessageWriter& out);
  void plan(io::MessageReader& in, io::MessageWriter& out);
  std::string stem_of(const std::string& name) const;

  Mapping& mapping_;
  const NodeOptions& options_;
  std::vector<Service> services_;
  std::optional<Waiting> requests_;
  std::jthread thread_;
};

}  // namespace octosurf::dds
