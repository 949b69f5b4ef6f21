#include "check/rows.hpp"

#include "io/text_file.hpp"
#include "sensing/downsample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>

namespace octosurf::check {
namespace {

using judgement::CommonParameters;
using Meanings = std::vector<Meaning>;

CommonParameters free_at(std::initializer_list<int> places) {
  CommonParameters free = CommonParameters::Zero();
  for (const int place : places) free[place] = 1;
  return free;
}

/// `from`, but for one field.
template <class Field>
Meaning with(Meaning from, Field Meaning::*field, const std::type_identity_t<Field>& value) {
  from.*field = value;
  return from;
}

/// Words without numbers.
auto always(const std::string& text) {
  return [text](const Recording&, const Meaning&) { return text; };
}

/// The 48 matrices that swap and reverse axes; those of det 1, the identity among them, first.
const std::vector<Eigen::Matrix3d>& axes() {
  static const std::vector<Eigen::Matrix3d> all = [] {
    std::vector<Eigen::Matrix3d> turns, mirrors;
    std::array<int, 3> order{0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
        for (int i = 0; i < 3; ++i) matrix(order[static_cast<std::size_t>(i)], i) = (signs >> i & 1) ? -1 : 1;
        (matrix.determinant() > 0 ? turns : mirrors).push_back(matrix);
      }
    } while (std::ranges::next_permutation(order).found);
    turns.insert(turns.end(), mirrors.begin(), mirrors.end());
    return turns;
  }();
  return all;
}
constexpr std::size_t turns = 24;

/// "z, -x, -y": where a frame's axes point.
std::string text_of(const Eigen::Matrix3d& matrix) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    int axis = 0;
    matrix.col(i).cwiseAbs().maxCoeff(&axis);
    text += std::string(i == 0 ? "" : ", ") + (matrix(axis, i) < 0 ? "-" : "") + "xyz"[axis];
  }
  return text;
}

// Forms of the poses, and axes of the sensor.

Meanings forms(const Recording&, const Meaning& from) {
  Meanings all;
  for (const auto rotation : {Meaning::Rotation::as_given, Meaning::Rotation::inverse_pose,
                              Meaning::Rotation::transposed, Meaning::Rotation::w_first})
    for (std::size_t axis = 0; axis < turns; ++axis)
      for (const bool mirrored : {false, true}) {
        Meaning meaning = from;
        meaning.rotation = rotation;
        meaning.sensor_axes = axes()[axis];
        meaning.mirrored = mirrored;
        if (rotation != Meaning::Rotation::as_given || axis > 0 || mirrored) all.push_back(meaning);
      }
  return all;
}

std::string words_of_form(const Recording&, const Meaning& meaning) {
  std::string text;
  const auto add = [&](const std::string& words) { text += (text.empty() ? "" : "; ") + words; };
  if (meaning.rotation == Meaning::Rotation::inverse_pose) add("poses are inverse: of the map in the sensor");
  if (meaning.rotation == Meaning::Rotation::transposed) add("the poses' rotations are inverse");
  if (meaning.rotation == Meaning::Rotation::w_first) add("the poses' quaternions are qw qx qy qz");
  if (meaning.mirrored) add("readings are mirrored: their y axis is reversed");
  if (!meaning.sensor_axes.isIdentity())
    add("poses are of a frame in which the sensor's x, y, z are " + text_of(meaning.sensor_axes));
  return text;
}

Meanings positions(const Recording&, const Meaning& from) {
  Meanings all;
  for (std::size_t axis = 1; axis < axes().size(); ++axis)
    all.push_back(with(from, &Meaning::position_axes, axes()[axis]));
  // Of those that fit alike, as heights that never change have either sign, what changes least.
  std::ranges::stable_sort(all, std::greater<>(), [](const Meaning& m) { return m.position_axes.trace(); });
  return all;
}

std::string words_of_positions(const Recording&, const Meaning& meaning) {
  return "the poses' positions have other axes than their rotations: x, y, z are " +
         text_of(meaning.position_axes.transpose());
}

// Numbers.

/// Scales from 1/1500 to 1500, so that units of mm are among them.
Meanings scales(const Recording&, const Meaning& from) {
  constexpr double step = 1.1, most = 1500;
  Meanings all;
  for (double scale = step; scale < most; scale *= step)
    for (const double one : {scale, 1 / scale}) all.push_back(with(from, &Meaning::pose_scale, one));
  all.push_back(from);
  return all;
}

std::string words_of_scale(const Recording&, const Meaning& meaning) {
  if (meaning.pose_scale != 1)
    return io::formatted("the poses' unit is not that of the readings: positions times %.4g fit them",
                         meaning.pose_scale);
  return io::formatted(
      "readings are %.4g times as long as positions have it (or positions are to be %.4g times "
      "as long)",
      1 / meaning.readings_scale, 1 / meaning.readings_scale);
}

Meanings delays(const Recording&, const Meaning& from) {
  Meanings all;
  for (double late = 0.5; late <= 6; late += 0.5)
    for (const double one : {late, -late}) all.push_back(with(from, &Meaning::late, one));
  return all;
}

std::string words_of_delay(const Recording& recording, const Meaning& meaning) {
  const auto& poses = recording.poses();
  const double seconds =
      (poses.back().stamp_s - poses.front().stamp_s) / static_cast<double>(poses.size() - 1);
  return io::formatted("poses are those of %.3g scans (%.3g s) %s", std::fabs(meaning.late),
                       seconds * std::fabs(meaning.late), meaning.late > 0 ? "before" : "later");
}

Meanings itself(const Recording&, const Meaning& from) { return {from}; }

std::string words_of_mount(const Recording&, const Meaning& meaning) {
  const Eigen::AngleAxisd turn(meaning.mount.linear());
  const Eigen::Vector3d degrees = turn.angle() * 180 / std::numbers::pi * turn.axis(),
                        shift = meaning.mount.translation();
  return io::formatted(
      "the sensor is turned by %.2f, %.2f, %.2f degrees about x, y, z and shifted by %.3f, "
      "%.3f, %.3f m against where poses have it",
      degrees.x(), degrees.y(), degrees.z(), shift.x(), shift.y(), shift.z());
}

Meanings focals(const Recording& recording, const Meaning& from) {
  Meanings all;
  if (!recording.is_camera()) return all;
  for (double factor = 0.5; factor < 2; factor *= 1.05) all.push_back(with(from, &Meaning::focal, factor));
  return all;
}

std::string words_of_focal(const Recording&, const Meaning& meaning) {
  return io::formatted("the camera's focal lengths are %.3f times those given", meaning.focal) +
         (meaning.aside.norm() < 0.01 ? ""
                                      : io::formatted(", its principal point %.3f, %.3f of them less",
                                                      meaning.aside.x(), meaning.aside.y()));
}

// What readings are.

Meanings ranges(const Recording& recording, const Meaning& from) {
  return recording.is_camera() ? Meanings{with(from, &Meaning::reading, Meaning::Reading::range)}
                               : Meanings{};
}

/// Depths of a room from a value that falls with them.
Meanings inverse_depths(const Recording& recording, const Meaning& from) {
  Meanings all;
  if (!recording.is_camera()) return all;
  const double median = recording.median_range();
  for (double depth = 0.3; depth < 8; depth *= 1.1) {
    all.push_back(from);
    all.back().reading = Meaning::Reading::inverse_depth;
    all.back().constant = depth * median;
  }
  return all;
}

std::string words_of_inverse_depth(const Recording&, const Meaning& meaning) {
  return io::formatted("depth images hold inverse depth or disparity: depth is some %.3g over it",
                       meaning.constant);
}

Meanings in_map(const Recording&, const Meaning& from) {
  return {with(from, &Meaning::reading, Meaning::Reading::in_map)};
}

Meanings without_return(const Recording& recording, const Meaning& from) {
  const auto range = recording.most_frequent_range();
  return range ? Meanings{with(from, &Meaning::no_return, range)} : Meanings{};
}

std::string words_of_no_return(const Recording&, const Meaning& meaning) {
  return io::formatted("many readings are %.3f m, which stands for no return", *meaning.no_return);
}

// Scans.

constexpr auto has_oddity = [](const auto& pose) { return pose.oddity.has_value(); };

Meanings without_odd(const Recording& recording, const Meaning& from) {
  return std::ranges::any_of(recording.poses(), has_oddity)
             ? Meanings{with(from, &Meaning::without_odd, true)}
             : Meanings{};
}

std::string words_of_odd(const Recording& recording, const Meaning&) {
  return io::formatted(
      "%zu of %zu scans have the readings or the pose of the one before, or the identity as pose",
      static_cast<std::size_t>(std::ranges::count_if(recording.poses(), has_oddity)),
      recording.poses().size());
}

Meanings sessions(const Recording& recording, const Meaning& from) {
  const auto jump = recording.jump();
  return jump ? Meanings{with(from, &Meaning::first_session, *jump)} : Meanings{};
}

std::string words_of_sessions(const Recording& recording, const Meaning& meaning) {
  return "poses jump at " + recording.poses()[meaning.first_session].name +
         ": from there on they are of another session or frame";
}

}  // namespace

std::vector<Meaning> common_forms() {
  const Eigen::Matrix3d opengl = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Eigen::Matrix3d body = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  Meanings all;
  for (const auto rotation : {Meaning::Rotation::inverse_pose, Meaning::Rotation::w_first})
    all.emplace_back().rotation = rotation;
  for (const Eigen::Matrix3d& sensor_axes : {opengl, body, Eigen::Matrix3d(body.transpose())})
    all.emplace_back().sensor_axes = sensor_axes;
  all.emplace_back(all.front()).sensor_axes = opengl;
  return all;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> table{
      {without_odd, words_of_odd},  // first what stands out by itself
      {sessions, words_of_sessions},
      {forms, words_of_form},
      {scales, words_of_scale, free_at({6})},
      {positions, words_of_positions},
      {delays, words_of_delay, free_at({8})},
      {focals, words_of_focal, free_at({7, 9, 10})},
      {itself, words_of_mount, free_at({0, 1, 2, 3, 4, 5})},
      {ranges, always("depth images hold distances from the camera's centre, not depths along its axis")},
      {inverse_depths, words_of_inverse_depth, free_at({6})},
      {without_return, words_of_no_return},
      {in_map, always("clouds lie in the map's frame already; poses say only where they were seen from")},
  };
  return table;
}

void settle_scale(const Recording& recording, Meaning& meaning) {
  const double scale = meaning.pose_scale;
  if (scale == 1) return;
  // Readings are right if they reach as far as a room is wide, and poses are in a unit that people use.
  const double range = recording.median_range();
  constexpr double nearest = 0.2, farthest = 100, close = 1.03;
  const double reach = recording.is_camera() ? sensing::depth_camera_max_range : farthest;
  const auto plausible = [&](double metres) { return metres > nearest && metres < reach; };
  const auto is_close = [&](double a, double b) { return a < close * b && b < close * a; };
  const bool unit = std::ranges::any_of(std::array{1e-3, 1e-2, 0.3048, 100.0, 1e3},
                                        [&](double metres) { return is_close(scale, metres); });
  if (plausible(range) && (unit || !recording.is_camera() || !plausible(range / scale))) return;
  meaning.readings_scale = 1 / scale;
  meaning.pose_scale = 1;
}

}  // namespace octosurf::check
