// Map files: everything comes back, resuming changes nothing, the .bt is OctoMap's.
#include "io/database.hpp"
#include "io/map_file/map_file.hpp"
#include "map_files.hpp"
#include "support/invariants.hpp"
#include "support/packed_map.hpp"
#include "support/paths.hpp"
#include "support/scene.hpp"
#include "surfaces/map_state.hpp"

#include <octomap/OcTree.h>

namespace octosurf::test {
namespace {

class MapFileTest : public MapFiles {
 protected:
  LoadedMap loaded(const std::string& content) const {
    write_file(folder / "map.surfaces", content);
    return load_map(folder / "map");
  }
  void expect_comes_back(const Map& map, const std::string& name = "map") const {
    EXPECT_THAT(check_invariants(map), IsEmpty());
    save_map(map, folder / name);
    const LoadedMap loaded = load_map(folder / name);
    EXPECT_EQ(difference(map, loaded.map), "");
    EXPECT_THAT(check_invariants(loaded.map), IsEmpty());
    EXPECT_EQ(digest_of(map), digest_of(loaded.map));
  }
};

TEST_F(MapFileTest, WithoutEvidenceNothingWasSeenAgain) {
  std::vector<map_file::Record> records = unpack(bytes_of(map_of(changing_room(9))));
  for (map_file::Record& record : records)
    if (record.has_surface()) record.mutable_surface()->clear_evidence();
  const LoadedMap a = loaded(pack(records));
  for (const auto& [id, surface] : surfaces::state_of(a.map).surfaces)
    EXPECT_EQ(surface.evidence().readings + surface.evidence().moments.count, 0);
  EXPECT_TRUE(records_of(bytes_of(a.map)) == records_of(pack(records)));
}

TEST_F(MapFileTest, LineageAndUsedUpIdsComeBack) {
  std::vector<map_file::Record> records = unpack(bytes_of(map_of(changing_room(5))));
  records.front().mutable_header()->set_next_id(1000);
  map_file::Surface& surface = last_surface(records);
  surface.clear_parents();
  for (const unsigned parent : {999, 17}) surface.add_parents(parent);
  const LoadedMap a = loaded(pack(records));
  EXPECT_THAT(a.map.snapshot()->find(surface.id())->parents, ElementsAre(999, 17));
  EXPECT_EQ(surfaces::state_of(a.map).surfaces.next_id(), 1000U);
  expect_comes_back(a.map);
}

/// Both ends of what a parameter may be, with others that it needs.
TEST_F(MapFileTest, OfParametersAtTheirEndsLoad) {
  std::istringstream all(
      "sensor_noise=0,sensor_noise=1e-12,sensor_noise=1 surface_tolerance=1,range_noise=0,range_noise=1,"
      "sensor_noise=0 range_noise=0,sensor_noise=0 range_noise=1e-12,surface_tolerance=1e-12,"
      "surface_tolerance=1,max_hole_size=0.05,max_hole_size=1.6,resolution=1 surface_tolerance=1e-3,"
      "resolution=10 surface_tolerance=1,min_surface_width=0,min_surface_width=10,min_surface_points=3,"
      "search_radius=0.05,search_radius=3.2,detection_budget=1,hit=0.999999 clamp_max=0.9999999,"
      "miss=1e-6 clamp_min=1e-7,occupied=0.13,occupied=0.97,max_range=1e-3,max_range=1e6 min_range=1");
  for (std::string given; std::getline(all, given, ',');) {
    SCOPED_TRACE(given);
    Parameters parameters = coarse();
    std::istringstream words(given);
    for (std::string name, value; std::getline(words, name, '=') && words >> value; words >> std::ws)
      set_parameter(parameters, name, value);
    expect_comes_back(map_of(changing_room(6), parameters));
  }
}

/// What could not be read is not written, and names what is wrong.
TEST_F(MapFileTest, OneThatWouldNotLoadDoesNotReplaceOneThatDoes) {
  Map map = map_of(changing_room(5));
  save_map(map, folder / "a");
  const std::string before = read_file(folder / "a.surfaces");
  Parameters& parameters = surfaces::state_of(map).parameters;
  parameters.surfaces.max_hole_size = parameters.occupancy.resolution / 10;  // shorter than its edges
  const std::string told = failure(Error::Kind::output, [&] { save_map(map, folder / "a"); });
  EXPECT_THAT(told, AllOf(HasSubstr("surface "), HasSubstr("more than h apart"), HasSubstr("not saved")));
  EXPECT_TRUE(read_file(folder / "a.surfaces") == before);
}

/// However often it was saved, and by rows that have changed alone.
TEST_F(MapFileTest, ASaveWritesWhatHasChangedAndTheDigestIsThatOfOne) {
  const std::vector<Scan> scans = changing_room(9);
  Mapper mapper(coarse());
  for (const Scan& scan : scans) {
    mapper.insert(scan);
    save_map(mapper.map(), folder / "often");
  }
  const std::string before = read_file(folder / "often.surfaces");
  save_map(mapper.map(), folder / "often");
  EXPECT_TRUE(read_file(folder / "often.surfaces") == before) << "nothing has changed";
  const Map once = map_of(scans);
  save_map(once, folder / "once");
  const Map often = load_map(folder / "often").map;
  EXPECT_EQ(difference(often, once), "");
  EXPECT_EQ(digest_of(often), digest_of(once));
  EXPECT_EQ(digest_of(often), digest_of(load_map(folder / "once").map));
  EXPECT_EQ(count_files(), 4U);
  // The last scan is of three points in a corner.
  const io::Database base(folder / "often.surfaces", io::Database::Access::read, 1 << 20);
  io::Database::Statement rows(base, "SELECT count(*), sum(revision = 9) FROM octree");
  ASSERT_TRUE(rows.step());
  EXPECT_GT(rows.integer(1), 0);
  EXPECT_LT(rows.integer(1), rows.integer(0) / 2);
}

TEST_F(MapFileTest, EmptyMap) { expect_comes_back(Map(coarse())); }

TEST_F(MapFileTest, AnOriginComesBackExactlyAndANoneIsNotWritten) {
  const Eigen::Vector3d utm(448000.1, 5411000, -120);
  Map map(coarse());
  EXPECT_EQ(map.origin(), Eigen::Vector3d::Zero());
  EXPECT_EQ(unpack(bytes_of(map)).front().header().origin_size(), 0);
  map.set_origin(utm);
  std::vector<map_file::Record> records = unpack(bytes_of(map));
  EXPECT_EQ(loaded(pack(records)).map.origin(), utm);
  EXPECT_THROW(map.set_origin(Eigen::Vector3d::Constant(NAN)), Error);
  records.front().mutable_header()->add_origin(1);
  EXPECT_THROW(loaded(pack(records)), Error);
}

TEST_F(MapFileTest, ParametersComeBackExactly) {
  // Every one another than the default: thirds of these, which no short text holds.
  std::istringstream thirds(
      "resolution 0.1 surface_tolerance 0.07 sensor_noise 0.01 range_noise 0.001 max_hole_size 0.5 "
      "search_radius 0.7 min_surface_points 123 min_surface_width 0.2 "
      "detection_budget 2310 max_range 20 "
      "min_range 1 hit 2 miss 1 clamp_min 0.1 clamp_max 2.9 occupied 1.6 preserve_surfaces 0 "
      "detect_cylinders 0 align 0 up_x 1 up_y -2 up_z 2");
  Parameters parameters;
  std::string name;
  for (double three = 0; thirds >> name >> three;) set_parameter_value(parameters, name, three / 3);
  Map map = map_of(changing_room(4), parameters);
  // This program does not map with it.
  surfaces::state_of(map).parameters.detection.detector = parameters.detection.detector = DetectorKind::paper;
  for (const ParameterInfo& info : parameter_infos())
    EXPECT_NE(parameter_value(parameters, info.name), parameter_value({}, info.name))
        << "not tested: " << info.name;
  save_map(map, folder / "a");
  const LoadedMap loaded = load_map(folder / "a");
  for (const ParameterInfo& info : parameter_infos())
    EXPECT_EQ(parameter_value(loaded.map.parameters(), info.name), parameter_value(parameters, info.name))
        << info.name;
  EXPECT_EQ(surfaces::state_of(loaded.map).occupancy.grid().resolution(), 0.1 / 3);
}

TEST_F(MapFileTest, TwoFilesAndEitherNamesTheMap) {
  const Map map = map_of(changing_room(3));
  save_map(map, folder / "a.v2.surfaces");
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"a.v2.bt", "a.v2.surfaces"}));
  for (const char* name : {"a.v2", "a.v2.bt", "a.v2.surfaces"})
    EXPECT_EQ(difference(map, load_map(folder / name).map), "") << name;
}

TEST_F(MapFileTest, TheBtIsAnOctoMapWithTheSameOccupiedVoxels) {
  const Map map = map_of(changing_room(9));
  save_map(map, folder / "a");
  octomap::OcTree tree(0.5);
  ASSERT_TRUE(tree.readBinary((folder / "a.bt").string()));
  EXPECT_EQ(tree.getResolution(), 0.05);
  std::size_t occupied = 0, free = 0;
  tree.expand();
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const bool is_occupied = tree.isNodeOccupied(*leaf);
    (is_occupied ? occupied : free) += 1;
    const octomap::point3d p = leaf.getCoordinate();
    ASSERT_EQ(map.at({p.x(), p.y(), p.z()}).state,
              is_occupied ? OccupancyView::State::occupied : OccupancyView::State::free);
  }
  EXPECT_EQ(occupied, map.size().points);
  EXPECT_GT(free, occupied);
}

TEST_F(MapFileTest, ABtThatDoesNotMatchIsNamedInAWarning) {
  save_map(map_of(changing_room(4)), folder / "old");
  save_map(map_of(changing_room(5)), folder / "a");
  EXPECT_EQ(load_map(folder / "a").warning, "");

  // As after a crash between the two renames: the .bt is new, the .surfaces old.
  const std::string before = read_file(folder / "old.bt");
  fs::copy_file(folder / "a.bt", folder / "old.bt", fs::copy_options::overwrite_existing);
  const LoadedMap old = load_map(folder / "old");
  EXPECT_THAT(old.warning, AllOf(HasSubstr("old.bt"), HasSubstr("is not the one that was saved")));
  EXPECT_EQ(old.map.size().scans, 4U);
  save_map(old.map, folder / "old");
  EXPECT_EQ(read_file(folder / "old.bt"), before);
  EXPECT_EQ(load_map(folder / "old").warning, "");
  EXPECT_EQ(read_file(folder / "old.edited.bt"), read_file(folder / "a.bt"))
      << "nobody's work is written over";

  std::string same_size = before;
  same_size.back() = static_cast<char>(same_size.back() ^ 1);
  write_file(folder / "old.bt", same_size);
  EXPECT_THAT(load_map(folder / "old").warning, HasSubstr("is not the one that was saved"));
  fs::remove(folder / "old.bt");
  EXPECT_THAT(load_map(folder / "old").warning, AllOf(HasSubstr("old.bt"), HasSubstr("is missing")));
  fs::create_directory(folder / "old.bt");
  EXPECT_THAT(load_map(folder / "old").warning, HasSubstr("is not the one that was saved"));
}

/// Whatever stands beside it: the .bt may be an OctoMap of somebody else's.
TEST_F(MapFileTest, ABtWithoutAReadableMapOfItsOwnIsKept) {
  const Map map = map_of(changing_room(3));
  save_map(map, folder / "own");
  save_map(map_of(changing_room(4)), folder / "other");
  const std::string whole = read_file(folder / "own.surfaces"), theirs = read_file(folder / "other.bt");
  std::string older = whole;
  older[63] = static_cast<char>(older[63] - 1);
  const std::pair<std::string, std::string> cases[] = {
      // the .surfaces beside it, and what the .bt holds
      {"", theirs},
      {older, theirs},
      {whole.substr(0, 200), theirs},
      {whole, theirs},
      {read_file(folder / "other.surfaces"), "edited"},
      {whole.substr(0, whole.size() - 20), read_file(folder / "own.bt")}};
  int n = 0;
  for (const auto& [surfaces, bt] : cases) {
    const std::string stem = (folder / std::to_string(n++)).string();
    SCOPED_TRACE(stem);
    write_file(stem + ".bt", bt);
    fs::permissions(stem + ".bt", fs::perms::owner_read | fs::perms::owner_write);
    if (!surfaces.empty()) write_file(stem + ".surfaces", surfaces);
    save_map(map, stem);
    EXPECT_EQ(read_file(stem + ".edited.bt"), bt);
    EXPECT_EQ(fs::status(stem + ".edited.bt").permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_EQ(load_map(stem).warning, "");
    save_map(map, stem);  // over its own
    write_file(stem + ".bt", bt);
    save_map(map, stem);  // over what is kept already
    EXPECT_FALSE(fs::exists(stem + ".edited-2.bt"));
    write_file(stem + ".bt", "another's");
    save_map(map, stem);
    EXPECT_EQ(read_file(stem + ".edited.bt"), bt) << "the earlier copy";
    EXPECT_EQ(read_file(stem + ".edited-2.bt"), "another's");
  }
  write_file(folder / "empty.bt", "");
  save_map(map, folder / "empty");
  EXPECT_FALSE(fs::exists(folder / "empty.edited.bt"));
  write_file(folder / "taken.bt", theirs);
  fs::create_symlink(folder / "nowhere", folder / "taken.edited.bt");
  fs::create_symlink("taken.bt", folder / "taken.edited-2.bt");
  fs::create_directory(folder / "taken.edited-3.bt");
  EXPECT_THAT(save_map(map, folder / "taken"), HasSubstr("taken.edited-4.bt"));
  EXPECT_EQ(read_file(folder / "taken.edited-4.bt"), theirs);
}

TEST_F(MapFileTest, AFoldersNameIsNoMaps) {
  const Map map(coarse());
  fs::create_directory(folder / "maps");
  for (const char* const name : {"maps/", "maps/.", "maps/..", "maps/...surfaces", "maps/..bt"})
    EXPECT_THAT(failure(Error::Kind::usage, [&] { save_map(map, folder / name); }),
                AllOf(HasSubstr(name), HasSubstr("names no map")));
  EXPECT_THAT(failure(Error::Kind::usage, [&] { save_map(map, ""); }), HasSubstr("names no map"));
  EXPECT_EQ(count_files(), 1U) << "the folder itself";
  EXPECT_TRUE(fs::is_empty(folder / "maps"));
}

// It shrinks so far that it looked like a file made to fill a reader's memory.
TEST_F(MapFileTest, ALargeFloorWithoutNoiseComesBack) {
  octomap::OcTree tree(0.02);
  for (int x = 0; x < 600; ++x)
    for (int y = 0; y < 600; ++y)
      tree.setNodeValue(octomap::OcTreeKey(static_cast<octomap::key_type>(32768 + x),
                                           static_cast<octomap::key_type>(32768 + y), 32768),
                        2.0F, true);
  tree.updateInnerOccupancy();
  ASSERT_TRUE(tree.writeBinary((folder / "floor.bt").string()));
  auto state = std::make_unique<surfaces::MapState>(Parameters{});
  state->occupancy = occupancy::OccupancyMap::read_octomap(folder / "floor.bt", Parameters{}.occupancy);
  Mapper mapper(surfaces::map_of(std::move(state)));
  mapper.detect_in_occupancy();
  ASSERT_GT(mapper.map().size().inliers, 350000U);
  expect_comes_back(mapper.map());
}

TEST_F(MapFileTest, MissingFilesSayWhatToDo) {
  const auto load = [&] { load_map(folder / "a"); };
  EXPECT_THAT(failure(Error::Kind::data, load), HasSubstr("there is no such map"));
  write_file(folder / "a.bt", "# Octomap OcTree binary file\n");
  EXPECT_THAT(failure(Error::Kind::data, load), AllOf(HasSubstr("octosurf map"), HasSubstr("a.bt -o"),
                                                      HasSubstr("makes surfaces out of an OctoMap")));
  fs::create_directory(folder / "a.surfaces");
  EXPECT_THAT(failure(Error::Kind::data, load), HasSubstr("is not a file"));
}

TEST_F(MapFileTest, UnwritableOutputKeepsWhatWasThere) {
  const Map map = map_of(changing_room(4));
  const auto save_to = [&](const fs::path& stem) {
    return failure(Error::Kind::output, [&] { save_map(map, stem); });
  };
  EXPECT_THAT(save_to(folder / "no" / "such" / "folder"), HasSubstr("cannot be written"));
  write_file(folder / "file", "text");
  EXPECT_THAT(save_to(folder / "file" / "a"), HasSubstr("cannot be written"));

  // The second of the two files cannot take its place: the first is not replaced either.
  write_file(folder / "a.bt", "old");
  fs::create_directory(folder / "a.surfaces");
  EXPECT_THAT(save_to(folder / "a"), HasSubstr("is a folder"));
  EXPECT_EQ(read_file(folder / "a.bt"), "old");
}

TEST_F(MapFileTest, TheScansThatAMapHoldsAreKnownByPoseAndReadings) {
  Mapper mapper;
  const std::vector<Scan> scans = changing_room(4);
  mapper.insert(scans[0]);
  mapper.remember_scans();
  mapper.insert(scans[1]);
  mapper.insert(scans[2]);
  expect_comes_back(mapper.map());
  const Map map = load_map(folder / "map").map;
  EXPECT_FALSE(map.holds(scans[0])) << "it was not remembered";
  EXPECT_TRUE(map.holds(scans[1]));
  EXPECT_FALSE(map.holds(scans[3]));
  Scan renamed = scans[2], other = scans[2], moved = scans[2];
  renamed.stamp_s += 100;
  renamed.name = "another";
  EXPECT_TRUE(map.holds(renamed));
  other.points[0].x() += 0.001F;
  EXPECT_FALSE(map.holds(other));
  moved.T_map_sensor.translation().x() += 0.1;
  EXPECT_FALSE(map.holds(moved));
}

/// Two of three single points, as a commit of this format's version saved them among the walls of a room,
/// with poses and a removal that were made up. The next one has surfaces.
TEST_F(MapFileTest, AFileThatWasWrittenBeforeIsRead) {
  const fs::path corpus = fs::path(test::paths::source()) / "test/fuzz/corpus";
  fs::copy_file(corpus / "surfaces/room.surfaces", folder / "room.surfaces");
  fs::copy_file(corpus / "octomap/room.bt", folder / "room.bt");
  const LoadedMap loaded = load_map(folder / "room");
  const Map& map = loaded.map;
  EXPECT_EQ(loaded.warning, "");
  EXPECT_THAT(check_invariants(map), IsEmpty());
  EXPECT_EQ(map.parameters().occupancy.resolution, 0.1);
  ASSERT_THAT(loaded.scans.poses, SizeIs(6));
  EXPECT_EQ(loaded.scans.poses[5].translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(map.snapshot()->removals.size(), 1U);
  map.snapshot()->removals.for_each_since(0, [&](const Removal& removal) {
    EXPECT_EQ(removal, (Removal{Removal::Of::surface, removal.id, 1, 2, 3, {1, 2}}));
  });
  EXPECT_GE(surfaces::state_of(map).queue.fresh.size(), 6U);
  EXPECT_EQ(map.at({0.3, -0.2, 0.1}).state, OccupancyView::State::free);
  const Eigen::Vector3d single(0.3, -0.1, 2.4);
  const OccupancyView::Voxel waiting = map.at(single);
  ASSERT_EQ(waiting.state, OccupancyView::State::occupied);
  EXPECT_EQ(waiting.surface, 0U);
  EXPECT_LT((waiting.point - single).norm(), 0.1 / 128);
  EXPECT_LT((waiting.view + single.normalized()).norm(), 0.06) << "seen from the origin";
}

/// It is written by another thread, while scans go on and readers see them.
TEST_F(MapFileTest, ASaveIsOfItsMomentWhateverIsReadMeanwhile) {
  const std::vector<Scan> scans = changing_room(14);
  Mapper mapper, until_then;
  for (std::size_t i = 0; i < 6; ++i) mapper.insert(scans[i]), until_then.insert(scans[i]);
  std::optional<io::MapSave> save(std::in_place, mapper.map(), folder / "moment", KeptScans(), true);
  for (std::size_t i = 6; i < scans.size(); ++i) {
    mapper.insert(scans[i]);
    if (i % 3 == 0) mapper.snapshot();
  }
  (*save)();
  save.reset();
  EXPECT_EQ(difference(until_then.map(), load_map(folder / "moment").map), "");
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  save_map(mapper.map(), folder / "moment");
  EXPECT_EQ(difference(mapper.map(), load_map(folder / "moment").map), "");
}

/// A room whose table stands elsewhere every day. The process is killed once a day, goes on from what it
/// saved last, and ends the day with a save. Nothing of that shows in the map, and its file does not grow.
TEST_F(MapFileTest, AMonthOfDaysIsSavedInPlace) {
  constexpr int days = 25, of_a_day = 80, places = 4;
  std::mt19937_64 random = rng();
  const auto scan_of = [&](int day, int i) {
    const double x = -0.9 + 0.6 * (day % places), y = day % 2 == 0 ? 0.5 : -1.1;
    Scene scene;
    scene.box({-1.5, -1.2, 0.01}, {1.5, 1.2, 2.0}).box({x, y, 0.01}, {x + 0.6, y + 0.6, 0.52});
    const double a = 2 * std::numbers::pi * i / of_a_day;
    const Eigen::Vector3d eye(-0.6 + 0.1 * std::cos(a), 0.1 * std::sin(a), 1.4);
    return camera_scan(scene, look_at(eye, eye + Eigen::Vector3d(std::cos(a), std::sin(a), -0.6)), random,
                       {40, 40, 30});
  };
  Mapper unbroken(of_voxels(0.05));
  save_map(unbroken.map(), folder / "month");
  std::vector<std::uintmax_t> bytes;
  for (int day = 0; day < days; ++day) {
    std::vector<Scan> scans;
    for (int i = 0; i < of_a_day; ++i) scans.push_back(scan_of(day, i));
    for (const Scan& scan : scans) unbroken.insert(scan);
    const int saved_at = of_a_day / 2, killed_at = saved_at + day;
    for (const auto& [first, save, end] :
         {std::tuple(0, saved_at, killed_at), {saved_at, of_a_day, of_a_day}}) {
      Mapper mapper(load_map(folder / "month").map);
      for (int i = first; i < end; ++i) {
        mapper.insert(scans[static_cast<std::size_t>(i)]);
        if (i + 1 == save) save_map(mapper.map(), folder / "month");
      }
    }
    bytes.push_back(fs::file_size(folder / "month.surfaces"));
  }
  const LoadedMap month = load_map(folder / "month");
  EXPECT_EQ(digest_of(month.map), digest_of(unbroken.map()));
  EXPECT_THAT(check_invariants(month.map), IsEmpty());
  const auto once_each = bytes.begin() + 2 * places;  // the table has stood at each place twice
  EXPECT_LE(static_cast<double>(bytes.back()),
            1.05 * static_cast<double>(*std::max_element(once_each - places, once_each)));
}

/// A floor, a wall, a pillar, and a table top that was carried off between two runs, as commit 0eb820e3 saved
/// them, with the files of the past that it kept.
TEST_F(MapFileTest, AMapThatWasSavedWithAPastIsReadAndGoneOnWith) {
  fs::copy(fs::path(test::paths::source()) / "test/io/map_file/released", folder);
  for (const char* const name : {"m.past", "m.before"}) write_file(folder / name, "whatever");  // of others
  const std::size_t files = count_files();
  ASSERT_EQ(files, 6U);
  LoadedMap loaded = load_map(folder / "m");
  EXPECT_EQ(loaded.warning, "");
  EXPECT_THAT(check_invariants(loaded.map), IsEmpty());
  const Map::Size size = loaded.map.size();
  EXPECT_THAT((std::array{size.scans, size.revision, size.points, size.inliers, size.pending}),
              ElementsAre(11, 11, 2310, 2188, 122));
  EXPECT_THAT(surfaces::state_of(loaded.map).held, SizeIs(11));
  EXPECT_EQ(loaded.scans.folder, folder / "m.scans");
  EXPECT_THAT(loaded.scans.poses, SizeIs(11));
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  ASSERT_THAT(snapshot->surfaces, SizeIs(2));
  const Surface &floor = *snapshot->surfaces[0], &wall = *snapshot->surfaces[1];
  EXPECT_EQ(std::pair(floor.id, wall.id), std::pair(SurfaceId{1}, SurfaceId{3}));
  EXPECT_EQ(floor.inliers, 1530U);
  EXPECT_NEAR(floor.area_m2, 5.296549, 1e-6);
  EXPECT_NEAR(wall.area_m2, 2.333531, 1e-6);
  EXPECT_NEAR(wall.plane.offset, -1.199910, 1e-6);
  ASSERT_THAT(snapshot->cylinders, SizeIs(1));
  EXPECT_NEAR(snapshot->cylinders[0]->radius_m, 0.250662, 1e-6);
  EXPECT_EQ(snapshot->cylinders[0]->inliers, 117U);
  EXPECT_EQ(snapshot->removals.size(), 1U);
  snapshot->removals.for_each_since(0, [](const Removal& table) { EXPECT_EQ(table.id, 2U); });

  Scene scene;
  scene.rectangle({-1.2, -1.2, 0}, {2.4, 0, 0}, {0, 2.4, 0});
  std::mt19937_64 random = rng();
  Mapper mapper(std::move(loaded.map));
  mapper.insert(camera_scan(scene, look_at({-0.3, -0.5, 1}, {-0.3, -0.4, 0}), random));
  EXPECT_EQ(mapper.map().size().scans, 12U);
  ASSERT_NE(mapper.snapshot()->find(1), nullptr);
  EXPECT_GT(mapper.snapshot()->find(1)->inliers, 1500U);
  expect_comes_back(mapper.map(), "m");
  EXPECT_EQ(count_files(), files);
}

}  // namespace
}  // namespace octosurf::test
