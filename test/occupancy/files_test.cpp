// The octree to and from bytes, with OctoMap's own readers and writers as twins.
#include "io/files.hpp"

#include "occupancy/octomap_twin.hpp"
#include "occupancy/voxel_tree.hpp"
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

OccupancyMap read_back(const std::map<std::uint64_t, std::string>& parts, double resolution) {
  OccupancyMap map(test::with_resolution(resolution));
  for (const auto& [path, nodes] : parts) map.read_part(path, nodes, "test");
  return map;
}

std::string data_of(const std::string& file) { return file.substr(file.find("\ndata\n") + 6); }
long size_in(const std::string& file) { return std::stol(file.substr(file.find("\nsize ") + 6)); }

using OccupancyFiles = test::FolderTest;

TEST_F(OccupancyFiles, NodesComeBackToTheBit) {
  const std::uint64_t seed = test::seed();
  for (const double resolution : {0.02, 0.1}) {
    Both both = mapped(seed, resolution, 3, 4000);
    const OccupancyMap back = read_back(test::parts_of(both.ours), resolution);
    EXPECT_TRUE(bytes_of(back) == bytes_of(both.ours));
    EXPECT_EQ(back.size().nodes, both.ours.size().nodes);
    test::expect_equal(back, both.theirs);
    const std::vector<VoxelPoint> points = test::points_of(both.ours), again = test::points_of(back);
    ASSERT_EQ(again.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      test::expect_same_point(again[i], points[i], points[i].surface);
  }
}

/// Parts that are said to be as they were have the same nodes as before; what an assignment changes is told.
TEST_F(OccupancyFiles, PartsThatAreAsTheyWereAreTold) {
  Both both = mapped(test::seed(), 0.02, 3, 4000);
  std::mt19937_64 random = test::rng();
  for (int round = 0; round < 4; ++round) {
    const auto before = test::parts_of(both.ours);
    const std::uint32_t shares = both.ours.share().tree()->shares();
    if (round == 1) both.ours.assign(test::points_of(both.ours).front().key, 5);
    if (round == 2)
      for (const VoxelPoint& point : test::points_of(both.ours)) both.ours.assign(point, 7);
    if (round == 3) test::insert(both.ours, test::room_scan(random, 100, {1.5, 1.2, 0.9}, {0.3, -2, 1}), 1e9);
    const auto after = test::parts_of(both.ours);
    std::size_t kept = 0;
    occupancy::for_each_part(both.ours.share(), shares, [&](std::uint64_t path, const std::string& nodes) {
      if (!nodes.empty()) return;
      ++kept;
      EXPECT_TRUE(after.at(path) == before.at(path)) << round;
    });
    if (round < 2) {
      EXPECT_GT(kept, 0U) << round;
    }
  }
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
  EXPECT_EQ(read_back({}, 0.02).size().nodes, 0U);
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

// The adoption of a foreign octree, against brute force over all voxels.

using geometry::VoxelKey;

/// An octree as it comes from OctoMap: no points, undivided leaves.
OccupancyMap foreign(octomap::OcTree& tree) {
  std::ostringstream bt;
  tree.writeBinary(bt);
  return test::octree_of_file(bt.str());
}

std::set<std::uint64_t> free_voxels(const octomap::OcTree& tree) {
  std::set<std::uint64_t> free;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (tree.isNodeOccupied(*leaf)) continue;
    test::for_each_voxel(leaf, [&](VoxelKey key) { free.insert(key.packed()); });
  }
  return free;
}

/// Those that a path through faces connects with an aligned cube of 4³ of them.
std::set<std::uint64_t> connected_to_cubes(const std::set<std::uint64_t>& voxels) {
  std::map<std::uint64_t, int> in_cube;
  const auto cube_of = [](VoxelKey k) {
    const auto down = [](int v) { return static_cast<std::uint16_t>(v - v % 4); };
    return VoxelKey{down(k.x), down(k.y), down(k.z)}.packed();
  };
  for (const std::uint64_t packed : voxels) ++in_cube[cube_of(VoxelKey::unpack(packed))];
  std::set<std::uint64_t> connected;
  for (const std::uint64_t packed : voxels)
    if (in_cube[cube_of(VoxelKey::unpack(packed))] == 64) connected.insert(packed);
  std::vector<std::uint64_t> next(connected.begin(), connected.end());
  while (!next.empty()) {
    const VoxelKey key = VoxelKey::unpack(next.back());
    next.pop_back();
    for (const geometry::VoxelStep& step : geometry::face_steps)
      if (const std::uint64_t beside = stepped(key, step).packed();
          voxels.contains(beside) && connected.insert(beside).second)
        next.push_back(beside);
  }
  return connected;
}

using IsIn = std::function<bool(VoxelKey)>;

/// Where the surface is that an occupied voxel with an open neighbour is of, and the voxel that has the
/// point: in the middle of those behind it, along the axis where the fewest are, if these are at most 6 and
/// end where it is not open.
std::pair<VoxelKey, Eigen::Vector3f> middle(VoxelKey key, const Eigen::Vector3f& side, const IsIn& occupied,
                                            const IsIn& is_open, const geometry::VoxelGrid& grid) {
  std::vector<VoxelKey> shallowest;
  for (int axis = 0; axis < 3; ++axis) {
    if (side[axis] == 0) continue;
    geometry::VoxelStep step{};
    step[static_cast<std::size_t>(axis)] = side[axis] > 0 ? -1 : 1;
    std::vector<VoxelKey> stack;
    VoxelKey next = key;
    for (; occupied(next) && stack.size() < 7; next = stepped(next, step)) stack.push_back(next);
    if (stack.size() < 7 && !is_open(next) && (shallowest.empty() || stack.size() < shallowest.size()))
      shallowest = stack;
  }
  if (shallowest.empty()) return {key, grid.centre_of(key)};
  const Eigen::Vector3f mean = (grid.centre_of(shallowest.front()) + grid.centre_of(shallowest.back())) / 2;
  return {shallowest[(shallowest.size() - 1) / 2], mean};
}

/// Toward the open neighbours; the first of them if they cancel out; zero if there is none.
Eigen::Vector3f side_of(VoxelKey key, const IsIn& is_open) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero(), first = sum;
  for (const geometry::VoxelStep& step : geometry::face_steps) {
    if (!is_open(stepped(key, step))) continue;
    const Eigen::Vector3f way = Eigen::Vector3i(step.data()).cast<float>();
    if (first.isZero()) first = way;
    sum += way;
  }
  return sum.isZero() ? first : sum;
}

void check_adoption(octomap::OcTree& tree) {
  OccupancyMap map = foreign(tree);
  const std::set<std::uint64_t> occupied = test::occupied_voxels(map);
  const std::size_t known = test::known_voxels(test::through_bt(map));
  const std::set<std::uint64_t> free = free_voxels(tree), connected = connected_to_cubes(free);
  const IsIn is_occupied = [&](VoxelKey key) { return occupied.contains(key.packed()); };
  const IsIn is_open = [&](VoxelKey key) {
    if (free.empty()) return map.at(key).state == OccupancyMap::State::unknown;
    return (connected.empty() ? free : connected).contains(key.packed());
  };
  struct Point {
    Eigen::Vector3f position, side;
  };
  std::map<std::uint64_t, std::vector<Point>> expected;  // any of those in a voxel
  for (const std::uint64_t packed : occupied) {
    const VoxelKey key = VoxelKey::unpack(packed);
    const Eigen::Vector3f side = side_of(key, is_open);
    if (side.isZero()) continue;
    const auto [at, position] = middle(key, side, is_occupied, is_open, map.grid());
    expected[at.packed()].push_back({position, side.normalized()});
  }
  const std::vector<VoxelPoint> adopted = map.adopt_occupied_voxels();
  EXPECT_EQ(adopted.size(), expected.size());
  std::set<std::uint64_t> got;
  for (const VoxelPoint& p : adopted) {
    EXPECT_TRUE(got.insert(p.key.packed()).second) << "adopted twice";
    ASSERT_TRUE(map.at(p.key).point);
    EXPECT_EQ(p.surface, 0U);
    const std::vector<Point>& any = expected[p.key.packed()];
    EXPECT_TRUE(std::any_of(any.begin(), any.end(),
                            [&](const Point& point) {
                              return (p.position - point.position).cwiseAbs().maxCoeff() <=
                                         map.grid().resolution() / 128 &&
                                     p.view.dot(point.side) > 0.99F;
                            }))
        << p.position.transpose() << " seen from " << p.view.transpose() << " in " << p.key.packed();
  }
  EXPECT_EQ(test::occupied_voxels(map), occupied);
  EXPECT_EQ(test::known_voxels(test::through_bt(map)), known);
  EXPECT_TRUE(map.adopt_occupied_voxels().empty()) << "all have a point already";
}

TEST(AdoptOccupiedVoxels, TakesTheBorderOfAMappedRoom) {
  std::mt19937_64 rng = test::rng();
  octomap::OcTree tree(0.1);
  for (int i = 0; i < 3; ++i) test::insert_scan(tree, test::room_scan(rng, 6000, {1.3, 1, 0.8}), -1);
  check_adoption(tree);
}

// Readings scatter by half a voxel: some end behind the floor, and their rays free pockets there.
TEST(AdoptOccupiedVoxels, PocketsUnderAFloorAreNotWhereItIsSeenFrom) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<float> at(-0.7F, 0.7F);
  std::normal_distribution<float> noise(0, 0.01F);
  octomap::OcTree tree(0.02);
  for (int i = 0; i < 5; ++i) {
    const octomap::point3d sensor(at(rng), at(rng), 1.2F);
    octomap::Pointcloud cloud;
    for (int k = 0; k < 10000; ++k)
      cloud.push_back(sensor + (octomap::point3d(at(rng), at(rng), 0) - sensor) * (1 + noise(rng)));
    tree.insertPointCloud(cloud, sensor);
  }
  check_adoption(tree);
  const std::set<std::uint64_t> free = free_voxels(tree), connected = connected_to_cubes(free);
  OccupancyMap map = foreign(tree);
  int over_pockets = 0, from_below = 0;  // of the middle: past the floor's edges one sees its underside
  const auto in_the_middle = [&](VoxelKey k) {
    return map.grid().centre_of(k).head<2>().cwiseAbs().maxCoeff() < 0.6F;
  };
  for (const std::uint64_t packed : test::occupied_voxels(map)) {
    const std::uint64_t below = stepped(VoxelKey::unpack(packed), {0, 0, -1}).packed();
    over_pockets +=
        in_the_middle(VoxelKey::unpack(packed)) && free.contains(below) && !connected.contains(below);
  }
  double height = 0, points = 0;
  for (const VoxelPoint& p : map.adopt_occupied_voxels()) {
    if (!in_the_middle(p.key)) continue;
    from_below += p.view.z() < -0.5F;
    height += p.position.z();
    ++points;
  }
  EXPECT_GT(over_pockets, 100);
  EXPECT_LT(from_below, 0.05 * over_pockets) << "but for holes of the floor";
  // m. Middles come in steps of half a voxel, so that the nearest is within a quarter; what is occupied first
  // is 1 cm above the floor.
  EXPECT_NEAR(height / points, 0, 0.02 / 4);
}

TEST(AdoptOccupiedVoxels, DividesSolidBlocksAtTheirBorder) {
  octomap::OcTree tree(0.1);
  // A solid 16³ block in a shell of free voxels, and two bare plates one voxel thick in the unknown.
  for (int z = -1; z <= 16; ++z)
    for (int y = -1; y <= 16; ++y)
      for (int x = -1; x <= 16; ++x) {
        const bool inside = std::min({x, y, z}) >= 0 && std::max({x, y, z}) < 16;
        const octomap::OcTreeKey key(static_cast<std::uint16_t>(32768 + x),
                                     static_cast<std::uint16_t>(32768 + y),
                                     static_cast<std::uint16_t>(32768 + z));
        for (int i = 0; i < 8; ++i) tree.updateNode(key, inside);
      }
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b) {
      const auto u = static_cast<std::uint16_t>(32868 + a), v = static_cast<std::uint16_t>(32868 + b);
      tree.updateNode(octomap::OcTreeKey(u, v, 32700), true);
      tree.updateNode(octomap::OcTreeKey(32700, u, v), true);
    }
  check_adoption(tree);
}

TEST(AdoptOccupiedVoxels, WithoutFreeSpaceTheUnknownIsOpen) {
  octomap::OcTree tree(0.1);
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b)
      tree.updateNode(octomap::OcTreeKey(static_cast<std::uint16_t>(32868 + a),
                                         static_cast<std::uint16_t>(32868 + b), 32700),
                      true);
  check_adoption(tree);
}

TEST(AdoptOccupiedVoxels, AHostileBlockIsRefused) {
  // One occupied child of the root: 2^15 voxels an edge, in two bytes of a .bt.
  OccupancyMap map = test::octree_of_file(
      std::string("# Octomap OcTree binary file\nid OcTree\nsize 3\nres 0.1\ndata\n\x06") + '\0');
  EXPECT_THROW(map.adopt_occupied_voxels(), Error);
  EXPECT_TRUE(OccupancyMap(OccupancyParameters{}).adopt_occupied_voxels().empty()) << "of an empty map";
}

}  // namespace
}  // namespace octosurf::occupancy
