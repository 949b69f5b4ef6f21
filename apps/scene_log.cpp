#include "scene_log.hpp"

#include <cstdio>
#include <utility>

namespace octosurf {

SceneLog::SceneLog(std::string file, bool force, const Eigen::Vector3d& up) : name_(std::move(file)) {
  if (name_.empty()) return;
  file_.emplace(name_, force);
  file_->write([](std::ostream&) {});
  out_.open(file_->temporary(), std::ios::binary | std::ios::app);
  log_.emplace(out_, up);
}

void SceneLog::add_pose(double stamp_s, const Eigen::Isometry3d& T_map_sensor) {
  if (!log_ || failing_) return;
  log_->add_pose(stamp_s, T_map_sensor);
  warn_of_failure();
}

void SceneLog::add_surfaces(double stamp_s, const Mapper& mapper) {
  if (!log_ || failing_) return;
  log_->add_changes(stamp_s, *mapper.snapshot());
  warn_of_failure();
}

void SceneLog::save(double stamp_s, const Snapshot& snapshot) {
  if (!log_) return;
  if (!failing_) {
    log_->add_surfaces(stamp_s, snapshot);
    log_->finish();
    out_.close();
  }
  if (!out_) throw failure();
  file_->commit();
}

Error SceneLog::failure() const {
  return Error(Error::Kind::output, name_, "cannot be written",
               "check the folder, its rights and the space left");
}

void SceneLog::warn_of_failure() {
  if (out_) return;
  failing_ = true;
  std::fprintf(stderr, "warning: %s; the run goes on\n", failure().what());
}

}  // namespace octosurf
