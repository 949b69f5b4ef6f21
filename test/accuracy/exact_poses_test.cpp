// A real camera's errors over terrain that repeats itself little: poses that are exact must stay so.
#include "simulation/recording.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iomanip>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

/// Blocks as an STL file.
class Terrain {
 public:
  /// A block whose top rises from `height` to `end_height` along x.
  void block(double x, double length, double y, double width, double height, double end_height) {
    const auto top = [&](double at_x, double at_y) {
      return Eigen::Vector3d(at_x, at_y, at_x > x ? end_height : height);
    };
    const std::array corners{top(x, y), top(x + length, y), top(x + length, y + width), top(x, y + width)};
    const auto below = [&](std::size_t i) {
      return Eigen::Vector3d(corners[i % 4].x(), corners[i % 4].y(), -0.1);
    };
    quad(corners[0], corners[1], corners[2], corners[3]);
    quad(below(3), below(2), below(1), below(0));
    for (std::size_t i = 0; i < 4; ++i) quad(below(i), below(i + 1), corners[(i + 1) % 4], corners[i]);
  }
  void write(const std::filesystem::path& file) const {
    std::ofstream out(file);
    out << "solid terrain\n" << std::setprecision(9);
    for (const auto& triangle : triangles_) {
      out << "facet normal 0 0 0\nouter loop\n";
      for (const Eigen::Vector3d& v : triangle) out << "vertex " << v.transpose() << '\n';
      out << "endloop\nendfacet\n";
    }
    out << "endsolid terrain\n";
  }

 private:
  void quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d) {
    triangles_.push_back({a, b, c});
    triangles_.push_back({a, c, d});
  }
  std::vector<std::array<Eigen::Vector3d, 3>> triangles_;
};

/// Planks across, each leaning the other way than the one before, uphill.
Terrain ramp() {
  Terrain terrain;
  terrain.block(-1.5, 1.5, -0.8, 1.6, 0, 0);
  double x = 0, z = 0;
  for (int i = 0; i < 12; ++i, x += 0.4, z += 0.06) {
    const double lean = i % 2 == 0 ? -0.02 : 0.05;
    terrain.block(x, 0.4, -0.8, 1.6, z + 0.03 - lean, z + 0.03 + lean);
  }
  terrain.block(x, 1.5, -0.8, 1.6, z, z);
  return terrain;
}

/// Blocks to the left and to the right on a floor, some of them aslant.
Terrain course() {
  Terrain terrain;
  terrain.block(-1.5, 8, -1.2, 2.4, 0, 0);
  const std::array heights{0.08, 0.15, 0.1, 0.22, 0.12, 0.18, 0.06, 0.2};
  for (std::size_t i = 0; i < heights.size(); ++i)
    terrain.block(0.2 + 0.7 * static_cast<double>(i), 0.5, i % 2 == 0 ? -0.2 : -0.9, 1.1, heights[i],
                  heights[i] + (i % 3 == 0 ? 0.05 : 0));
  return terrain;
}

/// Scans of which the pose is not exactly the given one, of `frames`.
std::size_t moved_scans(const Terrain& terrain, const char* name, std::size_t frames) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / (std::string(name) + ".stl");
  terrain.write(file);
  simulation::SimulationOptions options;
  options.mesh = file;
  options.sensor = "depth-real";
  options.seed = 2;  // fixed: the camera whose bias bent the course
  options.frames = frames;
  const simulation::Recording recording(options);
  Mapper mapper{Parameters{}};
  std::size_t moved = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Scan scan = recording.scan(i);
    const Alignment alignment = mapper.insert(scan).alignment;
    moved += alignment.outcome == AlignmentOutcome::rejected ||
             alignment.T_map_sensor.matrix() != scan.T_map_sensor.matrix();
  }
  return moved;
}

// A camera's slow bias over the picture made each scan fit its predecessors better elsewhere, until 19 of the
// course's 250 were moved, by up to 13 mm.
TEST(ExactPoses, OfARealCameraStayAsGivenOverACourseOfBlocks) {
  EXPECT_LE(moved_scans(course(), "octosurf_course", 250), 12U) << "of 250";
}

TEST(ExactPoses, OfARealCameraStayAsGivenUpARampOfPlanks) {
  EXPECT_LE(moved_scans(ramp(), "octosurf_ramp", 100), 5U) << "of 100";
}

}  // namespace
}  // namespace octosurf
