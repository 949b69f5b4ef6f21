#pragma once

#include "io/exporters/foxglove_log.hpp"
#include "io/new_file.hpp"
#include "run_observer.hpp"

#include <fstream>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// Records the surfaces and sensor poses of a run over time, as a file for Foxglove (`--mcap`). Written
/// during mapping, and put in place at the end.
class SceneLog : public RunObserver {
 public:
  /// Of a mapper that outlives it. Throws Error(output), Error(usage).
  SceneLog(std::string file, bool force, const Mapper& mapper);

  // A failed write is reported once on stderr; the run continues.
  void after(const InsertedScan& inserted) override;
  void changed(double stamp_s) override;
  /// At the end adds all surfaces and finishes the file; throws Error(output), Error(usage).
  void save(Saving saving) override;

 private:
  Error failure() const;
  void warn_of_failure();

  std::string name_;
  const Mapper& mapper_;
  io::NewFile file_;
  std::ofstream out_;
  io::FoxgloveLog log_;
  double stamp_s_ = 0;  // of the last change
  bool failing_ = false;
};

}  // namespace octosurf
