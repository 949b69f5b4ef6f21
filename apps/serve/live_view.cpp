#include "io/text_file.hpp"
#include "output_files.hpp"
#include "run_outputs.hpp"
#include "serve/http_server.hpp"

#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <sys/resource.h>

#include <octosurf/up.hpp>

namespace octosurf {
namespace {

/// Of the calling thread, for good: what it does can wait, the next scan cannot.
void yield_to_the_mapper() {
  thread_local const int done = ::setpriority(PRIO_PROCESS, 0, 10);  // Linux: 0 is this thread
  static_cast<void>(done);  // where it is not allowed, all have the same share
}

/// No two runs have the same, so that nobody takes one's revisions for the other's.
std::string new_run() {
  std::random_device random;
  return io::formatted("%08x%08x", random(), random());
}

class LiveView {
 public:
  explicit LiveView(RunState& run)
      : mapper_(run.mapper),
        name_(title_of(run.options.output)),
        run_{new_run()},
        up_(mapper_.map().parameters().up) {
    run.mapper.share_octree();
    server_.emplace(*run.options.serve_port, [this] { return latest(); });
    std::printf("serving %s\n", server_->url().c_str());
    std::fflush(stdout);
  }

 private:
  std::shared_ptr<const ServedMap> latest() {
    yield_to_the_mapper();
    const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
    const std::lock_guard lock(making_);
    if (!latest_ || latest_->asked.snapshot != snapshot)
      latest_ =
          std::make_shared<const ServedMap>(planning::AskedMap(name_, snapshot, snapshot->octree,
                                                               up_ ? *up_ : estimate_up(*snapshot).direction),
                                            PageOptions{}.max_mb, run_, latest_.get());
    return latest_;
  }

  const Mapper& mapper_;
  const std::string name_;
  const ServedRun run_;
  const std::optional<Eigen::Vector3d> up_;  ///< if the map's parameters say
  std::mutex making_;                        ///< of the latest
  std::shared_ptr<const ServedMap> latest_;
  std::optional<HttpServer> server_;
};

}  // namespace

std::shared_ptr<const void> live_view(RunState& run) { return std::make_shared<LiveView>(run); }

}  // namespace octosurf
