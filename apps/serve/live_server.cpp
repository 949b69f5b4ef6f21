#include "serve/live_server.hpp"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <sys/resource.h>
#include <utility>

#include <octosurf/page.hpp>
#include <octosurf/space_part.hpp>
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
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", random(), random());
  return text.data();
}

}  // namespace

LiveServer::LiveServer(Mapper& mapper, std::string name, const HttpPlace& place, bool allow_clear)
    : mapper_(mapper),
      name_(std::move(name)),
      run_{new_run()},
      up_(mapper.map().parameters().up),
      api_([this] { return latest(); },
           allow_clear ? [this](const SpacePart& part, bool as_free) { return clear(part, as_free); }
                       : Api::Clear()) {
  mapper.share_octree();
  server_.emplace(place, api_);
}

bool LiveServer::clear_as_asked(Mapper& mapper) {
  std::vector<Clearing> all;
  {
    const std::lock_guard lock(asking_);
    all.swap(clearings_);
  }
  for (Clearing& one : all) one(mapper);
  return !all.empty();
}

void LiveServer::end_clearing() {
  const std::lock_guard lock(asking_);
  clearing_ended_ = true;
  clearings_.clear();
}

HttpReply LiveServer::clear(const SpacePart& part, bool as_free) {
  std::future<HttpReply> answer;
  {
    Clearing clearing([part, as_free](Mapper& mapper) {
      const ScanReport report = mapper.clear(part, as_free);
      const std::shared_ptr<const Snapshot> left = mapper.snapshot();
      return reply_of(nlohmann::ordered_json{{"revision", left->revision},
                                             {"points", report.vanished},
                                             {"gone", report.gone},
                                             {"merged", report.merged},
                                             {"smaller", report.shrunk},
                                             {"left", left->surfaces.size()}}
                          .dump() +
                      "\n");
    });
    answer = clearing.get_future();
    const std::lock_guard lock(asking_);
    if (!clearing_ended_) clearings_.push_back(std::move(clearing));
  }
  try {
    return answer.get();
  } catch (const std::future_error&) {  // nobody carries it out
    return refusal(503, "the run is over", clear_path, "octosurf clear changes the saved map");
  }
}

std::shared_ptr<const ServedMap> LiveServer::latest() {
  yield_to_the_mapper();
  const std::shared_ptr<const Snapshot> snapshot = mapper_.snapshot();
  const std::lock_guard lock(making_);
  if (!latest_ || latest_->asked.snapshot != snapshot)
    latest_ =
        std::make_shared<const ServedMap>(snapshot, name_, up_ ? *up_ : estimate_up(*snapshot).direction,
                                          PageOptions{}.max_mb, run_, latest_.get());
  return latest_;
}

}  // namespace octosurf
