#include "io/readers/transform_tree.hpp"

#include <algorithm>
#include <limits>
#include <ranges>

namespace octosurf::io {
std::uint32_t TransformTree::index_of(const std::string& frame) {
  const auto [found, is_new] = indices_.emplace(frame, static_cast<std::uint32_t>(frames_.size()));
  if (is_new) frames_.push_back({frame, {}});
  return found->second;
}

TransformTree::Above& TransformTree::above_of(std::uint32_t child, std::uint32_t parent, bool fixed) {
  std::vector<Above>& above = frames_[child].above;
  for (Above& one : above)
    if (one.parent == parent && one.fixed == fixed) return one;
  const auto place = fixed ? above.end() : std::ranges::find(above, true, &Above::fixed);
  return *above.insert(place, {parent, fixed, {}});
}

void TransformTree::add(const Edge& edge, const Trajectory::Sample& sample) {
  if (edge.parent == edge.child || edge.parent.empty() || edge.child.empty()) return;
  const std::uint32_t parent = index_of(edge.parent);
  above_of(index_of(edge.child), parent, edge.fixed).track.add(sample);
}

void TransformTree::finish() {
  for (Frame& frame : frames_)
    for (Above& above : frame.above) {
      above.track.finish();
      steady_ = steady_ || (!above.fixed && above.track.changes());
    }
}

std::pair<std::size_t, std::string> TransformTree::left_out() const {
  std::pair<std::size_t, std::string> all;
  for (const Frame& frame : frames_)
    for (const Above& above : frame.above) {
      if (all.first == 0) all.second = frame.name;
      if (!above.fixed) all.first += above.track.left_out();
    }
  return all;
}

void TransformTree::keep_last(std::int64_t duration_ns) {
  for (Frame& frame : frames_)
    for (Above& above : frame.above)
      if (!above.fixed && !above.track.samples().empty())
        above.track.forget_before(above.track.samples().back().stamp_ns - duration_ns);
}

std::vector<std::string> TransformTree::ancestors(const std::string& frame) const {
  std::vector<std::string> names;
  auto found = indices_.find(frame);
  if (found == indices_.end()) return names;
  for (std::optional<std::uint32_t> at = found->second; at && names.size() < frames_.size();) {
    const Frame& f = frames_[*at];
    names.push_back(f.name);
    at = f.above.empty() ? std::nullopt : std::optional(f.above.front().parent);
  }
  return names;
}

bool TransformTree::moves(const std::string& frame) const {
  const auto names = ancestors(frame);
  return std::ranges::any_of(names,
                             [&](const std::string& name) { return frames_[indices_.at(name)].moves(); });
}

bool TransformTree::moves_below(const std::string& frame) const {
  return std::ranges::any_of(frames_, [&](const Frame& other) {
    return other.name != frame && other.moves() && std::ranges::count(ancestors(other.name), frame) > 0;
  });
}

TransformTree::Doubts TransformTree::doubts_of(const std::string& frame) const {
  Doubts doubts;
  for (const std::string& name : ancestors(frame)) {
    const std::vector<Above>& above = frames_[indices_.at(name)].above;
    for (const Above& one : above) {
      const std::string& parent = frames_[one.parent].name;
      if (one.fixed) {
        if (one.track.changes() && doubts.changed.empty()) doubts.changed = name + " in " + parent;
        continue;
      }
      // Not one after the other, as of a thing that is handed over.
      const auto &samples = above.front().track.samples(), &others = one.track.samples();
      if (one.parent != above.front().parent && doubts.parents.empty() &&
          std::max(samples.front().stamp_ns, others.front().stamp_ns) <
              std::min(samples.back().stamp_ns, others.back().stamp_ns))
        doubts.parents =
            name + " has two parents at a time, " + frames_[above.front().parent].name + " and " + parent;
    }
  }
  return doubts;
}

std::optional<std::int64_t> TransformTree::newest(const std::string& to, const std::string& from) const {
  std::int64_t earliest = std::numeric_limits<std::int64_t>::max();
  if (to == from) return earliest;
  const std::vector<std::string> above = ancestors(from), above_target = ancestors(to);
  const auto meeting =
      std::ranges::find_first_of(above, above_target);  // the lowest that both are below, or are
  if (meeting == above.end()) return {};
  for (const auto& side : {above, above_target})
    for (const std::string& name : side) {
      if (name == *meeting) break;
      const Frame& frame = frames_[indices_.at(name)];
      if (frame.moves()) earliest = std::min(earliest, frame.above.front().track.samples().back().stamp_ns);
    }
  return earliest;
}

void TransformTree::forget_moving() {
  for (Frame& frame : frames_) std::erase_if(frame.above, [](const Above& above) { return !above.fixed; });
  steady_ = false;
}

TransformTree::Way TransformTree::up(std::uint32_t start, std::optional<std::uint32_t> stop,
                                     std::int64_t stamp_ns, std::int64_t gap_ns) const {
  Way way{{{start, Eigen::Isometry3d::Identity()}}, {}};
  const auto seen = [&](std::uint32_t frame) {  // rings end
    return std::ranges::find(way.steps, frame, &Step::frame) != way.steps.end();
  };
  for (std::size_t i = 0; i < way.steps.size(); ++i) {
    const Step step = way.steps[i];
    if (step.frame == stop) break;
    const Frame& frame = frames_[step.frame];
    for (const Above& above : frame.above) {
      const bool moves_too = above.fixed && std::ranges::any_of(frame.above, [&](const Above& other) {
                               return other.parent == above.parent && !other.fixed;
                             });
      if (moves_too || seen(above.parent)) continue;
      try {
        const Eigen::Isometry3d T =
            above.fixed ? above.track.held_at(stamp_ns) : above.track.at(stamp_ns, gap_ns, steady_);
        way.steps.push_back({above.parent, T * step.T_frame_start});
      } catch (const NoPose& none) {  // ignored if another way leads there
        if (!way.broken)
          way.broken.emplace("no pose of frame " + frame.name + " at its time: " + none.what());
      }
    }
  }
  return way;
}

Eigen::Isometry3d TransformTree::lookup(const std::string& to, const std::string& from, std::int64_t stamp_ns,
                                        std::int64_t gap_ns) const {
  if (to == from) return Eigen::Isometry3d::Identity();
  const auto target = indices_.find(to), source = indices_.find(from);
  if (source == indices_.end()) throw NotInTf(lacks(from));
  if (target == indices_.end()) throw NotInTf(lacks(to));
  const Way way = up(source->second, target->second, stamp_ns, gap_ns);
  const bool below = std::ranges::find(way.steps, target->second, &Step::frame) != way.steps.end();
  const Way back = below ? Way{{{target->second, Eigen::Isometry3d::Identity()}}, {}}
                         : up(target->second, {}, stamp_ns, gap_ns);
  for (const Step& step : back.steps)
    for (const Step& other : way.steps)
      if (other.frame == step.frame) return step.T_frame_start.inverse() * other.T_frame_start;
  if (way.broken) throw NoPose(*way.broken);
  if (back.broken) throw NoPose(*back.broken);
  throw NotInTf("tf does not connect " + from + " with " + to);
}

std::string TransformTree::lacks(const std::string& frame) const {
  std::string list;
  for (const Frame& known : frames_ | std::views::take(20))
    list += (list.empty() ? ", but " : ", ") + known.name;
  return "tf has no frame '" + frame + "'" + (list.empty() ? ", nor any" : list);
}

}  // namespace octosurf::io
