// Stairs of many measures, as people build them: the truth beside them is theirs as stairs.
#include "simulation/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

constexpr double board_thickness = 0.04;  // m, of an open stair's treads and of nosings

/// Puts up treads one behind the other. Its own frame moves on with the last edge's middle: x is the heading.
class Builder {
 public:
  Builder(Scene& scene, Random& random, const std::string& kind, bool open)
      : open_(open), width_(random.uniform(0.7, 1.5)), tread_(random.uniform(0.22, 0.35)), scene_(scene) {
    stair_.kind = kind;
    stair_.riser_m = random.uniform(0.10, 0.22);
    stair_.tread_m = tread_;
    nosing_ = random.uniform() < 0.5 ? 0 : random.uniform(0.02, 0.03);
    object_ = add_object(scene, "stair");
    // A lidar at the head's height sees ground from 2 m on: both ends are seen from as far.
    for (const double before : {3.0, 2.4, 1.8, 1.2, 0.6}) way_.emplace_back(-before, 0, 0);
  }

  /// Treads of one flight and then a landing of `depth`, to where `leave` (x, y, yaw in its frame) leads on.
  void add_flight(int steps, double depth, double low_y, double high_y, const Eigen::Vector3d& leave) {
    for (int k = 1; k < steps; ++k) {
      add_tread(tread_, -width_ / 2, width_ / 2);
      here_ = here_ * Eigen::Translation2d(tread_, 0);
    }
    add_tread(depth, low_y, high_y);
    here_ = here_ * Eigen::Translation2d(leave.x(), leave.y()) * Eigen::Rotation2Dd(leave.z());
  }
  void add_spiral(int steps, double turn_rad, double inner, double side) {
    inner_ = inner;
    stair_.tread_m = 2 * (inner + width_ / 2) * std::sin(turn_rad / 2);
    const Eigen::Vector2d centre(0, side * (inner + width_ / 2));
    const Eigen::Isometry2d turn = Eigen::Translation2d(centre) * Eigen::Rotation2Dd(side * turn_rad) *
                                   Eigen::Translation2d(-centre) * Eigen::Isometry2d::Identity();
    const auto low = Eigen::Vector2d(0, -width_ / 2), high = Eigen::Vector2d(0, width_ / 2);
    for (int k = 1; k < steps; ++k) {
      add_slab({low, turn * low, turn * high, high});
      here_ = here_ * turn;
    }
    add_tread(3, -width_ / 2, width_ / 2);
    add_cylinder(scene_, add_object(scene_, "pillar"), {centre.x(), centre.y(), 0}, inner - 0.01,
                 height_ + 1);
  }

  /// Floor and walls; the walk up and down.
  void finish() {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector3d& at : way_) box.extend(at.head<2>());
    const Eigen::Vector2d low = box.min().array() - 2.2, high = box.max().array() + 2.2;
    add_floor(scene_, low.array() - 0.15, high.array() + 0.15);
    // Without walls a lidar on the upper landing would see sky alone.
    const std::size_t walls = add_object(scene_, "walls");
    const double t = 0.15, top = height_ + 2;
    add_box(scene_, walls, {low.x() - t, low.y() - t, 0}, {high.x() + t, low.y(), top});
    add_box(scene_, walls, {low.x() - t, high.y(), 0}, {high.x() + t, high.y() + t, top});
    add_box(scene_, walls, {low.x() - t, low.y(), 0}, {low.x(), high.y(), top});
    add_box(scene_, walls, {high.x(), low.y(), 0}, {high.x() + t, high.y(), top});
    const Eigen::Vector3d up(0, 0, head_height);
    const auto n = static_cast<int>(way_.size());
    const auto look = [&](int from, int to) {
      scene_.path.push_back({way_[static_cast<std::size_t>(from)] + up,
                             way_[static_cast<std::size_t>(std::clamp(to, 0, n - 1))]});
    };
    // Up with a look at what comes next, down likewise, each far enough for the knees to see it.
    for (int i = 0; i + 1 < n; ++i) look(i, i + std::min(4, n - 1 - i));
    for (int i = n - 1; i > 0; --i) look(i, i - std::min(3, i));
    scene_.stairs.push_back(stair_);
    scene_.of_stairs = true;
  }
  double width() const { return width_; }
  double tread() const { return tread_; }

 private:
  void add_tread(double depth, double low_y, double high_y) {
    add_slab({{0, low_y}, {depth + nosing_, low_y}, {depth + nosing_, high_y}, {0, high_y}});
    // Where somebody stands; on a landing also where the way turns.
    for (double x = std::min(depth, tread_) / 2; x < depth; x += 0.5) stand_at({x, 0});
    if (std::fabs(low_y + high_y) > 0.1) stand_at({depth / 2, low_y + high_y});
  }
  void stand_at(const Eigen::Vector2d& at) {
    const Eigen::Vector2d place = here_ * at;
    way_.emplace_back(place.x(), place.y(), height_);
  }
  Eigen::Isometry3d slab_pose(double z) const {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear().topLeftCorner<2, 2>() = here_.linear();
    T.translation() << here_.translation(), z;
    return T;
  }
  /// Of the next height; the ring begins and ends at the front edge.
  void add_slab(const Ring2& ring) {
    const double below = height_;
    height_ += stair_.riser_m;
    const auto put = [&](const Ring2& base, double low, double high) {
      add_prism(scene_, object_, slab_pose(low), base, high - low);
    };
    const auto edge = [&](const Eigen::Vector2d& at) -> Eigen::Vector3d {
      const Eigen::Vector2d place = here_ * at;
      return {place.x(), place.y(), height_};
    };
    stair_.edges.push_back({edge(ring.back()), edge(ring.front())});
    if (open_) {
      put(ring, height_ - board_thickness, height_);
    } else if (inner_ > 0) {
      put(ring, std::max(0.0, below - stair_.riser_m), height_);
    } else {
      Ring2 body = ring;
      for (Eigen::Vector2d& at : body) at.x() = std::max(at.x(), nosing_);
      put(nosing_ > 0 ? body : ring, 0, nosing_ > 0 ? height_ - board_thickness : height_);
      if (nosing_ > 0) put(ring, height_ - board_thickness, height_);
    }
    if (inner_ > 0) stand_at((ring[0] + ring[1] + ring[2] + ring[3]) / 4);
  }

  bool open_;
  double width_, tread_, nosing_ = 0, inner_ = 0, height_ = 0;
  Scene& scene_;
  std::size_t object_ = 0;
  evaluation::TrueStair stair_;
  Eigen::Isometry2d here_ = Eigen::Isometry2d::Identity();
  std::vector<Eigen::Vector3d> way_;
};

int whole_number(Random& random, int low, int high) {
  return low + static_cast<int>(random.uniform() * (high - low + 1));
}

Scene make_flight(Random& random, const std::string& kind, bool open) {
  Scene scene;
  Builder builder(scene, random, kind, open);
  const double half = builder.width() / 2;
  builder.add_flight(whole_number(random, 4, 14), random.uniform(2.8, 3.4), -half, half, {0, 0, 0});
  builder.finish();
  return scene;
}

}  // namespace

Scene make_flight(Random& random) { return make_flight(random, "flight", false); }
Scene make_open(Random& random) { return make_flight(random, "open", true); }

Scene make_landing(Random& random) {
  Scene scene;
  Builder builder(scene, random, "landing", false);
  const double width = builder.width(), half = width / 2;
  const double side = random.uniform() < 0.5 ? -1 : 1;
  const int first = whole_number(random, 4, 7), second = whole_number(random, 4, 7),
            turn = whole_number(random, 0, 2);
  const double depth = std::max(width, random.uniform(0.9, 1.5)), gap = random.uniform(0.05, 0.3);
  if (turn == 0) {
    builder.add_flight(first, depth, -half, half, {depth, 0, 0});
  } else if (turn == 1) {
    builder.add_flight(first, depth, -half, half, {depth - half, side * half, side * std::numbers::pi / 2});
  } else {
    const double beside = side * (width + gap);
    builder.add_flight(first, depth, std::min(-half, beside - half), std::max(half, beside + half),
                       {0, beside, std::numbers::pi});
  }
  builder.add_flight(second, random.uniform(2.8, 3.4), -half, half, {0, 0, 0});
  builder.finish();
  return scene;
}

Scene make_spiral(Random& random) {
  Scene scene;
  Builder builder(scene, random, "spiral", random.uniform() < 0.5);
  const double inner = random.uniform(0.1, 0.3);
  const double turn_rad = builder.tread() / (inner + builder.width() / 2);
  const int most = static_cast<int>(std::numbers::pi / turn_rad);  // the landing ends not above the start
  builder.add_spiral(std::min(whole_number(random, 6, 14), most), turn_rad, inner,
                     random.uniform() < 0.5 ? -1 : 1);
  builder.finish();
  return scene;
}

}  // namespace octosurf::simulation
