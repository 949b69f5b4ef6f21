#pragma once

#include "io/map_file/map_file.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/map.hpp>

namespace octosurf::io {

// The past of a map, `NAME.past` beside `NAME.surfaces`: its states at the ends of earlier sessions.
//
//   8 bytes   magic: 89 'O' 'C' 'T' 'P' 'S' 0D 0A
//   the rest  records as in a map file (record_stream.hpp), each a `PastRecord` of map_file.proto: of each
//             session, oldest first, a Session and behind it in chunks its undo; one Footer as a map file's
//
// An undo makes the head and decompressed records of the map file before the session from those after it: it
// is a zstd frame with the latter as its prefix, so that it holds what changed. Checking out a session undoes
// all later ones, and gives surfaces, octree, ids, everything but kept scans.
//
// During a session `NAME.before` is the map file that the session began with, by a hard link. In the end the
// map is saved, then its past, and the link removed; so after a kill at any moment either the past knows the
// map, or it knows `NAME.before`, from which the next session then counts. The map itself is read without its
// past.

/// A run that made a map, or went on with it.
struct Session {
  double date_s = 0;  ///< s since 1970, UTC, of its end; 0: not known
  std::uint64_t revision = 0, scans = 0, surfaces = 0;
  double area_m2 = 0;
  std::vector<SurfaceId> appeared, changed, gone, merged;  ///< of surfaces, against the session before
  FileSum map;                                             ///< file after it
  FileSum before;                                          ///< file before it; of 0 bytes: none is known
  std::uint64_t before_plain = 0;                          ///< bytes of its records
  std::string undo;
};

/// Oldest first; the last is that of the map, or of NAME.before. Empty: no past is known of it. Throws
/// Error(data) if NAME.past is damaged.
std::vector<Session> sessions_of(const std::filesystem::path& stem);

/// The map after sessions[at]. Throws Error(data) for damage.
Map map_after(const std::filesystem::path& stem, const std::vector<Session>& sessions, std::size_t at);

/// Keeps the past of a run.
class PastKeeper {
 public:
  /// `resumed`: the map that is gone on with, as `start`; empty: none.
  PastKeeper(std::filesystem::path stem, const std::filesystem::path& resumed, const Map& start);
  PastKeeper(const PastKeeper&) = delete;
  PastKeeper& operator=(const PastKeeper&) = delete;
  ~PastKeeper();

  /// Revision after the last session before this one.
  std::optional<std::uint64_t> since() const {
    return sessions_.empty() ? std::nullopt : std::optional(sessions_.back().revision);
  }
  /// Before the map is saved for the first time: until then the files are those of the run before.
  void begin();
  /// After the map has been saved in `stem`; `changes` since then. Throws Error(output).
  void save(const Map& map, double date_s, const MapChanges& changes);
  /// Of the session in the file; sessions in it.
  std::uint64_t bytes() const { return bytes_; }
  std::size_t sessions() const { return sessions_.size(); }
  /// Of a damaged past, or one of another map; empty: none.
  const std::string& warning() const { return warning_; }

 private:
  std::filesystem::path stem_, resumed_;  // the latter: the file that the last session known of is of
  bool resumes_, begun_ = false;
  std::vector<Session> sessions_;
  std::uint64_t bytes_ = 0;
  std::string warning_;
};

}  // namespace octosurf::io
