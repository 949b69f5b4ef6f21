#include "io/readers/pose_file.hpp"

#include "io/text_file.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <regex>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::io {
namespace {

constexpr double quaternion_tolerance = 1e-2;

[[noreturn]] void refuse_poses(const std::string& where, const std::string& what) {
  throw Error(Error::Kind::data, where, what,
              "a pose is 7, 12 or 16 numbers in a line, with a time stamp before or not, or four lines of 4; "
              "headings begin with #, and name the columns of EuRoC's 17");
}

bool is_unit(const Eigen::Vector4d& q) { return std::abs(q.norm() - 1) <= quaternion_tolerance; }

FilePose of_quaternion(const Eigen::Vector3d& translation, const Eigen::Quaterniond& q,
                       const std::optional<double>& stamp, const std::string& where) {
  return {pose_from(translation, q), stamp, where, q};
}

/// A 4×4; its last row may carry a time stamp in place of the 1 (HKU-MARS' alidarPose.csv).
FilePose from_matrix(const std::vector<double>& v, const std::string& where) {
  if (v[12] != 0 || v[13] != 0 || v[14] != 0)
    refuse_poses(where, "the last row of a 4x4 pose is not 0 0 0 1 (or 0 0 0 TIME)");
  return {pose_from_rows(v), v[15], where};
}

/// A last row of 0 0 0 1 in every pose is no time stamp.
void keep_only_real_stamps(std::vector<FilePose>& poses) {
  if (std::ranges::any_of(poses, [](const FilePose& p) { return p.stamp_s != 1.0; })) return;
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
  auto v = numbers(line, file);
  const std::string where = at_line(file, line.number);
  if (v.size() != columns)
    refuse_poses(where,
                 std::to_string(v.size()) + " numbers where " + std::to_string(columns) + " were expected");
  std::optional<double> stamp;
  if (columns == 9) v.pop_back();  // an id, of RTAB-Map
  if (columns == 8 || columns == 9 || columns == 13 || columns == 17) {
    stamp = v.front();
    v.erase(v.begin());
  }
  if (v.size() == 7) return of_quaternion({v[0], v[1], v[2]}, {v[6], v[3], v[4], v[5]}, stamp, where);
  if (v.size() == 12) return {pose_from_rows(v), stamp, where};
  if (v.size() == 16) {
    FilePose pose = from_matrix(v, where);
    if (stamp) pose.stamp_s = stamp;
    return pose;
  }
  refuse_poses(where, std::to_string(columns) + " numbers are no pose");
}

/// Lines with a unit quaternion at this column.
std::size_t units_at(std::size_t column, const std::vector<TextLine>& lines,
                     const std::filesystem::path& file) {
  return static_cast<std::size_t>(std::ranges::count_if(lines, [&](const TextLine& line) {
    const auto v = numbers(line, file);
    return v.size() >= column + 4 && is_unit(Eigen::Map<const Eigen::Vector4d>(v.data() + column));
  }));
}

/// Puts columns into the usual order; true: qw was first, by the heading. Throws for 7 of another meaning.
bool make_usual(std::vector<TextLine>& lines, const std::string& heading, const std::filesystem::path& file) {
  const std::size_t columns = lines.front().words.size();
  static const std::regex words(R"((q|ori)[\w.]*w\b.*(q|ori)[\w.]*x\b)", std::regex::icase);
  const bool w_first = (columns == 7 || columns == 8 || columns == 17) && std::regex_search(heading, words);
  // An index before the time, as of pandas, not RTAB-Map's id behind the pose.
  const bool indexed =
      columns == 9 && units_at(5, lines, file) == lines.size() && units_at(4, lines, file) < lines.size();
  for (auto& [_, row] : lines) {
    if (row.size() != columns) continue;
    if (indexed) row.erase(row.begin());
    if (columns == 17 && w_first) row.resize(8);  // EuRoC's velocities and biases
    if (w_first) std::rotate(row.end() - 4, row.end() - 3, row.end());
  }
  if (columns == 7 && units_at(3, lines, file) == 0)
    throw Error(Error::Kind::data, file.string(), "7 columns whose last four are no unit quaternion",
                units_at(0, lines, file) == lines.size()
                    ? "columns 1 to 4 are one: write tx ty tz qx qy qz qw"
                    : "expected are tx ty tz qx qy qz qw; for time x y z roll pitch yaw write TUM's "
                      "time tx ty tz qx qy qz qw");
  return w_first;
}

}  // namespace

PoseFile read_poses(const std::filesystem::path& file) {
  std::string heading;
  auto lines = read_text(file, &heading);
  if (lines.empty()) refuse_poses(file.string(), "holds no poses");
  const std::string& first = lines.front().words.front();
  if (first[0] == '{' || first[0] == '[')
    throw Error(Error::Kind::data, file.string(),
                "JSON, as of nerfstudio or Polycam, and brackets are not read",
                "write a line for each pose: tx ty tz qx qy qz qw, with a time stamp before or not");
  double value = 0;
  if (first[0] != '+' && std::from_chars(first.data(), first.data() + first.size(), value).ec != std::errc())
    refuse_poses(at_line(file, lines.front().number),
                 std::string("'") + printable(first.substr(0, 40)) + "' is not a number");
  const bool w_first = make_usual(lines, heading, file);
  const std::size_t columns = lines.front().words.size();
  PoseFile result{file, {}, false, columns == 12 || columns == 13, w_first};
  if (w_first) result.notes.push_back("qw is before qx, by the heading");
  if (columns == 4) {
    result.poses = read_blocks(lines, file);
  } else {
    result.poses.reserve(lines.size());
    for (const auto& line : lines) result.poses.push_back(read_line(line, columns, file));
  }
  if (columns == 4 || columns == 16 || columns == 17) keep_only_real_stamps(result.poses);
  result.stamped = result.poses.front().stamp_s.has_value();
  if (const std::string unit = result.stamped ? convert_stamps(result.poses) : ""; !unit.empty())
    result.notes.push_back("times in " + unit);
  return result;
}

bool is_good(const FilePose& pose) {
  try {
    require_rigid(pose.T, pose.where);
  } catch (const Error&) {
    return false;
  }
  return !pose.stamp_s || std::isfinite(*pose.stamp_s);
}

std::string to_seconds(std::vector<double>& stamps) {
  struct Unit {
    const char* name;
    double seconds;
  };
  constexpr std::array units{Unit{"milliseconds", 1e-3}, Unit{"microseconds", 1e-6},
                             Unit{"nanoseconds", 1e-9}};
  std::vector<double> sorted;
  for (const double stamp : stamps)
    if (std::isfinite(stamp)) sorted.push_back(stamp);
  std::ranges::sort(sorted);
  if (sorted.empty()) return {};
  const double middle = sorted[sorted.size() / 2];
  const Unit* unit = nullptr;
  constexpr double year_2001 = 1e9, year_2286 = 1e10;  // s since 1970
  for (const Unit& candidate : units)
    if (middle * candidate.seconds >= year_2001 && middle * candidate.seconds < year_2286) unit = &candidate;
  if (unit == nullptr) return {};
  for (double& stamp : stamps) stamp *= unit->seconds;
  return unit->name;
}

std::string tum_line(double stamp_s, const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.linear()).normalized();
  const Eigen::Vector3d t = T.translation();
  std::string line;
  for (const double value : {stamp_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    // Without an exponent where that is readable.
    const bool plain = value == 0 || (std::fabs(value) >= 1e-6 && std::fabs(value) < 1e15);
    if (!line.empty()) line += ' ';
    line += digits_of(value, plain ? std::chars_format::fixed : std::chars_format::general);
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
  const bool unit = is_unit(q.coeffs());
  // |q|² R is the quaternion's homogeneous matrix: a rotation only if q is a unit quaternion.
  T.linear() = (unit ? 1.0 : q.squaredNorm()) * q.normalized().toRotationMatrix();
  return T;
}

Eigen::Isometry3d pose_from_rows(const std::vector<double>& v) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v.data());
  return T;
}

Trajectory trajectory_of(const std::vector<FilePose>& poses) {
  Trajectory trajectory;
  for (const FilePose& pose : poses) {
    const Eigen::Isometry3d T = rigid(pose.T, pose.where);
    if (!std::isfinite(*pose.stamp_s))
      throw Error(Error::Kind::data, pose.where, "the time stamp is not finite");
    // As the file has it, a quaternion gives the same pose to the bit.
    trajectory.add({to_ns(*pose.stamp_s), T.translation(),
                    Eigen::Quaternion<double, Eigen::DontAlign>(
                        pose.rotation.value_or(Eigen::Quaterniond(T.linear())))});
  }
  trajectory.finish();
  return trajectory;
}

}  // namespace octosurf::io
