#include "io/readers/scan_graph.hpp"

#include "io/readers/scan_files.hpp"

#include <octomap/octomap.h>

namespace octosurf::test {
namespace {

class ScanGraphs : public ScanFiles {
 protected:
  /// Two scans and an edge, written by OctoMap.
  ScanGraphs() {
    auto* first = new octomap::Pointcloud();
    first->push_back(1, 2, 3);
    first->push_back(4, 5, 6);
    auto* second = new octomap::Pointcloud();
    second->push_back(7, 8, 9);
    graph.addNode(first, octomap::pose6d(1, 2, 3, 0.1, 0.2, 0.3));
    graph.addNode(second, octomap::pose6d(4, 5, 6, 0, 0, 1.5));
    graph.connectPrevious();
    file = folder / "two.graph";
    graph.writeBinary(file.string());
  }

  octomap::ScanGraph graph;
  std::filesystem::path file;
};

TEST_F(ScanGraphs, PointsAndPosesAreOctoMaps) {
  const auto scans = read_all({file});
  ASSERT_EQ(scans.size(), graph.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    octomap::ScanNode* node = graph.getNodeByID(static_cast<unsigned>(i));
    ASSERT_EQ(scans[i].points.size(), node->scan->size());
    EXPECT_EQ(scans[i].sensor, SensorKind::lidar);
    for (std::size_t k = 0; k < scans[i].points.size(); ++k) {
      const octomap::point3d expected = node->pose.transform((*node->scan)[static_cast<unsigned>(k)]);
      const Eigen::Vector3d p = scans[i].T_map_sensor * scans[i].points[k].cast<double>();
      EXPECT_LT((p - Eigen::Vector3d(expected.x(), expected.y(), expected.z())).norm(), 1e-5);
    }
  }
  EXPECT_THAT(scans[1].name, says("two.graph scan 1"));
}

TEST_F(ScanGraphs, IsKnownByContentAndReadFromAFolder) {
  std::filesystem::rename(file, folder / "scans.dat");
  EXPECT_FALSE(is_occupancy_map(folder / "scans.dat"));
  EXPECT_EQ(read_all({folder}).size(), 2u);
}

TEST_F(ScanGraphs, TruncatedOrHostileFilesAreRefused) {
  const std::string whole = read_file(file);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(failure({write("cut.graph", whole.substr(0, length))}), says("cut.graph")) << length;
  for (const std::size_t count : {std::size_t{0}, std::size_t{4}}) {  // of scans, of points
    std::string hostile = whole;
    hostile.replace(count, 4, bytes_of(0xffffffffu));
    EXPECT_THAT(failure({write("bad.graph", hostile)}), says("truncated"));
  }
  EXPECT_THAT(failure({write("bad.graph", whole + "x")}), says("not a scan graph"));
  EXPECT_THAT(failure({write("bad.graph", bytes_of(0u, 0u))}), says("without scans"));
}

TEST_F(ScanGraphs, NotRigidIsRefusedAndPosesFromOutsideAreWrongUse) {
  std::string bytes = read_file(file);
  const std::size_t quaternion = 4 + 4 + 2 * 28 + 28 + 4;
  bytes.replace(quaternion, 8, bytes_of(5.0));
  EXPECT_THAT(failure({write("bad.graph", bytes)}), says("bad.graph scan 0: pose is not a rigid motion"));
  ScanSourceOptions options = with_poses(write("p", identity_pose));
  EXPECT_THROW(open_scans({file}, options), Error);
}

}  // namespace
}  // namespace octosurf::test
