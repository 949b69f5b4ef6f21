// IHMC's folders of planar regions, read as PlanarRegionFileTools.readHeaderLine() reads them.
#include "io/exporters/planner_fixture.hpp"
#include "support/paths.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path fixture = fs::path(test::paths::data()) / "ihmc_planar_regions";

/// As their reader does: labels and brackets away, then by commas.
std::vector<std::string> values_of(std::string line) {
  for (const char* label : {"regionId: ", "index: ", "origin: ", "normal: ", "orientation: ", "[", "]",
                            "concave hull size: ", "number of convex polygons: ", " "})
    for (auto at = line.find(label); at != std::string::npos; at = line.find(label))
      line.erase(at, std::string(label).size());
  std::vector<std::string> values;
  std::stringstream stream(line);
  for (std::string value; std::getline(stream, value, ',');) values.push_back(value);
  return values;
}

std::vector<std::vector<double>> rows_of(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(in, line);) {
    rows.emplace_back();
    for (const std::string& value : values_of(line)) rows.back().push_back(std::stod(value));
  }
  return rows;
}

class Ihmc : public PlannerFormats {
 protected:
  std::string refusal(const std::string& header, const std::string& region) const {
    fs::create_directories(path("bad"));
    std::ofstream(path("bad/header.txt")) << header;
    std::ofstream(path("bad/region5_1")) << region;
    try {
      read_ihmc(path("bad"));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      return error.what();
    }
    return "read";
  }
};

TEST_F(Ihmc, TheirFixtureSurvivesARoundTrip) {
  if (!fs::exists(fixture / "header.txt")) GTEST_SKIP() << fixture << " is missing";
  const std::vector<IhmcRegion> read = read_ihmc(fixture);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].id, 812955534);
  EXPECT_EQ(read[0].hull.size(), 3u);
  ASSERT_EQ(read[1].polygons.size(), 1u);
  EXPECT_EQ(read[1].polygons[0].size(), 4u);
  for (const IhmcRegion& region : read) {
    EXPECT_LT((region.T_world_region.linear().col(2) -
               Eigen::Vector3d(0.020991585264057616, 0.22488348929702132, 0.974159519580699))
                  .norm(),
              1e-9);
    // The shortest turn from z to the normal does not turn about z: its axis lies level.
    EXPECT_NEAR(Eigen::AngleAxisd(region.T_world_region.linear()).axis().z(), 0, 1e-12);
    for (const Ring2& polygon : region.polygons) EXPECT_GT(shapes::ring_area(polygon), 0);
  }
  export_ihmc(read, path("again"));
  // Index counts within the folder, so the fixture's third region is the second here.
  EXPECT_EQ(rows_of(path("again/region812955534_1")), rows_of(fixture / "region812955534_1"));
  EXPECT_EQ(rows_of(path("again/region812955534_2")), rows_of(fixture / "region812955534_3"));
  const std::vector<IhmcRegion> again = read_ihmc(path("again"));
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_TRUE(again[i].T_world_region.isApprox(read[i].T_world_region, 1e-14));
    EXPECT_EQ(again[i].hull, read[i].hull);
    EXPECT_EQ(again[i].polygons, read[i].polygons);
  }
}

TEST_F(Ihmc, RandomRegionsSurviveARoundTrip) {
  std::mt19937_64 random = rng();
  std::vector<IhmcRegion> regions;
  std::uniform_real_distribution<double> tilt(0, std::numbers::pi);
  for (int i = 0; i < 100; ++i) {
    const PlannerSurface surface = random_surface(random, 1 + i / 3, tilt(random));
    IhmcRegion region{static_cast<std::int32_t>(surface.id), surface.T_world_surface, {}, {}};
    region.hull = shapes::star(random, {0, 0}, 0.5, 2, 3 + static_cast<int>(random() % 30));
    for (std::size_t k = random() % 4; k > 0; --k) region.polygons.push_back(random_convex(random, 1));
    regions.push_back(region);
  }
  export_ihmc(regions, path("folder"));
  const std::vector<IhmcRegion> read = read_ihmc(path("folder"));
  ASSERT_EQ(read.size(), regions.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].id, regions[i].id);
    EXPECT_TRUE(read[i].T_world_region.isApprox(regions[i].T_world_region, 1e-12));
    EXPECT_EQ(read[i].hull, regions[i].hull);
    EXPECT_EQ(read[i].polygons, regions[i].polygons);
  }
}

TEST_F(Ihmc, TheirReaderFindsWhatWasWritten) {
  const PlannerSurface table = table_with_hole(5);
  export_ihmc(ihmc_regions(table), path("folder"));
  std::ifstream header(path("folder/header.txt"));
  std::string line;
  ASSERT_TRUE(std::getline(header, line));
  EXPECT_THAT(line, HasSubstr("orientation: "));  // what they know version 2 by
  std::vector<std::string> v = values_of(line);
  ASSERT_EQ(v.size(), 2u + 3 + 4 + 2 + 4);
  EXPECT_EQ(v[0] + "_" + v[1], "5_1");
  EXPECT_EQ(std::stof(v[2]), 3);
  EXPECT_EQ(std::stof(v[3]), -2);
  EXPECT_EQ(std::stof(v[4]), 0.75F);
  EXPECT_EQ(std::stod(v[8]), 0);  // angle
  EXPECT_EQ(std::stoi(v[9]), 4);
  EXPECT_EQ(std::stoi(v[10]), 4);
  const auto rows = rows_of(path("folder/region5_1"));
  ASSERT_EQ(rows.size(), 4u + 4 * 4);
  double convex = 0;
  for (std::size_t ring = 0; ring < 5; ++ring) {
    Ring2 vertices;
    for (std::size_t i = 4 * ring; i < 4 * ring + 4; ++i) vertices.emplace_back(rows[i][0], rows[i][1]);
    EXPECT_LT(shapes::ring_area(vertices), 0);  // clockwise, as theirs
    if (ring > 0) convex -= shapes::ring_area(vertices);
  }
  EXPECT_NEAR(convex, 1.8 * 1.8 - 0.6 * 0.6, 1e-12);  // the hole is what the convex polygons leave out
  // The island is a region of its own, without convex polygons here.
  ASSERT_TRUE(std::getline(header, line));
  v = values_of(line);
  EXPECT_EQ(v[0] + "_" + v[1], "5_2");
  EXPECT_EQ(v[10], "0");
  EXPECT_EQ(read_ihmc(path("folder"))[1].polygons.size(), 0u);
}

TEST_F(Ihmc, DirectionsNeedNotBeOfUnitLength) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.25, Eigen::Vector3d(0, 0.6, 0.8)).matrix();
  for (const char* axis : {"0, 0.6, 0.8", "0, 3, 4", "0, 6e-161, 8e-161", "0, 3e300, 4e300"}) {
    ASSERT_EQ(refusal(std::string("regionId: 5, index: 1, origin: 0, 0, 0, orientation: ") + axis +
                          ", 0.25, concave hull size: 3, number of convex polygons: 0, []\n",
                      "0, 0\n0, 1\n1, 0\n"),
              "read")
        << axis;
    EXPECT_LT((read_ihmc(path("bad"))[0].T_world_region.linear() - turn).norm(), 1e-12) << axis;
  }
}

TEST_F(Ihmc, AFolderWithALinkToItselfIsNotReplaced) {
  fs::create_directory(path("folder"));
  fs::create_symlink("region1_1", path("folder/region1_1"));
  try {
    export_ihmc(ihmc_regions(table_with_hole(5)), path("folder"), true);
    ADD_FAILURE() << "replaced";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("holds other files"));
  }
}

TEST_F(Ihmc, DamagedFoldersAreRefused) {
  const std::string header =
      "regionId: 5, index: 1, origin: 0, 0, 0, orientation: 0, 0, 1, 0, concave hull size: 3, "
      "number of convex polygons: 1, [3]\n";
  const std::string ring = "0, 0\n0, 1\n1, 0\n";
  EXPECT_EQ(refusal(header, ring + ring), "read");
  EXPECT_THAT(refusal(header, ring), HasSubstr("3 vertices where header.txt says 6"));
  EXPECT_THAT(refusal(header, ring + ring + "1, 1\n"), HasSubstr("7 vertices"));
  EXPECT_THAT(refusal(header, ring + "0, 0\n0, 1\n1\n"), HasSubstr("region5_1:6"));
  EXPECT_THAT(refusal(header, ring + "0, 0\n0, nan\n1, 0\n"), HasSubstr("region5_1:5"));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = header;
    changed.replace(changed.find(from), from.size(), to);
    return refusal(changed, ring + ring);
  };
  EXPECT_THAT(with("index", "number"), HasSubstr("header.txt:1"));
  EXPECT_THAT(with("5", "5e9"), HasSubstr("not an integer"));
  EXPECT_THAT(with("5", "99999999999"), HasSubstr("not an integer"));
  EXPECT_THAT(with("size: 3", "size: -3"), HasSubstr("negative"));
  EXPECT_THAT(with("0, 0, 1, 0,", "0, 0, 0, 0,"), HasSubstr("no length"));
  EXPECT_THAT(with("0, 0, 1, 0,", "0, 0, inf, 0,"), HasSubstr("finite"));
  EXPECT_THAT(with("polygons: 1, [3]", "polygons: 2, [3]"), HasSubstr("announces 2"));
  EXPECT_THAT(with("polygons: 1, [3]", "polygons: 2000000000, [3]"), HasSubstr("announces"));
  EXPECT_THAT(with("size: 3", "size: 2147483647"), HasSubstr("vertices where"));
  EXPECT_THAT(with("number of convex polygons: 1, [3]", ""), HasSubstr("header.txt:1"));
  EXPECT_THAT(refusal(header + header, ring + ring),
              HasSubstr("header.txt:2: gives region5_1 a second time"));
  EXPECT_THAT(with("polygons: 1, [3]", "polygons: 2, [3, 0]"), HasSubstr("fewer than three"));
  EXPECT_THROW(read_ihmc(path("nowhere")), Error);
}

TEST_F(Ihmc, RandomDamageIsRefusedOrReadsAsSomething) {
  std::mt19937_64 random = rng();
  const std::string header =
      "regionId: 5, index: 1, origin: 0.5, 0, -1e-3, orientation: 0, 0.6, 0.8, 0.25, concave hull size: 3, "
      "number of convex polygons: 1, [3]\n";
  const std::string region = "0, 0\n0, 1\n1, 0\n0, 0\n0, 1\n1, 0\n";
  int refused = 0;
  for (int round = 0; round < 500; ++round) {
    std::string bad_header = header, bad_region = region;
    for (std::string* text : {&bad_header, &bad_region})
      for (std::size_t changes = random() % 3; changes > 0; --changes)
        (*text)[random() % text->size()] = "0123456789-,. []\nenaif"[random() % 22];
    refused += refusal(bad_header, bad_region) != "read";  // anything but an Error(data) fails there
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace octosurf::test
