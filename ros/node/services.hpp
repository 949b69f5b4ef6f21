#pragma once

#include "io/exporters/message_writer.hpp"
#include "io/readers/sensor_messages.hpp"
#include "mapping.hpp"
#include "middleware.hpp"
#include "node_options.hpp"
#include "publications.hpp"

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace octosurf::node {

/// The services of octosurf_msgs/srv. One request after the other, in a thread of their own.
class Services {
 public:
  Services(Middleware& middleware, Mapping& mapping, Publications& publications, const NodeOptions& options);
  ~Services();

 private:
  /// Reads the request, writes the reply.
  using Answer = void (Services::*)(io::MessageReader&, io::MessageWriter&);

  void serve(Middleware& middleware, const std::string& name, const std::string& type, Answer method);
  void run(const std::stop_token& stop);
  void answer(const std::string& name, Answer method, const Request& request);
  void save(io::MessageReader& in, io::MessageWriter& out);
  void load(io::MessageReader& in, io::MessageWriter& out);
  void query(io::MessageReader& in, io::MessageWriter& out);
  void contact_regions(io::MessageReader& in, io::MessageWriter& out);
  void plan(io::MessageReader& in, io::MessageWriter& out);
  void changes(io::MessageReader& in, io::MessageWriter& out);
  void publish(io::MessageReader& in, io::MessageWriter& out);
  void clear(io::MessageReader& in, io::MessageWriter& out);
  std::string stem_of(const std::string& name) const;

  Mapping& mapping_;
  Publications& publications_;
  const NodeOptions& options_;
  std::mutex mutex_;  // of the next
  std::deque<std::function<void()>> requests_;
  std::condition_variable_any news_;
  std::vector<std::shared_ptr<void>> services_;
  std::jthread thread_;
};

}  // namespace octosurf::node
