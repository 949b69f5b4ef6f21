#include "io/readers/pose_file.hpp"

#include "io/text_file.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::io {
namespace {

constexpr double quaternion_tolerance = 1e-2;
constexpr double nearest_within_s = 0.02;  // TUM's associate.py

[[noreturn]] void refuse_poses(const std::string& where, const std::string& what) {
  throw Error(Error::Kind::data, where, what,
              "a pose is 7, 8 (with time stamp), 12 or 16 numbers in a line, or four lines of 4");
}

Eigen::Isometry3d pose_of_seven(const double* v) {
  return pose_from({v[0], v[1], v[2]}, Eigen::Quaterniond(v[6], v[3], v[4], v[5]));
}

/// A 4×4; its last row may carry a time stamp in place of the 1 (HKU-MARS' alidarPose.csv).
FilePose from_matrix(const std::vector<double>& v, const std::string& where) {
  if (v[12] != 0 || v[13] != 0 || v[14] != 0)
    refuse_poses(where, "the last row of a 4x4 pose is not 0 0 0 1 (or 0 0 0 TIME)");
  return {pose_from_rows(v), v[15], where};
}

/// A last row of 0 0 0 1 in every pose is no time stamp.
void keep_only_real_stamps(std::vector<FilePose>& poses) {
  if (std::any_of(poses.begin(), poses.end(), [](const FilePose& p) { return p.stamp_s != 1.0; })) return;
  for (auto& pose : poses) pose.stamp_s.reset();
}

std::vector<FilePose> read_blocks(const std::vector<TextLine>& lines, const std::filesystem::path& file) {
  std::vector<FilePose> poses;
  for (std::size_t first = 0; first < lines.size(); first += 4) {
    std::vector<double> values;
    for (std::size_t row = first; row < std::min(first + 4, lines.size()); ++row) {
      const auto four = numbers(lines[row], file);
      if (four.size() != 4)
        refuse_poses(at_line(file, lines[row].number),
                     std::to_string(four.size()) + " numbers where 4 were expected");
      values.insert(values.end(), four.begin(), four.end());
    }
    if (values.size() != 16)
      refuse_poses(at_line(file, lines[first].number), "a 4x4 pose breaks off at the end of the file");
    poses.push_back(from_matrix(values, at_line(file, lines[first].number)));
  }
  return poses;
}

FilePose read_line(const TextLine& line, std::size_t columns, const std::filesystem::path& file) {
  const auto values = numbers(line, file);
  const std::string where = at_line(file, line.number);
  if (values.size() != columns)
    refuse_poses(where, std::to_string(values.size()) + " numbers where " + std::to_string(columns) +
                            " were expected");
  if (columns == 7) return {pose_of_seven(values.data()), {}, where};
  if (columns == 8) return {pose_of_seven(values.data() + 1), values[0], where};
  if (columns == 12) return {pose_from_rows(values), {}, where};
  if (columns == 16) return from_matrix(values, where);
  refuse_poses(where, std::to_string(columns) + " numbers are no pose");
}

}  // namespace

PoseFile read_poses(const std::filesystem::path& file) {
  const auto lines = read_text(file);
  if (lines.empty()) refuse_poses(file.string(), "holds no poses");
  const std::size_t columns = lines.front().words.size();
  PoseFile result{file, {}, false, columns == 12};
  if (columns == 4) {
    result.poses = read_blocks(lines, file);
  } else {
    result.poses.reserve(lines.size());
    for (const auto& line : lines) result.poses.push_back(read_line(line, columns, file));
  }
  if (columns == 4 || columns == 16) keep_only_real_stamps(result.poses);
  result.stamped = result.poses.front().stamp_s.has_value();
  for (const auto& pose : result.poses)
    if (pose.stamp_s && !std::isfinite(*pose.stamp_s))
      refuse_poses(pose.where, "the time stamp is not finite");
  return result;
}

std::string tum_line(double stamp_s, const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.linear()).normalized();
  const Eigen::Vector3d t = T.translation();
  std::string line;
  for (const double value : {stamp_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    std::array<char, 32> text{};
    // The shortest text that reads back as the same number; without an exponent where that is readable.
    const bool plain = value == 0 || (std::fabs(value) >= 1e-6 && std::fabs(value) < 1e15);
    const auto format = plain ? std::chars_format::fixed : std::chars_format::general;
    char* const end = std::to_chars(text.data(), text.data() + text.size(), value, format).ptr;
    if (!line.empty()) line += ' ';
    line.append(text.data(), end);
  }
  return line;
}

Eigen::Isometry3d rigid(const Eigen::Isometry3d& T, const std::string& where) {
  require_rigid(T, where);
  // The nearest rotation (Frobenius norm): R = U Vᵀ.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(T.linear(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d result = T;
  result.linear() = svd.matrixU() * svd.matrixV().transpose();
  return result;
}

Eigen::Isometry3d pose_from(const Eigen::Vector3d& translation, const Eigen::Quaterniond& q) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = translation;
  const bool unit = std::abs(q.norm() - 1) <= quaternion_tolerance;
  // |q|² R is the quaternion's homogeneous matrix: a rotation only if q is a unit quaternion.
  T.linear() = (unit ? 1.0 : q.squaredNorm()) * q.normalized().toRotationMatrix();
  return T;
}

Eigen::Isometry3d pose_from_rows(const std::vector<double>& v) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v.data());
  return T;
}

Eigen::Isometry3d pose_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double t) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = (1 - t) * a.translation() + t * b.translation();
  T.linear() = Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  return T;
}

Trajectory::Trajectory(const PoseFile& file, double largest_gap_s)
    : poses_(file.poses), largest_gap_s_(largest_gap_s) {
  std::ranges::stable_sort(poses_, {}, &FilePose::stamp_s);
}

Trajectory::Neighbours Trajectory::around(double stamp_s) const {
  const auto after =
      std::ranges::lower_bound(poses_, stamp_s, {}, [](const FilePose& pose) { return *pose.stamp_s; });
  Neighbours found;
  if (after != poses_.end()) found.after = &*after;
  if (after != poses_.begin()) found.before = &*std::prev(after);
  const auto distance = [&](const FilePose* pose) {
    return pose ? std::abs(*pose->stamp_s - stamp_s) : std::numeric_limits<double>::infinity();
  };
  found.nearest = distance(found.before) < distance(found.after) ? found.before : found.after;
  if (distance(found.nearest) > std::min(nearest_within_s, largest_gap_s_)) found.nearest = nullptr;
  if (!found.before || !found.after || *found.after->stamp_s - *found.before->stamp_s > largest_gap_s_)
    found.before = found.after = nullptr;
  return found;
}

bool Trajectory::covers(double stamp_s) const {
  const auto found = around(stamp_s);
  return found.before || found.nearest;
}

Eigen::Isometry3d Trajectory::at(double stamp_s, const std::string& where) const {
  const auto found = around(stamp_s);
  const auto checked = [&](const FilePose& pose) {
    return rigid(pose.T, where + " (pose at " + pose.where + ")");
  };
  if (!found.before) return checked(*found.nearest);
  if (*found.after->stamp_s == stamp_s) return checked(*found.after);  // bit by bit, without rounding
  const Eigen::Isometry3d a = checked(*found.before), b = checked(*found.after);
  const double t = (stamp_s - *found.before->stamp_s) / (*found.after->stamp_s - *found.before->stamp_s);
  return pose_between(a, b, t);
}

}  // namespace octosurf::io
