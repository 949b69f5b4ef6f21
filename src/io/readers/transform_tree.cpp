#include "io/readers/transform_tree.hpp"

#include "io/readers/pose_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::int64_t nearest_within_ns = 20000000;  // as for pose files

/// pose_from()'s limit: a quaternion of single precision is off by 1e-7, one that is off by 1 % is damaged.
bool is_pose(const PoseTrack::Sample& sample) {
  return sample.translation.allFinite() && std::abs(sample.rotation.norm() - 1) <= 1e-2;
}

std::string seconds(std::int64_t ns) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3f s", static_cast<double>(ns) / 1e9);
  return text.data();
}

Eigen::Isometry3d transform(const PoseTrack::Sample& sample) try {
  return rigid(pose_from(sample.translation, Eigen::Quaterniond(sample.rotation)),
               "pose at " + seconds(sample.stamp_ns));
} catch (const Error& error) {  // the caller adds the scan
  throw std::runtime_error(error.what());
}

/// b − a, or the largest number if that overflows; a ≤ b.
std::int64_t distance(std::int64_t a, std::int64_t b) {
  const auto apart = static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
  return static_cast<std::int64_t>(std::min<std::uint64_t>(apart, std::numeric_limits<std::int64_t>::max()));
}

}  // namespace

bool is_map_frame(std::string_view frame) {
  constexpr std::array<std::string_view, 5> names{"map", "odom", "world", "earth", "camera_init"};
  frame.remove_prefix(frame.rfind('/') + 1);  // a robot's namespace; npos + 1 is 0
  return std::ranges::find(names, frame) != names.end();
}

void PoseTrack::finish() {
  if (std::ranges::any_of(samples_, is_pose))
    left_out_ += std::erase_if(samples_, [](const Sample& sample) { return !is_pose(sample); });
  std::ranges::stable_sort(samples_, {}, &Sample::stamp_ns);
  // Of equal times keep the last: unique() over the reversed sequence keeps its first.
  const auto kept = std::unique(samples_.rbegin(), samples_.rend(),
                                [](const Sample& a, const Sample& b) { return a.stamp_ns == b.stamp_ns; });
  samples_.erase(samples_.begin(), kept.base());
}

void PoseTrack::forget_before(std::int64_t stamp_ns) {
  samples_.erase(samples_.begin(), std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns));
}

PoseTrack::At PoseTrack::at(std::int64_t stamp_ns, std::int64_t gap_ns) const {
  const auto after = std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns);
  if (after != samples_.end() && after->stamp_ns == stamp_ns) return {after->parent, transform(*after)};
  if (after == samples_.begin() || after == samples_.end()) {
    if (samples_.empty()) throw NoPose("there is none");
    const Sample& nearest = after == samples_.end() ? samples_.back() : samples_.front();
    const std::int64_t away =
        distance(std::min(nearest.stamp_ns, stamp_ns), std::max(nearest.stamp_ns, stamp_ns));
    if (away <= std::min(nearest_within_ns, gap_ns)) return {nearest.parent, transform(nearest)};
    throw NoPose(std::string(after == samples_.end() ? "the last is " : "the first is ") + seconds(away) +
                 (after == samples_.end() ? " earlier" : " later"));
  }
  const Sample &a = *std::prev(after), &b = *after;
  const std::int64_t apart = distance(a.stamp_ns, b.stamp_ns);
  if (apart > gap_ns) throw NoPose("its neighbours in time are " + seconds(apart) + " apart");
  if (a.parent != b.parent) throw NoPose("its parent changes between its neighbours in time");
  return {a.parent, pose_between(transform(a), transform(b),
                                 static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(apart))};
}

std::uint32_t TransformTree::index_of(const std::string& frame) {
  const auto [found, is_new] = indices_.emplace(frame, static_cast<std::uint32_t>(frames_.size()));
  if (is_new) frames_.push_back({frame, {}, {}});
  return found->second;
}

void TransformTree::add(const Edge& edge, PoseTrack::Sample sample) {
  sample.parent = index_of(edge.parent);
  Frame& child = frames_[index_of(edge.child)];
  if (edge.fixed && (is_pose(sample) || !child.fixed))
    child.fixed = sample;
  else if (!edge.fixed)
    child.track.add(sample);
}

void TransformTree::finish() {
  for (Frame& frame : frames_) frame.track.finish();
}

std::pair<std::size_t, std::string> TransformTree::left_out() const {
  std::pair<std::size_t, std::string> all;
  for (const Frame& frame : frames_) {
    if (all.first == 0) all.second = frame.name;
    all.first += frame.track.left_out();
  }
  return all;
}

void TransformTree::keep_last(std::int64_t duration_ns) {
  for (Frame& frame : frames_)
    if (!frame.track.samples().empty())
      frame.track.forget_before(frame.track.samples().back().stamp_ns - duration_ns);
}

std::optional<std::uint32_t> TransformTree::parent_of(const Frame& frame) const {
  if (!frame.track.samples().empty()) return frame.track.samples().front().parent;
  return frame.fixed ? std::optional(frame.fixed->parent) : std::nullopt;
}

std::vector<std::uint32_t> TransformTree::children_of(std::uint32_t frame) const {
  std::vector<std::uint32_t> children;
  for (std::uint32_t i = 0; i < frames_.size(); ++i)
    if (parent_of(frames_[i]) == frame) children.push_back(i);
  return children;
}

std::vector<std::string> TransformTree::ancestors(const std::string& frame) const {
  std::vector<std::string> names;
  auto found = indices_.find(frame);
  if (found == indices_.end()) return names;
  for (std::optional<std::uint32_t> at = found->second; at && names.size() <= frames_.size();) {
    const Frame& f = frames_[*at];
    names.push_back(f.name);
    at = parent_of(f);
  }
  return names;
}

bool TransformTree::moves(const std::string& frame) const {
  const auto names = ancestors(frame);
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return !frames_[indices_.at(name)].track.samples().empty();
  });
}

std::string TransformTree::robot_below(const std::string& frame) const {
  const auto found = indices_.find(frame);
  if (found == indices_.end()) return {};
  std::uint32_t at = found->second;
  const auto moving = [&](std::uint32_t i) { return !frames_[i].track.samples().empty(); };
  for (std::size_t steps = 0; steps < frames_.size(); ++steps) {
    std::vector<std::uint32_t> children = children_of(at);
    const bool stands = at == found->second || is_map_frame(frames_[at].name);
    if (stands)
      std::erase_if(children, [&](std::uint32_t i) { return !moving(i) && !is_map_frame(frames_[i].name); });
    if (children.size() == 1 && (stands || !moving(children.front())))
      at = children.front();
    else
      return stands ? std::string() : frames_[at].name;
  }
  return {};  // a ring
}

std::optional<std::int64_t> TransformTree::newest(const std::string& to, const std::string& from) const {
  std::int64_t earliest = std::numeric_limits<std::int64_t>::max();
  if (to == from) return earliest;
  const std::vector<std::string> above = ancestors(from), above_target = ancestors(to);
  const auto met = std::find_first_of(above.begin(), above.end(), above_target.begin(), above_target.end());
  if (met == above.end()) return {};
  const auto note = [&](const std::string& name) {
    const auto& samples = frames_[indices_.at(name)].track.samples();
    if (!samples.empty()) earliest = std::min(earliest, samples.back().stamp_ns);
  };
  std::for_each(above.begin(), met, note);
  std::for_each(above_target.begin(), std::find(above_target.begin(), above_target.end(), *met), note);
  return earliest;
}

void TransformTree::forget_moving() {
  for (Frame& frame : frames_) frame.track = {};
}

TransformTree::Way TransformTree::up(std::uint32_t start, std::optional<std::uint32_t> stop,
                                     std::int64_t stamp_ns, std::int64_t gap_ns) const {
  Way way{{{start, Eigen::Isometry3d::Identity()}}, {}};
  while (way.steps.back().frame != stop) {
    const Step& last = way.steps.back();
    const Frame& frame = frames_[last.frame];
    PoseTrack::At at;
    if (!frame.track.samples().empty()) {
      try {
        at = frame.track.at(stamp_ns, gap_ns);
      } catch (const NoPose& none) {  // ignored if the other frame is below this one
        way.broken = "no pose of frame " + frame.name + " at its time: " + none.what();
        break;
      }
    } else if (frame.fixed) {
      at = {frame.fixed->parent, transform(*frame.fixed)};
    } else {
      break;  // the root
    }
    if (way.steps.size() > frames_.size())
      throw NoPose("the frames above " + frames_[start].name + " form a ring");
    way.steps.push_back({at.parent, at.T_parent_child * last.T_frame_start});
  }
  return way;
}

Eigen::Isometry3d TransformTree::lookup(const std::string& to, const std::string& from, std::int64_t stamp_ns,
                                        std::int64_t gap_ns) const {
  if (to == from) return Eigen::Isometry3d::Identity();
  const auto target = indices_.find(to), source = indices_.find(from);
  if (source == indices_.end()) throw NoPose("tf has no frame '" + from + "'");
  if (target == indices_.end()) throw NoPose("tf has no frame '" + to + "'");
  const Way way = up(source->second, target->second, stamp_ns, gap_ns);
  if (way.steps.back().frame == target->second) return way.steps.back().T_frame_start;
  const Way back = up(target->second, {}, stamp_ns, gap_ns);
  for (const Step& step : back.steps)
    for (const Step& other : way.steps)
      if (other.frame == step.frame) return step.T_frame_start.inverse() * other.T_frame_start;
  if (!way.broken.empty() || !back.broken.empty())
    throw NoPose(way.broken.empty() ? back.broken : way.broken);
  throw NoPose("tf does not connect " + from + " with " + to);
}

}  // namespace octosurf::io
