#include "planning/inset.hpp"

#include "planning/cell_grid.hpp"
#include "planning/inset_lines.hpp"
#include "planning/inset_rings.hpp"

#include <array>
#include <bit>

namespace octosurf::planning {
namespace {

/// A part of the current line that is not covered so far; its ends as in Rest.
struct OpenPart {
  double from = 0, to = 1;
  std::uint32_t from_by = none, to_by = none;
};

/// Removes from each line the parts covered by edges' reaches and by other obstacles.
class Uncover {
 public:
  /// `rests`: receives the remaining parts, by line.
  Uncover(const InsetLines& lines, std::vector<Rest>& rests);

  void run();

 private:
  // Edges that touch a line by construction are not tested against it, because rounding would decide.
  using Touching = std::array<std::uint32_t, 3>;

  void find_near(std::uint32_t eight);
  void uncover(const InsetLines::Line& line, const Touching& touching);
  void uncover_beside(const InsetLines::Line& line, std::uint32_t beside);
  void begin(const InsetLines::Line& line);
  void keep(const InsetLines::Line& line);

  Eigen::AlignedBox2d box_of_left() const;
  Eigen::AlignedBox2d edges_about_left() const;
  bool take_off_eight(std::uint32_t eight, const Touching& touching);
  bool take_off_eights(const Touching& touching);
  bool take_off_besides(std::uint32_t except);
  bool cut_by_beside(std::uint32_t beside, Cut& cut) const;
  void take_off(const Cut& cut, std::uint32_t in_by, std::uint32_t out_by);

  const InsetLines& in_;
  const ConvexLines& kernel_;
  std::vector<Rest>& rests_;
  CellGrid eight_grid_, beside_grid_;
  // round of the last visit: the grids report some several times
  std::vector<std::uint32_t> seen_eight_, seen_beside_;
  std::uint32_t round_ = 0;
  std::vector<std::uint32_t> near_;  // eights within reach of the current line's
  LineExtent extent_;                // of the current line
  std::vector<OpenPart> left_, scratch_;
};

double cell_of(const InsetLines& lines) {
  const Eigen::Vector2d size = lines.box().sizes();
  const double n = static_cast<double>(lines.eights().size() + lines.besides().size());
  // As large as the queries, and not many times more than eights: most of a box is far from any edge.
  return std::max({lines.kernel().box.sizes().maxCoeff(), std::sqrt(size.x() * size.y() / (16 * n)),
                   1e-6 * size.maxCoeff()});
}

Uncover::Uncover(const InsetLines& lines, std::vector<Rest>& rests)
    : in_(lines),
      kernel_(lines.kernel()),
      rests_(rests),
      eight_grid_(lines.box(), cell_of(lines)),
      beside_grid_(lines.box(), cell_of(lines)),
      seen_eight_(lines.eights().size(), 0),
      seen_beside_(lines.besides().size(), 0) {
  for (std::uint32_t e = 0; e < lines.eights().size(); ++e) eight_grid_.add(e, lines.eights()[e].box);
  for (std::uint32_t b = 0; b < lines.besides().size(); ++b) beside_grid_.add(b, lines.besides()[b].box);
  eight_grid_.finish();
  beside_grid_.finish();
}

void Uncover::find_near(std::uint32_t eight) {
  near_.clear();
  ++round_;
  seen_eight_[eight] = round_;
  const Eigen::Vector2d reach = kernel_.box.sizes();
  const Eigen::AlignedBox2d& own = in_.eights()[eight].box;
  const Eigen::AlignedBox2d about(own.min() - reach, own.max() + reach);
  eight_grid_.visit(about, [&](std::uint32_t other) {
    if (seen_eight_[other] == round_) return;
    seen_eight_[other] = round_;
    if (in_.eights()[other].box.intersects(about)) near_.push_back(other);
  });
}

void Uncover::begin(const InsetLines::Line& line) {
  left_.assign(1, {});
  in_.reaches().measure(line.from, line.to, extent_);
}

void Uncover::keep(const InsetLines::Line& line) {
  for (const OpenPart& part : left_)
    rests_.push_back(
        {line.from + part.from * (line.to - line.from), line.number, part.from_by, part.to_by, line.next});
}

/// Around the remaining parts of the current line.
Eigen::AlignedBox2d Uncover::box_of_left() const {
  const Eigen::Vector2d along = extent_.to - extent_.from, from = extent_.from + left_.front().from * along,
                        to = extent_.from + left_.back().to * along;
  // Margin for rounding: coordinates are kilometres at most.
  const Eigen::Vector2d hair = Eigen::Vector2d::Constant(1e-9);
  return {from.cwiseMin(to) - hair, from.cwiseMax(to) + hair};
}

/// Edges beyond it do not cover that part.
Eigen::AlignedBox2d Uncover::edges_about_left() const {
  const Eigen::AlignedBox2d box = box_of_left();
  return {box.min() - kernel_.box.max(), box.max() - kernel_.box.min()};
}

void Uncover::take_off(const Cut& cut, std::uint32_t in_by, std::uint32_t out_by) {
  scratch_.clear();
  for (const OpenPart& part : left_) {
    if (cut.out <= part.from || cut.in >= part.to) {
      scratch_.push_back(part);
      continue;
    }
    if (cut.in > part.from) scratch_.push_back({part.from, cut.in, part.from_by, in_by});
    if (cut.out < part.to) scratch_.push_back({cut.out, part.to, out_by, part.to_by});
  }
  left_.swap(scratch_);
}

/// False if nothing of the line remains.
bool Uncover::take_off_eight(std::uint32_t eight, const Touching& touching) {
  const std::uint32_t first = eight * EdgeReaches::at_once;
  std::uint32_t near = in_.reaches().near(eight, extent_);
  for (const std::uint32_t edge : touching)
    if (edge / EdgeReaches::at_once == eight) near &= ~(1U << edge % EdgeReaches::at_once);
  for (; near != 0; near &= near - 1) {
    const std::uint32_t edge = first + static_cast<std::uint32_t>(std::countr_zero(near));
    Cut cut;
    if (!in_.reaches().cut(edge, extent_, cut)) continue;
    take_off(cut, in_.line_of_side(edge, cut.in_side), in_.line_of_side(edge, cut.out_side));
    if (left_.empty()) return false;
  }
  return true;
}

bool Uncover::take_off_eights(const Touching& touching) {
  // Its own first: afterwards usually little remains, with few edges nearby.
  if (!take_off_eight(touching[0] / EdgeReaches::at_once, touching)) return false;
  Eigen::AlignedBox2d about = edges_about_left();
  for (const std::uint32_t eight : near_) {
    if (!in_.eights()[eight].box.intersects(about)) continue;
    if (!take_off_eight(eight, touching)) return false;
    about = edges_about_left();
  }
  return true;
}

bool Uncover::cut_by_beside(std::uint32_t beside, Cut& cut) const {
  const ConvexLines& one = in_.besides()[beside];
  for (std::uint32_t k = 0; k < one.corners.size(); ++k)
    if (!cut.by(one.offsets[k] - one.normals[k].dot(extent_.from),
                one.offsets[k] - one.normals[k].dot(extent_.to), k))
      return false;
  return true;
}

bool Uncover::take_off_besides(std::uint32_t except) {
  ++round_;
  beside_grid_.visit(box_of_left(), [&](std::uint32_t beside) {
    if (seen_beside_[beside] == round_ || left_.empty() || beside == except) return;
    seen_beside_[beside] = round_;
    Cut cut;
    if (!cut_by_beside(beside, cut)) return;
    const auto line_of = [&](std::uint32_t side) {
      return side == none ? none : in_.beside_line(beside, side).number;
    };
    take_off(cut, line_of(cut.in_side), line_of(cut.out_side));
  });
  return !left_.empty();
}

void Uncover::uncover(const InsetLines::Line& line, const Touching& touching) {
  begin(line);
  if (take_off_eights(touching) && (in_.besides().empty() || take_off_besides(none))) keep(line);
}

void Uncover::uncover_beside(const InsetLines::Line& line, std::uint32_t beside) {
  begin(line);
  if (!take_off_besides(beside)) return;
  const Eigen::AlignedBox2d about = edges_about_left();
  ++round_;
  eight_grid_.visit(about, [&](std::uint32_t eight) {
    if (seen_eight_[eight] == round_ || left_.empty()) return;
    seen_eight_[eight] = round_;
    if (in_.eights()[eight].box.intersects(about) && !take_off_eight(eight, {none, none, none}))
      left_.clear();
  });
  keep(line);
}

void Uncover::run() {
  for (std::uint32_t e = 0; e < in_.eights().size(); ++e) {
    find_near(e);
    const std::uint32_t first = e * EdgeReaches::at_once;
    for (std::uint32_t i = first; i < first + in_.eights()[e].edges; ++i) {
      const std::uint32_t ahead = in_.next(i), behind = in_.previous(i);
      uncover(in_.line(i, 0), {i, in_.joined(i) ? ahead : none, in_.joined(behind) ? behind : none});
      for (std::uint32_t s = 1; s <= in_.sides(i); ++s) uncover(in_.line(i, s), {i, ahead, none});
    }
  }
  for (std::uint32_t b = 0; b < in_.besides().size(); ++b)
    for (std::uint32_t k = 0; k < in_.besides()[b].corners.size(); ++k)
      uncover_beside(in_.beside_line(b, k), b);
}

}  // namespace

std::optional<std::vector<Polygon>> inset(const Polygon& polygon, const Ring2& kernel,
                                          std::span<const Ring2> besides) {
  if (polygon.outer.size() < 3) return std::vector<Polygon>{};
  // Reused, because allocation in each call takes a third of the time: the system commits it page by page.
  thread_local InsetLines lines;
  thread_local std::vector<Rest> rests;
  lines.assign(polygon, kernel, besides);
  rests.clear();
  Uncover(lines, rests).run();
  return bounded_by(lines, rests);
}

}  // namespace octosurf::planning
