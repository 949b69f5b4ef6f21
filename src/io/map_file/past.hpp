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

// The past of a map, in files beside NAME.surfaces: one of each earlier session, NAME.past-BEFORE-AFTER,
// which the two states it lies between name by the CRC-32 of their map files. It is never written again.
//
//   8 bytes   magic: 89 'O' 'C' 'T' 'P' 'S' 0D 0A
//   the rest  records as in a map file (record_stream.hpp), each a `PastRecord` of map_file.proto: a Session,
//             behind it in chunks its undo, and a Footer as a map file's
//
// An undo makes the head and decompressed records of the map file before the session from those after it: it
// is a zstd frame with the latter as its prefix, so that it holds what changed. Checking out a session undoes
// all later ones, and gives surfaces, octree, ids, everything but kept scans. So what lies before a damaged
// file is lost, and nothing else. What does not fit is named and left. Older versions kept all sessions in
// NAME.past.
//
// During a session `NAME.before` is the map file that the session began with, by a hard link. In the end the
// map is saved, then its session, and the link removed; so after a kill at any moment either the past knows
// the map, or it knows `NAME.before`, from which the next session then counts. The map itself is read without
// its past.

/// A run that made a map, or went on with it.
struct Session {
  double date_s = 0;     ///< s since 1970, UTC, of its last scan, or else of its end; 0: not known
  double written_s = 0;  ///< likewise, of its end
  std::uint64_t revision = 0, scans = 0, surfaces = 0;
  double area_m2 = 0;
  std::vector<SurfaceId> appeared, changed, gone, merged;  ///< of surfaces, against the session before
  FileSum map;                                             ///< file after it
  FileSum before;                                          ///< file before it; of 0 bytes: none is known
  std::uint64_t before_plain = 0, undo_bytes = 0;          ///< bytes of its records, and of what undoes it
  std::string undo;                                        ///< while it is being read or written
  std::filesystem::path file;                              ///< that holds it
};

/// Of a map.
struct Past {
  std::vector<Session> sessions;      ///< oldest first; the last is that of `map`. Empty: none is known of it
  std::filesystem::path map;          ///< NAME.surfaces, or NAME.before
  std::vector<std::string> warnings;  ///< what cannot be read, or does not fit
};

Past past_of(const std::filesystem::path& stem);

/// The map after past.sessions[at]. Throws Error(data) for damage.
Map map_after(const Past& past, std::size_t at);

/// Keeps the past of a run.
class PastKeeper {
 public:
  /// `resumed`: the map that is gone on with; empty: none. `start`: that map, if it is in memory.
  PastKeeper(std::filesystem::path stem, const std::filesystem::path& resumed, const Map* start = nullptr);
  PastKeeper(const PastKeeper&) = delete;
  PastKeeper& operator=(const PastKeeper&) = delete;
  ~PastKeeper();

  /// Revision after the last session before this one.
  std::optional<std::uint64_t> since() const {
    return sessions().empty() ? std::nullopt : std::optional(sessions().back().revision);
  }
  /// Before the map is saved for the first time: until then the files are those of the run before.
  void begin();
  /// After the map has been saved in `stem`; `changes` since then. Throws Error(output).
  void save(const Map& map, std::optional<double> date_s, const MapChanges& changes);
  const std::vector<Session>& sessions() const { return past_.sessions; }
  /// What cannot be read, does not fit, or ends.
  const std::vector<std::string>& warnings() const { return past_.warnings; }

 private:
  void write(Session& session) const;

  std::filesystem::path stem_;
  bool resumes_, begun_ = false;
  std::filesystem::path replaced_;  // the one session of a map that is written over: nothing lies before it
  Past past_;                       // up to this run, and then with it
};

}  // namespace octosurf::io
