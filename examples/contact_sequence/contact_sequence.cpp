#include "contact_sequence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <coin/Cbc_C_Interface.h>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

namespace octosurf::examples {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

using Index = int;  // CBC's, of a variable
using Terms = std::vector<std::pair<Index, double>>;

/// A mixed-integer programme, as far as one is needed here. CBC calls rows what are constraints.
class Programme {
 public:
  Programme() : model_(Cbc_newModel(), Cbc_deleteModel) { Cbc_setLogLevel(model_.get(), 0); }

  Index variable(double low, double high, double cost = 0) {
    Cbc_addCol(model_.get(), "", low, high, cost, 0, 0, nullptr, nullptr);
    return variables_++;
  }
  Index binary() {
    Cbc_addCol(model_.get(), "", 0, 1, 0, 1, 0, nullptr, nullptr);
    return variables_++;
  }
  void require(const Terms& terms, char sense, double bound) {  // 'L' ≤, 'G' ≥, 'E' =
    std::vector<Index> columns;
    std::vector<double> factors;
    for (const auto& [column, factor] : terms) {
      columns.push_back(column);
      factors.push_back(factor);
    }
    Cbc_addRow(model_.get(), "", static_cast<int>(terms.size()), columns.data(), factors.data(), sense,
               bound);
  }
  bool solve() {
    Cbc_setObjSense(model_.get(), 1);  // least cost
    Cbc_solve(model_.get());
    if (Cbc_isProvenOptimal(model_.get()) != 0) return true;
    if (Cbc_isProvenInfeasible(model_.get()) != 0) return false;
    throw std::runtime_error("CBC gave up");
  }
  double value(Index variable) const { return Cbc_getColSolution(model_.get())[variable]; }

 private:
  std::unique_ptr<Cbc_Model, void (*)(Cbc_Model*)> model_;
  Index variables_ = 0;
};

/// A point of space as three variables, or a fixed one.
struct Point {
  std::array<Index, 3> variable{-1, -1, -1};
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero();
};

using Box = Eigen::AlignedBox3d;

/// All sums of a point of `a` and one of `b`; with the sign −1 all differences.
Box sum(const Box& a, const Box& b, double sign = 1) {
  return sign > 0 ? Box(a.min() + b.min(), a.max() + b.max()) : Box(a.min() - b.max(), a.max() - b.min());
}

/// A step of the left foot (side 1) or the right one (side -1): forward, left, up.
Box step_box(const BipedReach& reach, double side) {
  Box box(reach.step_low, reach.step_high);
  if (side < 0) {
    box.min().y() = -reach.step_high.y();
    box.max().y() = -reach.step_low.y();
  }
  return box;
}

double side_of(std::size_t step) { return step % 2 == 0 ? 1 : -1; }

/// Where each foot can be at all, by boxes: so many steps from the start and so many to the goal. What these
/// leave of the pieces to choose from, and how tightly they bound the rest, is what makes the programme
/// small.
std::vector<Box> reachable_boxes(const ContactTask& task, const BipedReach& reach, std::size_t count) {
  std::vector<Box> boxes(count);
  Box from_start(task.start[1], task.start[1]);
  for (std::size_t i = 0; i < count; ++i)
    boxes[i] = from_start = sum(from_start, step_box(reach, side_of(i)));
  // The last foot stands half a step from the middle.
  const Box last = step_box(reach, side_of(count - 1));
  Box to_goal =
      sum(Box(task.goal - task.tolerance, task.goal + task.tolerance), Box(last.min() / 2, last.max() / 2));
  for (std::size_t i = count; i-- > 0; to_goal = sum(to_goal, step_box(reach, side_of(i)), -1))
    boxes[i] = boxes[i].intersection(to_goal);
  return boxes;
}

/// The programme for one number of steps. Its world is turned so that the feet point along x.
class StepProgramme {
 public:
  StepProgramme(const std::vector<ContactPiece>& pieces, const ContactTask& task, const BipedReach& reach,
                std::size_t count)
      : pieces_(pieces), reach_(reach) {
    const std::vector<Box> boxes = reachable_boxes(task, reach, count);
    const Box anywhere(Eigen::Vector3d::Constant(-infinity), Eigen::Vector3d::Constant(infinity));
    const Box center_box(reach.center_low, reach.center_high);
    Box balanced = center_box;
    balanced.min().head<2>() = -reach.balance;
    balanced.max().head<2>() = reach.balance;
    Point standing = fixed(task.start[1]), moving = fixed(task.start[0]);
    for (std::size_t i = 0; i < count && possible_; ++i) {
      possible_ = !boxes[i].isEmpty();
      if (!possible_) return;
      const Point foot = free_point(boxes[i]), center = free_point(anywhere);
      choose_piece(foot, boxes[i]);
      require_between(standing, foot, step_box(reach, side_of(i)));
      prefer_stance_width(standing, foot, side_of(i));
      require_between(standing, center, balanced);
      for (const Point& in_reach : {moving, foot}) require_between(in_reach, center, center_box);
      feet_.push_back(foot);
      centers_.push_back(center);
      moving = std::exchange(standing, foot);
    }
    end_at_goal(moving, standing, task);
  }

  std::optional<ContactSequence> solve() {
    if (!possible_ || !programme_.solve()) return std::nullopt;
    ContactSequence result;
    for (std::size_t i = 0; i < feet_.size(); ++i) {
      const auto& choices = choices_[i];
      const auto chosen = std::max_element(choices.begin(), choices.end(), [&](const auto& a, const auto& b) {
        return programme_.value(a.second) < programme_.value(b.second);
      });
      result.steps.push_back({chosen->first, value(feet_[i]), value(centers_[i])});
    }
    return result;
  }

 private:
  static Point fixed(const Eigen::Vector3d& at) { return {{-1, -1, -1}, at}; }
  Point free_point(const Box& box) {
    Point point;
    for (int k = 0; k < 3; ++k)
      point.variable[static_cast<std::size_t>(k)] = programme_.variable(box.min()[k], box.max()[k]);
    return point;
  }
  Eigen::Vector3d value(const Point& point) const {
    return {programme_.value(point.variable[0]), programme_.value(point.variable[1]),
            programme_.value(point.variable[2])};
  }

  /// factor · point[k], onto the terms or, where the point is fixed, onto the bound.
  static void add(Terms& terms, double& bound, const Point& point, int k, double factor) {
    if (point.variable[0] < 0)
      bound -= factor * point.fixed[k];
    else
      terms.emplace_back(point.variable[static_cast<std::size_t>(k)], factor);
  }

  /// `to` lies in the box about `from`.
  void require_between(const Point& from, const Point& to, const Box& box) {
    for (int k = 0; k < 3; ++k) {
      for (const auto& [sense, limit] : {std::pair('G', box.min()[k]), std::pair('L', box.max()[k])}) {
        Terms terms;
        double bound = limit;
        add(terms, bound, to, k, 1);
        add(terms, bound, from, k, -1);
        programme_.require(terms, sense, bound);
      }
    }
  }

  /// One of the pieces holds the foot. Of the others the constraints are loosened by as much as any point of
  /// the foot's box could break them ("big M").
  void choose_piece(const Point& foot, const Box& box) {
    Terms one;
    choices_.emplace_back();
    for (std::size_t j = 0; j < pieces_.size(); ++j) {
      Box around;
      for (const Eigen::Vector3d& vertex : pieces_[j].vertices) around.extend(vertex);
      if (!around.intersects(box)) continue;
      const Index chosen = programme_.binary();
      choices_.back().emplace_back(j, chosen);
      one.emplace_back(chosen, 1);
      for (Eigen::Index row = 0; row < pieces_[j].b.size(); ++row) {
        const Eigen::Vector3d a = pieces_[j].A.row(row);
        const double farthest = a.cwiseMax(0).dot(box.max()) + a.cwiseMin(0).dot(box.min());
        const double loosened = std::max(0.0, farthest - pieces_[j].b[row]);
        Terms terms{{chosen, loosened}};
        double bound = pieces_[j].b[row] + loosened;
        for (int k = 0; k < 3; ++k) add(terms, bound, foot, k, a[k]);
        programme_.require(terms, 'L', bound);
      }
    }
    possible_ = !one.empty();
    programme_.require(one, 'E', 1);
  }

  /// Costs what the feet are off their usual distance, left to right.
  void prefer_stance_width(const Point& standing, const Point& foot, double side) {
    const Index off = programme_.variable(0, infinity, 1);
    for (const double sign : {1.0, -1.0}) {  // off ≥ ±(width − usual width)
      Terms terms{{off, -1}};
      double bound = sign * reach_.stance_width_m;
      add(terms, bound, foot, 1, side * sign);
      add(terms, bound, standing, 1, -side * sign);
      programme_.require(terms, 'L', bound);
    }
  }

  void end_at_goal(const Point& a, const Point& b, const ContactTask& task) {
    for (int k = 0; k < 3; ++k) {
      for (const auto& [sense, off] :
           {std::pair('G', -task.tolerance[k]), std::pair('L', task.tolerance[k])}) {
        Terms terms;
        double bound = task.goal[k] + off;
        add(terms, bound, a, k, 0.5);
        add(terms, bound, b, k, 0.5);
        programme_.require(terms, sense, bound);
      }
    }
  }

  const std::vector<ContactPiece>& pieces_;
  const BipedReach& reach_;
  Programme programme_;
  bool possible_ = true;  ///< there is a piece in the box of each foot
  std::vector<Point> feet_, centers_;
  std::vector<std::vector<std::pair<std::size_t, Index>>> choices_;  ///< by step: piece, its binary
};

/// All of it turned, about the world's origin.
ContactPiece turned(ContactPiece piece, const Eigen::Matrix3d& R) {
  for (Eigen::Vector3d& vertex : piece.vertices) vertex = R * vertex;
  piece.A = piece.A * R.transpose();
  return piece;
}

}  // namespace

std::vector<ContactPiece> contact_pieces(const std::vector<PlannerSurface>& surfaces) {
  std::vector<ContactPiece> pieces;
  for (const PlannerSurface& surface : surfaces)
    for (const ConvexPiece& place : surface.pieces) {
      const Eigen::Vector3d normal = surface.T_world_surface.linear().col(2);
      const auto edges = static_cast<Eigen::Index>(place.vertices.size());
      Eigen::Matrix<double, 3, Eigen::Dynamic> corners(3, edges);
      for (Eigen::Index i = 0; i < edges; ++i) corners.col(i) = place.vertices[static_cast<std::size_t>(i)];
      ContactPiece piece{surface.id, place.vertices, {}, {}};
      piece.A.resize(edges + 2, 3);
      for (Eigen::Index i = 0; i < edges; ++i)
        piece.A.row(i) = (corners.col((i + 1) % edges) - corners.col(i)).cross(normal).normalized();
      piece.A.bottomRows<2>() << normal.transpose(), -normal.transpose();
      piece.b = (piece.A * corners).rowwise().maxCoeff();
      pieces.push_back(std::move(piece));
    }
  return pieces;
}

std::optional<ContactSequence> plan_contacts(const std::vector<ContactPiece>& pieces, const ContactTask& task,
                                             const BipedReach& reach, std::size_t most) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(-task.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<ContactPiece> along_x;
  for (const ContactPiece& piece : pieces) along_x.push_back(turned(piece, R));
  ContactTask ahead = task;
  for (Eigen::Vector3d& foot : ahead.start) foot = R * foot;
  ahead.goal = R * task.goal;
  for (std::size_t count = 2; count <= most; ++count) {
    std::optional<ContactSequence> found = StepProgramme(along_x, ahead, reach, count).solve();
    if (!found) continue;
    for (ContactSequence::Step& step : found->steps) {
      step.foot = R.transpose() * step.foot;
      step.center = R.transpose() * step.center;
    }
    return found;
  }
  return std::nullopt;
}

}  // namespace octosurf::examples
