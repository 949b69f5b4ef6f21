// .ot and messages, against OctoMap's own readers and writers.
#include "io/files.hpp"

#include "support/random_scans.hpp"
#include "support/same_octree.hpp"

#include <octomap/OcTreeStamped.h>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/adapters/octree.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;
using test::expect_same;

class OctomapFilesTest : public test::FolderTest {
 protected:
  std::unique_ptr<octomap::OcTree> scanned(double resolution) {
    Mapper mapper(test::of_voxels(resolution, false));
    for (int i = 0; i < 3; ++i) mapper.insert(test::room_scan(random, 800, {1, 1, 1}, {0.3 * i, 0, 0}));
    return to_octree(mapper.map().octree());
  }
  fs::path written(const std::string& name, const std::string& bytes) const {
    test::write_file(path(name), bytes);
    return path(name);
  }

  std::mt19937_64 random = test::rng();
};

TEST_F(OctomapFilesTest, AnOtComesBackByOctomapsReaderAndByOurs) {
  for (const double resolution : {1.0 / 30, 1.0 / 16, 0.05, 0.1}) {
    const auto tree = scanned(resolution);
    ASSERT_GT(tree->size(), 1000u);
    write_ot(*tree, path("room.ot"), true);
    const std::unique_ptr<octomap::AbstractOcTree> theirs(
        octomap::AbstractOcTree::read(path("room.ot").string()));
    ASSERT_NE(dynamic_cast<octomap::OcTree*>(theirs.get()), nullptr);
    expect_same(dynamic_cast<octomap::OcTree&>(*theirs), *tree);
    expect_same(*read_octree(path("room.ot")), *tree);
  }
  const auto tree = read_octree(path("room.ot"));
  octomap::OcTree divided(*tree), binary(*tree), expected(0.1);
  divided.expand();
  ASSERT_TRUE(divided.write(path("divided.ot").string()));
  expect_same(*read_octree(path("divided.ot")), *tree);  // pruned
  ASSERT_TRUE(binary.writeBinary(path("theirs.bt").string()));
  ASSERT_TRUE(expected.readBinary(path("theirs.bt").string()));
  expect_same(*read_octree(path("theirs.bt")), expected);
}

TEST_F(OctomapFilesTest, TreesOfOtherTypesGiveTheirOccupancyAndSayWhatIsLeft) {
  const auto tree = scanned(0.1);
  tree->expand();
  octomap::OcTreeStamped stamped(0.1);
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf)
    stamped.setNodeValue(leaf.getKey(), leaf->getLogOdds());
  stamped.updateInnerOccupancy();
  tree->prune();
  ASSERT_TRUE(stamped.write(path("stamped.ot").string()));
  expect_same(*read_octree(path("stamped.ot")), *tree);
  EXPECT_EQ(octomap_note(path("stamped.ot")).find("bytes"), std::string::npos);

  // One that writes eight bytes of its own after each log-odds; our own tree's nodes have none.
  ASSERT_TRUE(tree->write(path("plain.ot").string()));
  const std::string plain = test::read_file(path("plain.ot"));
  const std::size_t data = plain.find("data\n") + 5;
  std::string labelled = plain.substr(0, data);
  labelled.replace(labelled.find("id OcTree"), 9, "id LabelOcTree");
  for (std::size_t at = data; at < plain.size(); at += 5)
    labelled += plain.substr(at, 4) + "\xff\x7f\xc0\x01 ab " + plain.substr(at + 4, 1);
  expect_same(*read_octree(written("labelled.ot", labelled)), *tree);
  EXPECT_THROW(read_octree(written("longer.ot", labelled + '\n')), Error);
  EXPECT_NE(octomap_note(path("labelled.ot")).find("LabelOcTree, whose occupancy is taken, and the 8 bytes"),
            std::string::npos);
  EXPECT_EQ(octomap_note(path("plain.ot")), "");
}

TEST_F(OctomapFilesTest, HeadersOfOlderVersionsAreRead) {
  octomap::OcTree binary(*scanned(0.1));
  ASSERT_TRUE(binary.writeBinary(path("now.bt").string()));
  const auto expected = read_octree(path("now.bt"));
  const std::string now = test::read_file(path("now.bt"));
  const std::string data = now.substr(now.find("data\n"));
  const std::string size = std::to_string(binary.size());
  for (const std::string& head :
       {"# Octomap OcTree binary file\nid 1\nres 0.1\nsize " + size + "\n",
        "# OctoMap OcTree binary file (feel free to change)\n# by hand\nres 0.1\nmaxdepth 16\nsize " + size +
            "\n"})
    expect_same(*read_octree(written("old.bt", head + data)), *expected);
  // The first .bt had no text: a 3, the resolution, the number of nodes.
  const std::int32_t type = 3;
  const double resolution = 0.1;
  const auto nodes = static_cast<std::uint32_t>(binary.size());
  std::string first(16, '\0');
  std::memcpy(first.data(), &type, 4);
  std::memcpy(first.data() + 4, &resolution, 8);
  std::memcpy(first.data() + 12, &nodes, 4);
  expect_same(*read_octree(written("first.bt", first + data.substr(5))), *expected);
}

TEST_F(OctomapFilesTest, AnEmptyTreeComesBackEmpty) {
  write_ot(octomap::OcTree(0.2), path("empty.ot"));
  const auto tree = read_octree(path("empty.ot"));
  EXPECT_EQ(tree->size(), 0u);
  EXPECT_EQ(tree->getResolution(), 0.2);
  EXPECT_EQ(octomap_message_data(*tree), "");
}

TEST_F(OctomapFilesTest, WritesOverNothingSilently) {
  const auto tree = scanned(0.1);
  const fs::path there = written("there.ot", "mine");
  test::failure(Error::Kind::usage, [&] { write_ot(*tree, there); });
  EXPECT_EQ(test::read_file(there), "mine");
  write_ot(*tree, there, true);
  expect_same(*read_octree(there), *tree);
  test::failure(Error::Kind::output, [&] { write_ot(*tree, path("no_folder") / "a.ot"); });
}

TEST_F(OctomapFilesTest, AMessageIsReadByOctomap) {
  const auto tree = scanned(0.1);
  std::istringstream data(octomap_message_data(*tree));
  octomap::OcTree theirs(0.1);
  theirs.readBinaryData(data);
  std::size_t leaves = 0;
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf, ++leaves) {
    const octomap::OcTreeNode* node = theirs.search(leaf.getKey(), leaf.getDepth());
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(theirs.isNodeOccupied(node), tree->isNodeOccupied(*leaf));
  }
  EXPECT_EQ(leaves, theirs.getNumLeafNodes());
}

}  // namespace
}  // namespace octosurf
