#include "pose_log.hpp"

#include "io/new_file.hpp"
#include "io/readers/pose_file.hpp"

#include <cstdio>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

PoseLog::PoseLog(std::string file, bool force, const Eigen::Vector3d& origin)
    : file_(std::move(file)), force_(force), origin_(origin) {
  if (!file_.empty()) io::NewFile(file_, force_);  // or the run would be for nothing
}

void PoseLog::add(double stamp_s, const Eigen::Isometry3d& T_map_sensor) {
  if (file_.empty()) return;
  lines_ += io::tum_line(stamp_s, Eigen::Translation3d(origin_) * T_map_sensor);
  lines_ += '\n';
}

void PoseLog::save(Saving saving) try {
  if (file_.empty()) return;
  io::write_file(file_, force_, [&](std::ostream& out) {
    out << "# stamp tx ty tz qx qy qz qw, sensor to map\n" << lines_;
  });
  force_ = true;  // from now on it is ours
  failing_ = false;
} catch (const Error& error) {
  if (saving == Saving::end) throw;
  if (!std::exchange(failing_, true)) std::fprintf(stderr, "warning: %s; the run goes on\n", error.what());
}

}  // namespace octosurf
