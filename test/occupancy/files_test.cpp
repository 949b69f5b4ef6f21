// The octree to and from bytes, with OctoMap's own readers and writers as twins.
#include "io/files.hpp"

#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "support/random_scans.hpp"
#include "support/seed.hpp"

#include <filesystem>
#include <gmock/gmock.h>
#include <octomap/ColorOcTree.h>
#include <random>

#include <octosurf/error.hpp>

namespace octosurf::occupancy {
namespace {

namespace fs = std::filesystem;

struct Both {
  OccupancyMap ours;
  octomap::OcTree theirs;
};

/// The same scans in both; some points belong to surfaces.
Both mapped(std::uint64_t seed, double resolution, int scans, std::size_t rays) {
  std::mt19937_64 rng(seed);
  Both both{OccupancyMap(test::with_resolution(resolution)), octomap::OcTree(resolution)};
  sensing::Downsampler downsample(both.ours.grid());
  for (int i = 0; i < scans; ++i) {
    const Scan scan = test::room_scan(rng, rays, {1.5, 1.2, 0.9}, {0.3, -2, 1});
    test::insert_scan(both.theirs, scan, -1);
    both.ours.insert(downsample(scan, 0, 1e9), downsample, nullptr);
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

/// A copy of `tree` in colour.
octomap::ColorOcTree coloured(const octomap::OcTree& tree) {
  octomap::ColorOcTree colour(tree.getResolution());
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    test::for_each_voxel(leaf, [&](geometry::VoxelKey k) {
      const octomap::OcTreeKey key(k.x, k.y, k.z);
      colour.setNodeValue(key, leaf->getLogOdds())->setColor(1, 2, 3);
    });
  return colour;
}

class OccupancyFiles : public test::FolderTest {
 protected:
  /// What OctoMap writes of a tree: as .ot, in colour, and as .bt, which leaves it at maximum likelihood.
  std::vector<fs::path> written(octomap::OcTree& tree) const {
    const std::vector<fs::path> files{path("full.ot"), path("colour.ot"), path("binary.bt")};
    EXPECT_TRUE(tree.write(files[0].string()));
    EXPECT_TRUE(coloured(tree).write(files[1].string()));
    EXPECT_TRUE(tree.writeBinary(files[2].string()));
    return files;
  }
};

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
      std::size_t points = 0;
      back.for_each_point([&](const VoxelPoint& p) {
        const auto original = both.ours.at(p.key).point;
        ASSERT_TRUE(original);
        EXPECT_EQ(original->position, p.position);
        EXPECT_EQ(original->view, p.view);
        EXPECT_EQ(original->range_class, p.range_class);
        EXPECT_EQ(original->surface, p.surface);
        ++points;
      });
      both.ours.for_each_point([&](const VoxelPoint&) { --points; });
      EXPECT_EQ(points, 0U);
    }
  }
}

TEST_F(OccupancyFiles, AMapReadBackGoesOnAsBefore) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  Both both = mapped(seed, 0.05, 2, 3000);
  OccupancyMap back = read_back(bytes_of(both.ours), 0.05, rng, 1000);
  sensing::Downsampler downsample(back.grid());
  const Scan scan = test::room_scan(rng, 4000, {1.5, 1.2, 0.9}, {0.3, -2, 1});
  const sensing::VoxelScan voxels = downsample(scan, 0, 1e9);
  back.insert(voxels, downsample, nullptr);
  both.ours.insert(voxels, downsample, nullptr);
  EXPECT_TRUE(bytes_of(back) == bytes_of(both.ours));
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
    std::ostringstream mine, theirs;
    both.ours.write_bt(mine);
    both.theirs.writeBinary(theirs);  // leaves `theirs` at maximum likelihood, pruned
    EXPECT_EQ(size_in(mine.str()), size_in(theirs.str()));
    EXPECT_TRUE(data_of(mine.str()) == data_of(theirs.str()));
    EXPECT_TRUE(both.ours.share().octomap_data() == data_of(theirs.str()));
    const octomap::OcTree read = test::through_bt(both.ours);
    EXPECT_EQ(read.size(), both.theirs.size());
    EXPECT_DOUBLE_EQ(read.getResolution(), resolution);
    EXPECT_TRUE(read == both.theirs);
  }
}

TEST_F(OccupancyFiles, ReadsWhatOctomapWrites) {
  Both both = mapped(test::seed(), 0.1, 3, 3000);
  const octomap::OcTree before(both.theirs);
  const std::vector<fs::path> files = written(both.theirs);
  for (const fs::path& file : files) {
    const OccupancyMap map = OccupancyMap::read_octomap(file, {});
    EXPECT_DOUBLE_EQ(map.grid().resolution(), 0.1);
    test::expect_equal(map, file == files.back() ? both.theirs : before);
  }
}

TEST_F(OccupancyFiles, WhatIsLeftOverIsAnError) {
  using ::testing::HasSubstr;
  Both both = mapped(11, 0.6, 1, 12);
  const auto refusal = [&](const std::string& content) {
    test::write_file(path("other"), content);
    return test::failure(Error::Kind::data, [&] { OccupancyMap::read_octomap(path("other"), {}); });
  };
  for (const fs::path& file : written(both.theirs)) {
    const std::string bytes = test::read_file(file);
    ASSERT_NO_THROW(OccupancyMap::read_octomap(file, {}));
    EXPECT_THAT(refusal(bytes + '\n'), HasSubstr("bytes are left over"));
    EXPECT_THAT(refusal(bytes + bytes), HasSubstr("bytes are left over"));
    const std::size_t size = bytes.find("\nsize ") + 6, line = bytes.find("\nres ");
    EXPECT_THAT(refusal(std::string(bytes).insert(size, "1")), HasSubstr("where its header says 1"));
    EXPECT_THAT(refusal(std::string(bytes).insert(line, "\r")), HasSubstr("copied as text"));
  }
}

TEST_F(OccupancyFiles, AnEmptyMapIsNoBytesAndItsBtAnEmptyMap) {
  const OccupancyParameters parameters;
  const OccupancyMap empty(parameters);
  EXPECT_TRUE(bytes_of(empty).empty());
  std::mt19937_64 rng = test::rng();
  EXPECT_EQ(read_back("", 0.02, rng, 1).size().nodes, 0U);
  EXPECT_EQ(test::through_bt(empty).size(), 0U);
  std::ostringstream bt;
  empty.write_bt(bt);
  EXPECT_EQ(OccupancyMap(parameters).share().octomap_data(), "");
  EXPECT_EQ(OccupancyView().octomap_data(), "");
  test::write_file(path("empty.bt"), bt.str());
  const OccupancyMap map = OccupancyMap::read_octomap(path("empty.bt"), parameters);
  EXPECT_EQ(map.size().nodes, 0U);
  EXPECT_EQ(map.grid().resolution(), parameters.resolution);
}

TEST_F(OccupancyFiles, ForeignFilesAreAnError) {
  const fs::path file = path("foreign");
  EXPECT_THROW(OccupancyMap::read_octomap(file, {}), Error);  // not there
  const std::string head = "# Octomap OcTree binary file\n";
  for (const std::string& text :
       {std::string("hello\n"), std::string(100000, '#'), head + "id OcTree\nres 0\ndata\n\x01\x02",
        head + "id OcTree\nres nan\ndata\n\x01\x02", head + "id OcTree\nres -0.1\ndata\n\x01\x02",
        head + "id OcTree\ndata\n\x01\x02", head + "id CountingOcTree\nres 0.1\ndata\n\x01\x02",
        // Deeper than 16 levels: every first child has children.
        head + "id OcTree\nsize 40\nres 0.1\ndata\n" + [] {
          std::string bits;
          for (int i = 0; i < 40; ++i) bits += std::string("\x03\0", 2);
          return bits;
        }()}) {
    test::write_file(file, text);
    EXPECT_THROW(OccupancyMap::read_octomap(file, {}), Error) << text.substr(0, 80);
  }
}

}  // namespace
}  // namespace octosurf::occupancy
