#pragma once

#include "contact_query.hpp"
#include "io/exporters/page_changes.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace octosurf {

/// What those who follow a map are told, as messages (io/page_changes.hpp). From any thread; made once for
/// all who know the same.
class LiveFeed {
 public:
  using Revision = std::function<std::uint64_t()>;  ///< of the map as it is now; takes no time
  using Source = std::function<AskedMap()>;         ///< the map as it is now
  using Track = std::function<io::SensorTrack()>;   ///< the sensor's, likewise
  using Message = std::shared_ptr<const std::string>;

  /// `run`: the name of the run whose revisions these are.
  LiveFeed(std::string run, Revision revision, Source map, Track track);

  std::uint64_t revision() const { return revision_(); }

  struct Changes {
    std::uint64_t since = 0, revision = 0;
    bool whole = false;
    Message message;
  };
  /// Since a revision of a run; everything, if nothing, another run's or one to come is known.
  Changes changes(std::optional<std::uint64_t> since, const std::string& run);

  Message voxels(bool slices);

  const std::string& run() const { return run_; }

 private:
  const std::string run_;
  const Revision revision_;
  const Source map_;
  const Track track_;
  std::mutex making_changes_, making_voxels_;  ///< of what follows each
  std::deque<Changes> made_;                   ///< the last ones, latest first
  struct Voxels {
    std::uint64_t revision = 0;
    bool slices = false;
    Message message;
  } voxels_;
};

}  // namespace octosurf
