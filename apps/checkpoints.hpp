#pragma once

#include <cstddef>
#include <exception>
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include <octosurf/map.hpp>

namespace octosurf {

/// Saves checkpoints of a run, of the .surfaces alone, in another thread. A failed one is reported once on
/// stderr, and the run continues with the previous one.
class Checkpoints {
 public:
  /// Every `period_s` seconds; 0: never. `force`: over a map that has come, or was written, since now.
  Checkpoints(std::string stem, double period_s, bool force);

  /// The period runs from here.
  void start(double now_s) { tried_s_ = now_s; }
  bool due(double now_s) const { return period_s_ > 0 && now_s - tried_s_ >= period_s_ && !is_saving(); }
  /// Begins to save, or warns, also of the one before.
  void try_to_save(const Map& map, std::size_t scans, const KeptScans& kept);
  /// Saves both files, or throws what save_map() throws, or Error(output) for a map there that is not as this
  /// run knew it. `scans`: of this run, in the map.
  void save(const Map& map, std::size_t scans, const KeptScans& kept);

  /// In the last complete one, if there is any.
  std::optional<std::size_t> scans() const { return scans_; }
  /// Names the last complete one, or says that there is none.
  std::string last() const;

 private:
  /// Size and time of the file that is there; none: it is not.
  using Version = std::optional<std::pair<std::uintmax_t, std::filesystem::file_time_type>>;
  Version version() const;
  void require_known() const;
  bool is_saving() const;
  void finish();  ///< waits for the one that was begun
  void fail(std::size_t scans, const std::exception& error);

  std::string stem_;
  double period_s_;
  bool force_;
  Version known_;
  double tried_s_ = 0;
  std::optional<std::size_t> scans_;
  bool failing_ = false;
  std::future<void> saving_;
  std::size_t saving_scans_ = 0;
};

/// what(), or words for what has none. Valid as long as the exception.
const char* reason_of(const std::exception& error);

}  // namespace octosurf
