// The octree to and from bytes, with OctoMap's own readers and writers as twins.
#include "io/files.hpp"

#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

struct Both {
  OccupancyMap ours;
  octomap::OcTree theirs;
};

/// The same scans in both; some points belong to surfaces.
Both mapped(std::uint64_t seed, double resolution, int scans, std::size_t rays) {
  std::mt19937_64 rng(seed);
  Both both{OccupancyMap(test::with_resolution(resolution)), octomap::OcTree(resolution)};
  for (int i = 0; i < scans; ++i) {
    const Scan scan = test::room_scan(rng, rays, {1.5, 1.2, 0.9}, {0.3, -2, 1});
    test::insert_scan(both.theirs, scan, -1);
    test::insert(both.ours, scan, 1e9);
  }
  both.ours.for_each_point([&](const VoxelPoint& p) { both.ours.assign(p, p.key.x % 3); });
  return both;
}

using test::bytes_of;

/// Reads in pieces of random size.
OccupancyMap read_back(const std::string& bytes, double resolution, std::mt19937_64& rng, std::size_t piece) {
  OccupancyMap map(test::with_resolution(resolution));
  std::size_t at = 0;
  map.read_nodes(
      [&] {
        const std::size_t n = std::min(bytes.size() - at, 1 + rng() % piece);
        at += n;
        return bytes.substr(at - n, n);
      },
      "test");
  return map;
}

std::string data_of(const std::string& file) { return file.substr(file.find("\ndata\n") + 6); }
long size_in(const std::string& file) { return std::stol(file.substr(file.find("\nsize ") + 6)); }

using OccupancyFiles = test::FolderTest;

TEST_F(OccupancyFiles, NodesComeBackToTheBit) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (const double resolution : {0.02, 0.1}) {
    const Both both = mapped(seed, resolution, 3, 4000);
    const std::string bytes = bytes_of(both.ours);
    for (const std::size_t piece : {std::size_t{3}, bytes.size()}) {
      const OccupancyMap back = read_back(bytes, resolution, rng, piece);
      EXPECT_TRUE(bytes_of(back) == bytes);
      EXPECT_EQ(back.size().nodes, both.ours.size().nodes);
      test::expect_equal(back, both.theirs);
      const std::vector<VoxelPoint> points = test::points_of(both.ours), again = test::points_of(back);
      ASSERT_EQ(again.size(), points.size());
      for (std::size_t i = 0; i < points.size(); ++i)
        test::expect_same_point(again[i], points[i], points[i].surface);
    }
  }
}

TEST_F(OccupancyFiles, DamagedNodesAreAnError) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const std::string bytes = bytes_of(mapped(seed, 0.3, 1, 60).ours);
  for (std::size_t n = 1; n < bytes.size(); ++n)
    EXPECT_THROW(read_back(bytes.substr(0, n), 0.3, rng, 50), Error) << "cut to " << n << " bytes";
  EXPECT_THROW(read_back(bytes + '\0', 0.3, rng, 50), Error);
}

TEST_F(OccupancyFiles, BtIsOctomapsOwn) {
  const std::uint64_t seed = test::seed();
  for (const double resolution : {0.02, 0.05, 0.25}) {
    Both both = mapped(seed, resolution, 4, 5000);
    const std::string mine = test::bt_of(both.ours);
    std::ostringstream theirs, full;
    both.theirs.prune();
    both.theirs.writeData(full);
    EXPECT_TRUE(both.ours.share().octomap_data({}, true) == full.str());
    both.theirs.writeBinary(theirs);  // leaves `theirs` at maximum likelihood, pruned
    EXPECT_EQ(size_in(mine), size_in(theirs.str()));
    EXPECT_TRUE(data_of(mine) == data_of(theirs.str()));
    EXPECT_TRUE(both.ours.share().octomap_data() == data_of(theirs.str()));
    const octomap::OcTree read = test::through_bt(both.ours);
    EXPECT_EQ(read.size(), both.theirs.size());
    EXPECT_DOUBLE_EQ(read.getResolution(), resolution);
    EXPECT_TRUE(read == both.theirs);
  }
}

/// Every voxel of the box as in the whole, and whatever is beside the box in a cube that it cuts, or unknown.
TEST_F(OccupancyFiles, BtOfABoxIsThatOfTheCubesThatMeetIt) {
  std::mt19937_64 rng = test::rng();
  Both both = mapped(test::seed(), 0.1, 3, 3000);
  both.theirs.toMaxLikelihood();
  std::uniform_real_distribution<double> anywhere(-3, 3), beside(-0.5, 0.5), share(0, 1);
  for (int round = 0; round < 20; ++round) {
    const Eigen::AlignedBox3d box = [&] {
      Eigen::AlignedBox3d made;
      for (int i = 0; i < 2; ++i) made.extend(Eigen::Vector3d(anywhere(rng), anywhere(rng), anywhere(rng)));
      return made;
    }();
    const std::string part = both.ours.share().octomap_data(box);
    EXPECT_LT(part.size(), both.ours.share().octomap_data().size());
    octomap::OcTree read(0.1);
    std::istringstream stream(part);
    if (!part.empty()) read.readBinaryData(stream);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d inside(share(rng), share(rng), share(rng));
      const Eigen::Vector3d at = box.min() + inside.cwiseProduct(box.sizes()) +
                                 (i % 2) * Eigen::Vector3d(beside(rng), beside(rng), beside(rng));
      const octomap::point3d point(static_cast<float>(at.x()), static_cast<float>(at.y()),
                                   static_cast<float>(at.z()));
      const auto *known = both.theirs.search(point), *here = part.empty() ? nullptr : read.search(point);
      if (here == nullptr && (known == nullptr || !box.contains(at))) continue;
      ASSERT_TRUE(here != nullptr && known != nullptr) << at.transpose();
      EXPECT_EQ(read.isNodeOccupied(here), both.theirs.isNodeOccupied(known)) << at.transpose();
    }
  }
}

TEST_F(OccupancyFiles, WhatIsLeftOverIsAnError) {
  using ::testing::HasSubstr;
  Both both = mapped(11, 0.6, 1, 12);
  std::ostringstream ot, bt;
  both.theirs.write(ot);
  both.theirs.writeBinary(bt);
  for (const std::string& bytes : {ot.str(), bt.str()}) {
    const auto refusal = [](const std::string& content) {
      return test::failure(Error::Kind::data, [&] { test::octree_of_file(content); });
    };
    ASSERT_NO_THROW(test::octree_of_file(bytes));
    EXPECT_THAT(refusal(bytes + '\n'), HasSubstr("bytes are left over"));
    EXPECT_THAT(refusal(bytes + bytes), HasSubstr("bytes are left over"));
    const std::size_t size = bytes.find("\nsize ") + 6, line = bytes.find("\nres ");
    EXPECT_THAT(refusal(std::string(bytes).insert(size, "1")), HasSubstr("where its header says 1"));
    EXPECT_THAT(refusal(std::string(bytes).insert(line, "\r")), HasSubstr("copied as text"));
  }
}

TEST_F(OccupancyFiles, AnEmptyMapIsNoBytesAndItsBtAnEmptyMap) {
  OccupancyMap empty{OccupancyParameters{}};
  EXPECT_TRUE(bytes_of(empty).empty());
  std::mt19937_64 rng = test::rng();
  EXPECT_EQ(read_back("", 0.02, rng, 1).size().nodes, 0U);
  EXPECT_EQ(test::through_bt(empty).size(), 0U);
  EXPECT_EQ(empty.share().octomap_data(), "");
  EXPECT_EQ(OccupancyView().octomap_data(), "");
  const OccupancyMap map = test::octree_of_file(test::bt_of(empty));
  EXPECT_EQ(map.size().nodes, 0U);
  EXPECT_EQ(map.grid().resolution(), empty.grid().resolution());
}

/// Beside what test/fuzz does to every byte.
TEST_F(OccupancyFiles, HostileFilesAreAnError) {
  const std::string bt = "# Octomap OcTree binary file\n", ot = "# Octomap OcTree file\nid ", leaf(5, '\0');
  // Deeper than 16 levels: every first child has children.
  std::string bits, chain, not_finite = leaf;
  for (int i = 0; i < 40; ++i) bits += std::string("\x03\0", 2);
  for (int i = 0; i < 100; ++i) chain += std::string("\0\0\0\0\1", 5);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(not_finite.data(), &nan, sizeof nan);
  const auto refused = [&] { OccupancyMap::read_octomap(path("hostile"), {}); };
  test::failure(Error::Kind::data, refused);  // it is not there
  for (const std::string& text :
       {std::string("hello\n"), std::string(100000, '#'), bt + "id OcTree\nres 0\ndata\n\x01\x02",
        bt + "id OcTree\nres nan\ndata\n\x01\x02", bt + "id OcTree\nres -0.1\ndata\n\x01\x02",
        bt + "id OcTree\ndata\n\x01\x02", bt + "id CountingOcTree\nres 0.1\ndata\n\x01\x02",
        bt + "id OcTree\nsize 40\nres 0.1\ndata\n" + bits,
        ot + "CountingOcTree\nsize 1\nres 0.1\ndata\n" + leaf,
        ot + "LabelOcTree\nsize 2\nres 0.1\ndata\n" + std::string(13, '\0'),
        ot + "OcTree\nsize 1\nres nan\ndata\n" + leaf, ot + "OcTree\nsize 100\nres 0.1\ndata\n" + chain,
        ot + "OcTree\nsize 1\nres 0.1\ndata\n" + not_finite, ot + "OcTree\nsize 2\nres 0.1\ndata\n" + leaf,
        ot + "OcTree\nsize 1\nres 0.1\ndata\n" + leaf + "x",
        ot + "OcTree\nsize 1\nres 0.1\ndata\n" + leaf.substr(1)}) {
    SCOPED_TRACE(text.substr(0, 80));
    test::write_file(path("hostile"), text);
    EXPECT_THAT(test::failure(Error::Kind::data, refused), ::testing::HasSubstr(path("hostile").string()));
  }
}

}  // namespace
}  // namespace octosurf::occupancy
