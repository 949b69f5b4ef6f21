#include "scene_log.hpp"

#include <cstdio>
#include <utility>

namespace octosurf {
namespace {

std::ofstream opened(io::NewFile& file) {
  file.write([](std::ostream&) {});
  return std::ofstream(file.temporary(), std::ios::binary | std::ios::app);
}

}  // namespace

SceneLog::SceneLog(std::string file, bool force, const Mapper& mapper)
    : name_(std::move(file)),
      mapper_(mapper),
      file_(name_, force),
      out_(opened(file_)),
      log_(out_, mapper.map().parameters().up.value_or(Eigen::Vector3d::UnitZ())) {}

void SceneLog::after(const InsertedScan& inserted) {
  if (failing_) return;
  log_.add_pose(inserted.scan.stamp_s, inserted.report.alignment.T_map_sensor);
  warn_of_failure();
}

void SceneLog::changed(double stamp_s) {
  stamp_s_ = stamp_s;
  if (failing_) return;
  log_.add_changes(stamp_s, *mapper_.snapshot());
  warn_of_failure();
}

void SceneLog::save(Saving saving) {
  if (saving == Saving::checkpoint) return;
  if (!failing_) {
    log_.add_surfaces(stamp_s_, *mapper_.snapshot());
    log_.finish();
    out_.close();
  }
  if (!out_) throw failure();
  file_.commit();
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
