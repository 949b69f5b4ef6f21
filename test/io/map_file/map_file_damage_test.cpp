// Damaged, foreign and hostile map files: an Error(data), never anything worse.
#include "io/database.hpp"
#include "io/map_file/map_file.hpp"
#include "map_files.hpp"
#include "support/invariants.hpp"
#include "support/packed_map.hpp"
#include "surfaces/map_state.hpp"

#include <ranges>

#include <octosurf/changes.hpp>

namespace octosurf::test {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

class DamagedMapFiles : public MapFiles {
 protected:
  static void SetUpTestSuite() {
    // Made once for all tests: what varies from world to world is the damage.
    Parameters few_voxels;
    few_voxels.occupancy.resolution = 0.1;
    good = bytes_of(map_of(changing_room(9, std::mt19937_64(20)), few_voxels));        // fixed: see above
    with_cylinder = pack(without_history(map_of(pillar(5, 0, std::mt19937_64(21)))));  // fixed: see above
  }
  /// What may follow the surfaces and cylinders is left out.
  static std::vector<map_file::Record> without_history(const Map& map) {
    std::vector<map_file::Record> records = unpack(bytes_of(map));
    std::erase_if(records, [](const auto& one) { return one.has_removals() || one.has_seen_patches(); });
    return records;
  }
  static inline std::string good, with_cylinder;
};

TEST_F(DamagedMapFiles, ForeignFiles) {
  const auto foreign = HasSubstr("is not an octosurf map");
  std::string another = good;  // an application's
  another[71] = static_cast<char>(another[71] + 1);
  for (const std::string& content : {std::string(), std::string("a text\n"), good.substr(12), another,
                                     std::string("\x89PNG\r\n\x1a\n and more of the picture"),
                                     std::string("# Octomap OcTree binary file\nid OcTree\nsize 1\n")})
    EXPECT_THAT(loading(content), foreign);
  fs::resize_file(folder / "map.surfaces", std::uintmax_t{8} << 30);  // with holes
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "map"); }), foreign);
}

TEST_F(DamagedMapFiles, OtherVersions) {
  std::string bytes = good;
  constexpr std::uint32_t ours = io::map_file_version;
  for (const auto& [version, words] :
       {std::pair(ours + 1, "newer octosurf"), {ours - 1, "make the map anew"}}) {
    bytes[63] = static_cast<char>(version);
    EXPECT_THAT(loading(bytes), says("has version " + std::to_string(version), words,
                                     "this octosurf reads version " + std::to_string(ours)));
  }
  EXPECT_THAT(loading("\x89OCTSF\r\n\7 and the rest"),
              says("written by an older octosurf", "make the map anew"));
}

/// Rows of the right form that hold far more, or are far longer, than their file.
TEST_F(DamagedMapFiles, Bombs) {
  const std::vector<std::string> records = records_of(good);
  for (const std::size_t zeros : {std::size_t{60} << 20, std::size_t{6} << 20}) {
    std::vector<map_file::Record> bomb = unpack(good);
    for (std::int64_t i = 0; i < 2; ++i) {
      map_file::Record& record = bomb.emplace_back();
      record.set_octree(std::string(zeros, '\0'));
      record.set_key((std::int64_t{1} << 33) + i);
    }
    std::vector<std::string> bytes;
    for (const map_file::Record& record : bomb) bytes.push_back(record.SerializeAsString());
    const std::string file = map_file_of(bytes, {}, false);
    EXPECT_LT(file.size(), std::size_t{4} << 20);
    EXPECT_THAT(loading(file), HasSubstr("decompresses to far more"));
  }
}

/// What SQLite would do for whoever reads a database that somebody else made: nothing of it is done.
TEST_F(DamagedMapFiles, NothingButItsTables) {
  const std::string tables = "its tables are not as this format has them";
  const std::pair<const char*, std::string> changes[] = {
      {"CREATE TABLE more(a)", tables},
      {"CREATE INDEX fast ON octree(revision)", tables},
      {"CREATE VIEW all_of_it AS SELECT * FROM octree", tables},
      {"CREATE TRIGGER then_that AFTER INSERT ON octree BEGIN DELETE FROM state; END", tables},
      {"ALTER TABLE octree RENAME TO cubes; CREATE VIEW octree AS SELECT * FROM cubes", tables},
      {"ALTER TABLE octree ADD COLUMN more AS (randomblob(1000000000))", tables},
      {"DROP TABLE padding", tables},
      {"PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = sql || ' ' WHERE name = 'octree'",
       tables},
      {"PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = 2", "damaged"},
      {"PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE VIRTUAL TABLE octree USING "
       "dbstat' WHERE name = 'octree'",
       tables},
      {"PRAGMA journal_mode = WAL", "its pages are not as this format has them"},
      {"PRAGMA page_size = 8192; VACUUM", "its pages are not as this format has them"},
      {"UPDATE octree SET content = zeroblob(1000000000) WHERE rowid IN (SELECT min(key) FROM octree)",
       "damaged"},
      {"UPDATE octree SET bytes = -1", "a row is over the limit"},
      {"UPDATE octree SET bytes = bytes - 1", "zstd says"},
      {"UPDATE octree SET bytes = bytes + 1", "the checksum of a row differs"},
      {"UPDATE octree SET key = key + 1 WHERE key = (SELECT max(key) FROM octree)",
       "the checksum of a row differs"},
      {"UPDATE surfaces SET sum = NULL", "damaged"},
      {"DELETE FROM surfaces", "voxels belong to a surface that is not there"},
      {"DELETE FROM seen_patches", "rows are missing"},
      {"DELETE FROM state WHERE key = 2", "it has no state"},
      {"DELETE FROM state", "it has no state"}};
  for (const auto& [sql, message] : changes) {
    SCOPED_TRACE(sql);
    write_file(folder / "changed.surfaces", good);
    try {
      io::Database(folder / "changed.surfaces", io::Database::Access::write).run(sql);
    } catch (const Error&) {  // some, SQLite refuses itself, as it should
      continue;
    }
    EXPECT_THAT(loading(read_file(folder / "changed.surfaces")), HasSubstr(message));
  }
}

/// A save that was killed in the middle is taken back. SQLite then deletes the file that the journal's end
/// names as the one above it, which may be anybody's.
TEST_F(DamagedMapFiles, JournalsThatNameAnotherFile) {
  const fs::path map = folder / "cut.surfaces", journal = folder / "cut.surfaces-journal";
  write_file(folder / "saved.surfaces", good);
  std::string half, taken_back;
  {
    const io::Database save(folder / "saved.surfaces", io::Database::Access::write);
    save.run("PRAGMA cache_spill = ON; PRAGMA cache_size = 1; BEGIN");
    save.run("UPDATE octree SET content = zeroblob(length(content))");
    half = read_file(folder / "saved.surfaces");
    taken_back = read_file(folder / "saved.surfaces-journal");
  }
  ASSERT_NE(half, good);
  const std::string other = (folder / "other.txt").string();
  unsigned sum = 0;
  for (const char c : other) sum += static_cast<unsigned char>(c);
  const auto number = [](std::uint32_t n) {
    return std::string{char(n >> 24), char(n >> 16 & 0xff), char(n >> 8 & 0xff), char(n & 0xff)};
  };
  // The page of SQLite's locks, the name, its length and sum, and what a journal begins with.
  const std::string named = number((1U << 30) / 4096 + 1) + other +
                            number(static_cast<std::uint32_t>(other.size())) + number(sum) +
                            "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  write_file(other, "somebody's");
  write_file(map, half);
  write_file(journal, taken_back + named);
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "cut"); }),
              says("cut.surfaces-journal", "names another file"));
  EXPECT_EQ(read_file(other), "somebody's");
  write_file(journal, taken_back);
  EXPECT_EQ(bytes_of(load_map(folder / "cut").map), good);
}

using Records = std::vector<map_file::Record>;
using Kind = map_file::Record::ContentCase;

/// Records of the good file by kind, to be spoiled and packed again with a checksum that is right.
struct Spoiler {
  explicit Spoiler(const std::string& file) : records(unpack(file)) {}
  Records::iterator first(Kind kind) {
    const auto found = std::ranges::find(records, kind, &map_file::Record::content_case);
    if (found == records.end()) throw std::runtime_error("no such record");
    return found;
  }
  map_file::Header& header() { return *records.front().mutable_header(); }
  std::string& octree() { return *part().mutable_octree(); }
  /// The first that has everything a surface may have.
  map_file::Surface& surface() {
    for (map_file::Record& record : records)
      if (record.has_surface() && record.surface().evidence_size() > 0) return *record.mutable_surface();
    throw std::runtime_error("no surface with evidence");
  }
  map_file::Polygons& polygons() { return *surface().mutable_polygons(); }
  /// Of its vertices' coordinates, from the first on, these of before.
  void pick(const std::vector<int>& from) {
    const map_file::Polygons before = polygons();
    for (int i = 0; i < static_cast<int>(from.size()); ++i) polygons().set_uv(i, before.uv(from[i]));
  }
  map_file::Cylinder& cylinder() { return *first(Kind::kCylinder)->mutable_cylinder(); }
  map_file::Accumulated& accumulated() { return *first(Kind::kAccumulated)->mutable_accumulated(); }
  map_file::SeenPatches& patches() { return *first(Kind::kSeenPatches)->mutable_seen_patches(); }
  /// Of 32³ voxels.
  map_file::Record& part() {
    const auto found = std::ranges::find_if(records, [](const map_file::Record& r) {
      return r.has_octree() && r.key() >> (3 * (16 - occupancy::part_level)) == 1;
    });
    if (found == records.end()) throw std::runtime_error("no such part");
    return *found;
  }
  Records records;
};

/// The first `n` of them.
void scale(google::protobuf::RepeatedField<double>* numbers, double by, int n = 1 << 30) {
  for (int i = 0; i < std::min(n, numbers->size()); ++i) numbers->Set(i, by * numbers->Get(i));
}

using S = Spoiler;
struct Spoiled {
  const char* message;  ///< part of what the Error says
  std::function<void(S&)> spoil;
};

/// Whole files with right checksums that say something impossible.
const std::vector<Spoiled>& spoiled_files() {
  static const std::vector<Spoiled> table{
      // Header
      {"not as this format has it", [](S& s) { s.records.erase(s.records.begin()); }},
      {"not as this format has it", [](S& s) { s.records.front().set_key(7); }},
      {"a parameter 'gravity' that this octosurf does not know",
       [](S& s) { s.header().add_parameters()->set_name("gravity"); }},
      {"a parameter 'a?b?' that", [](S& s) { s.header().add_parameters()->set_name("a\nb\xff"); }},
      {"resolution: is -1", [](S& s) { s.header().mutable_parameters(0)->set_value(-1); }},
      {"resolution: is not given", [](S& s) { s.header().mutable_parameters(0)->clear_value(); }},
      {"a parameter makes no sense", [](S& s) { s.header().mutable_parameters(0)->set_value(not_a_number); }},
      {"a parameter makes no sense", [](S& s) { s.header().mutable_parameters(7)->set_value(1e300); }},
      {"header is not complete", [](S& s) { s.header().clear_revision(); }},
      {"no such next surface id", [](S& s) { s.header().set_next_id(0); }},
      {"no such next surface id", [](S& s) { s.header().set_next_id(last_id + 2); }},
      {"histogram", [](S& s) { s.header().add_noise_histogram(0); }},
      {"noise makes no sense", [](S& s) { s.header().set_range_noise(-1e-9); }},
      {"noise makes no sense", [](S& s) { s.header().set_range_noise(not_a_number); }},
      {"another number of points", [](S& s) { s.header().set_points(s.header().points() + 1); }},
      // Octree
      {"there is no such part", [](S& s) { s.records[1].set_key(0); }},
      {"there is no such part", [](S& s) { s.records[1].set_key(-1); }},
      {"there is no such part", [](S& s) { s.records[1].set_key(std::int64_t{1} << 32); }},
      {"there is no such part", [](S& s) { s.records[1].set_key(std::int64_t{1} << 36); }},
      {"there is no such part", [](S& s) { s.part().set_key(s.part().key() >> 3); }},
      {"ends too early", [](S& s) { s.octree().clear(); }},
      {"ends too early", [](S& s) { s.octree().pop_back(); }},
      {"bytes are left over", [](S& s) { s.octree().push_back('\0'); }},
      {"deeper than 16 levels", [](S& s) { s.octree().assign(20, '\1'); }},
      {"log-odds is not finite", [](S& s) { s.octree().assign("\0\0\0\xc0\x7f\0", 6); }},
      {"has no distance class",
       [](S& s) { s.octree().assign(std::string(5, '\0') + '\1' + std::string(8, '\0')); }},
      {"cannot hold one",
       [](S& s) { s.octree().assign(std::string(5, '\0') + '\1' + std::string(8, '\x11')); }},
      // Waiting points
      {"out of order", [](S& s) { s.accumulated().add_steps(0); }},
      {"outside the octree", [](S& s) { s.accumulated().add_steps(1ULL << 48); }},
      {"outside the octree", [](S& s) { s.accumulated().add_steps(~0ULL); }},
      {"outside the octree",
       [](S& s) {
         s.records.emplace_back().mutable_accumulated()->add_blocks(1ULL << 48);
         s.records.back().set_key(io::first_blocks);
       }},
      {"follow waiting blocks", [](S& s) { s.first(Kind::kAccumulated)->set_key(1LL << 50); }},
      {"out of order", [](S& s) { s.first(Kind::kAccumulated)->set_key(1); }},
      // Marks of kept scans: as many as there are poses
      {"marks of its scans are missing",
       [](S& s) { s.records.emplace_back().mutable_scan_poses()->add_marks(1); }},
      // Surfaces
      {"voxels belong to a surface that is not there",
       [](S& s) { s.records.erase(s.first(Kind::kSurface)); }},
      {"id is out of order", [](S& s) { s.first(Kind::kSurface)->set_key(-1); }},
      {"not given out yet", [](S& s) { s.header().set_next_id(last_surface(s.records).id()); }},
      {"id is out of order", [](S& s) { s.surface().clear_id(); }},
      {"other inliers than the octree", [](S& s) { s.surface().set_inliers(3); }},
      {"other inliers than the octree",
       [](S& s) {
         const auto last = std::ranges::find(s.records | std::views::reverse, Kind::kSurface,
                                             &map_file::Record::content_case);
         s.records.push_back(map_file::Record(*last));
         s.header().set_next_id(s.header().next_id() + 1);
         last_surface(s.records).set_id(s.header().next_id() - 1);
         last_surface(s.records).set_inliers(0);
         s.records.back().set_key(last_surface(s.records).id());
       }},
      {"not of length 1", [](S& s) { scale(s.surface().mutable_plane(), 1.001, 3); }},
      {"not finite", [](S& s) { s.surface().set_plane(3, not_a_number); }},
      {"lacks numbers", [](S& s) { s.surface().clear_plane(); }},
      {"lacks numbers", [](S& s) { s.surface().add_moments(0); }},
      {"not a rigid motion", [](S& s) { s.surface().set_pose(0, s.surface().pose(0) + 1e-3); }},
      {"not a rigid motion",
       [](S& s) {
         for (int i : {0, 4, 8}) s.surface().set_hash_frame(i, -s.surface().hash_frame(i));  // mirrored
       }},
      {"not its plane's", [](S& s) { scale(s.surface().mutable_plane(), -1); }},
      {"not its plane's", [](S& s) { s.surface().set_plane(3, s.surface().plane(3) + 0.1); }},
      {"far outside", [](S& s) { s.surface().set_hash_frame(3, 1e30); }},
      {"far outside", [](S& s) { s.surface().set_reference(0, -1e9); }},
      {"moments that are not its inliers'", [](S& s) { scale(s.surface().mutable_moments(), 1.5); }},
      {"moments that are not its inliers'",
       [](S& s) { s.surface().set_reference(0, s.surface().reference(0) + 1); }},
      {"not finite", [](S& s) { s.surface().set_moments(50, HUGE_VAL); }},
      // Its evidence: readings, weight, sum, sum of outer products
      {"lacks numbers", [](S& s) { s.surface().mutable_evidence()->RemoveLast(); }},
      {"lacks numbers", [](S& s) { s.surface().add_evidence(0); }},
      {"not finite", [](S& s) { s.surface().set_evidence(0, not_a_number); }},
      {"not finite", [](S& s) { s.surface().set_evidence(0, HUGE_VAL); }},
      {"not finite", [](S& s) { s.surface().set_evidence(9, -HUGE_VAL); }},
      {"counts that make no sense", [](S& s) { s.surface().set_checked_inliers(~0ULL); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(0, -1); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(1, -1e-9); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(2, 1e30); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(6, 1e30); }},
      {"evidence that no scan gives",
       [](S& s) { s.surface().set_evidence(6, s.surface().evidence(6) + 10 * s.surface().evidence(1)); }},
      {"lacks numbers", [](S& s) { s.surface().add_covariance(0); }},
      {"not finite", [](S& s) { s.surface().set_covariance(2, not_a_number); }},
      {"covariance that no fit gives",
       [](S& s) { s.surface().set_covariance(5, -s.surface().covariance(5)); }},
      {"covariance that no fit gives", [](S& s) { s.surface().set_covariance(1, 1); }},
      {"covariance that no fit gives", [](S& s) { s.surface().set_covariance(0, 1e300); }},
      {"covariance that no fit gives", [](S& s) { scale(s.surface().mutable_covariance(), 0); }},
      {"do not add up", [](S& s) { s.polygons().set_vertices(0, 1 << 30); }},
      {"do not add up", [](S& s) { s.polygons().add_rings(0xffffffff); }},
      {"do not add up", [](S& s) { s.polygons().add_uv(0); }},
      {"without rings", [](S& s) { s.polygons().add_rings(0); }},
      {"fewer than three",
       [](S& s) {
         s.polygons().add_rings(1);
         s.polygons().add_vertices(2);
         for (int i = 0; i < 4; ++i) s.polygons().add_uv(i);
       }},
      // Rings that are none: with a right checksum these crashed triangulations, or went round in them for
      // ever.
      {"a vertex twice",
       [](S& s) {
         s.pick({0, 1, 0, 1, 0, 1});
       }},
      {"a vertex twice",
       [](S& s) {
         s.pick({0, 1, 2, 3, 0, 1});
       }},  // a spike: there and back
      {"a ring",
       [](S& s) {  // the other way round
         std::vector<int> back;
         for (int i = static_cast<int>(s.polygons().vertices(0)); --i >= 0;)
           back.insert(back.end(), {2 * i, 2 * i + 1});
         s.pick(back);
       }},
      {"more than h apart", [](S& s) { scale(s.polygons().mutable_uv(), 5); }},
      {"counts make no sense", [](S& s) { s.header().set_revision(~0ULL); }},
      {"counts make no sense", [](S& s) { s.header().set_scans(1ULL << 48); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(0, 1e30); }},
      {"a polygon outside", [](S& s) { s.polygons().set_uv(1, not_a_number); }},
      {"a polygon outside", [](S& s) { s.polygons().set_uv(0, 1e12); }},
      {"parent that never was", [](S& s) { s.surface().add_parents(s.header().next_id()); }},
      {"parent that never was", [](S& s) { s.surface().add_parents(0); }},
      {"one that is to come", [](S& s) { s.surface().set_revision(s.header().revision() + 1); }},
      // Patches that were seen
      {"out of order", [](S& s) { s.patches().set_keys(1, s.patches().keys(0)); }},
      {"lacks numbers", [](S& s) { s.patches().mutable_looks()->RemoveLast(); }},
      {"lacks numbers", [](S& s) { s.patches().add_planes(0); }},
      {"makes no sense", [](S& s) { s.patches().set_planes(0, not_a_number); }},
      {"makes no sense", [](S& s) { s.patches().set_planes(1, 1e12); }},
      {"makes no sense", [](S& s) { s.patches().set_looks(0, 2); }},   // a normal
      {"makes no sense", [](S& s) { s.patches().set_looks(3, -1); }},  // a weight
  };
  return table;
}

const std::vector<Spoiled>& spoiled_cylinders() {
  static const std::vector<Spoiled> table{
      {"no such next cylinder id", [](S& s) { s.header().set_next_cylinder_id(0); }},
      {"not given out yet",
       [](S& s) {
         s.header().clear_next_cylinder_id();
         s.cylinder().set_id(2);
         s.records.back().set_key(2);
       }},
      {"not given out yet", [](S& s) { s.header().set_next_cylinder_id(s.cylinder().id()); }},
      {"id is out of order", [](S& s) { s.cylinder().clear_id(); }},
      {"id is out of order", [](S& s) { s.records.back().set_key(0); }},
      {"is not to have any",
       [](S& s) {
         for (auto& p : *s.header().mutable_parameters())
           if (p.name() == "detect_cylinders") p.set_value(0);
       }},
      {"lacks numbers", [](S& s) { s.cylinder().clear_shape(); }},
      {"lacks numbers", [](S& s) { s.cylinder().add_shape(0); }},
      {"lacks numbers", [](S& s) { s.cylinder().clear_unchecked(); }},
      {"lacks numbers", [](S& s) { s.cylinder().set_unchecked(~0ULL); }},
      {"not finite", [](S& s) { s.cylinder().set_shape(0, not_a_number); }},
      {"not finite", [](S& s) { s.cylinder().set_shape(6, HUGE_VAL); }},
      {"not of length 1", [](S& s) { s.cylinder().set_shape(5, 2); }},
      {"not of length 1",
       [](S& s) {
         for (int i : {3, 4, 5}) s.cylinder().set_shape(i, 0);
       }},
      {"radius that makes no sense", [](S& s) { s.cylinder().set_shape(6, 0); }},
      {"radius that makes no sense", [](S& s) { s.cylinder().set_shape(6, 1e6); }},
      {"far outside", [](S& s) { s.cylinder().set_shape(2, 1e9); }},
      {"off its lateral", [](S& s) { s.cylinder().set_shape(6, s.cylinder().shape(6) + 0.6); }},
      {"off its lateral", [](S& s) { s.cylinder().set_shape(0, s.cylinder().shape(0) + 5); }},
      {"fewer than n", [](S& s) { s.cylinder().clear_steps(); }},
      {"out of order", [](S& s) { s.cylinder().set_steps(1, 0); }},
      {"outside the octree", [](S& s) { s.cylinder().add_steps(~0ULL); }},
      {"outside the octree",
       [](S& s) {
         s.cylinder().add_steps(1ULL << 47);
         s.cylinder().add_steps(1ULL << 47);
       }},
      {"not pending, or another's", [](S& s) { s.cylinder().set_steps(0, s.cylinder().steps(0) - 1); }},
      {"not pending, or another's",
       [](S& s) {
         s.header().set_next_cylinder_id(s.header().next_cylinder_id() + 1);
         s.records.push_back(map_file::Record(s.records.back()));
         s.records.back().mutable_cylinder()->set_id(s.header().next_cylinder_id() - 1);
         s.records.back().set_key(s.header().next_cylinder_id() - 1);
       }},
      {"one that is to come", [](S& s) { s.cylinder().set_revision(s.header().revision() + 1); }},
      {"one that is to come", [](S& s) { s.cylinder().clear_revision(); }},
  };
  return table;
}

TEST_F(DamagedMapFiles, WholeFilesThatSayTheImpossible) {
  ASSERT_EQ(unpack(with_cylinder).back().content_case(), map_file::Record::kCylinder);
  for (const auto& [file, table] : {std::pair(good, spoiled_files()), {with_cylinder, spoiled_cylinders()}}) {
    ASSERT_EQ(loading(file), "loaded");
    for (std::size_t i = 0; i < table.size(); ++i) {
      Spoiler spoiler(file);
      ASSERT_NO_THROW(table[i].spoil(spoiler)) << "entry " << i;
      EXPECT_THAT(loading(pack(spoiler.records)), HasSubstr(table[i].message)) << "entry " << i;
    }
  }
}

TEST_F(DamagedMapFiles, SumsThatDoNotFit) {
  const std::vector<std::string> records = records_of(good);
  EXPECT_EQ(loading(map_file_of(records)), "loaded");
  for (const auto& spoil : std::vector<std::function<void(map_file::Files&)>>{
           [](map_file::Files& f) { f.set_rows(f.rows() + 1); },
           [](map_file::Files& f) { f.set_digest(f.digest() + 1); }})
    EXPECT_THAT(loading(map_file_of(records, spoil)), HasSubstr("rows are missing"));
}

/// Changes bytes inside a record, with a checksum that is right: whatever still loads must do no harm.
TEST_F(DamagedMapFiles, MutatedRecordsDoNoHarm) {
  std::mt19937_64 rng(seed());
  const std::array<Scan, 2> scans{changing_room(10)[7], pillar(10)[7]};
  int loaded = 0;
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE(round);
    const bool cylinder = round % 4 == 0;
    const Scan& scan = scans[cylinder ? 1 : 0];
    std::vector<std::string> mutated = records_of(cylinder ? with_cylinder : good);
    // Only its content: a wrong tag or length is refused at once.
    std::string& record = cylinder ? mutated.back() : mutated[rng() % mutated.size()];
    for (auto n = rng() % 3 + 1; n > 0; --n)
      record[6 + rng() % (record.size() - 6)] = static_cast<char>(rng() % 4 == 0 ? 0xff : rng());
    if (loading(map_file_of(mutated)) != "loaded") continue;
    ++loaded;
    Mapper mapper(load_map(folder / "map").map);
    check_invariants(mapper.map());
    mapper.insert(scan);
    try {
      bytes_of(mapper.map());
    } catch (const Error& grown) {  // just below a limit when it was read
      EXPECT_THAT(grown.what(), HasSubstr("is not saved so"));
    }
  }
  EXPECT_GT(loaded, 20) << "nothing of what this test is about happened";
  EXPECT_LT(loaded, 380);
}

using Removals = MapFiles;

TEST_F(Removals, ComeBackWithWhoTookThemIn) {
  const Map map = map_of(pillar(30, 20));  // it is taken away
  save_map(map, folder / "a");
  const Map loaded = load_map(folder / "a").map;
  EXPECT_EQ(difference(map, loaded), "");
  std::size_t told = 0;
  for (std::uint64_t since = 0; since <= map.snapshot()->revision; ++since) {
    const auto told_of = [&](const MapChanges& c) {
      return std::tuple(c.gone, c.merged, c.split, c.appeared, c.cylinders_gone);
    };
    const MapChanges saved = changes_since(*map.snapshot(), since);
    EXPECT_EQ(told_of(changes_since(*loaded.snapshot(), since)), told_of(saved));
    told += saved.gone.size() + saved.merged.size() + saved.cylinders_gone.size();
  }
  EXPECT_GT(told, 0U);
}

TEST_F(Removals, ManyComeBackInOrder) {
  Map map = map_of(changing_room(5));
  std::vector<Removal> many;
  const SurfaceId first = surfaces::state_of(map).surfaces.next_id();
  for (SurfaceId i = 0; i < 20000; ++i)
    many.push_back(
        {Removal::Of::surface, first + i, i % 3 == 0 ? SurfaceId{1} : 0, i / 9000, 1 + i / 8000, {1, 2}});
  surfaces::state_of(map).surfaces.set_next_id(first + 20000);
  surfaces::state_of(map).removals = RemovalLog(640, 1).with(many);
  save_map(map, folder / "a");
  const LoadedMap loaded = load_map(folder / "a");
  std::vector<Removal> read;
  loaded.map.snapshot()->removals.for_each_since(0, [&](const Removal& d) { read.push_back(d); });
  EXPECT_EQ(read, many);
  EXPECT_EQ(loaded.map.snapshot()->removals.left_out(), 640U);
  EXPECT_EQ(loaded.map.snapshot()->removals.complete_since(), 1U);
}

TEST_F(DamagedMapFiles, RemovalsThatCannotBe) {
  const Records whole = without_history(map_of(changing_room(6)));
  const std::uint64_t next = whole.front().header().next_id();
  const std::uint64_t revision = whole.front().header().revision();
  using D = map_file::Removal;
  const std::vector<std::pair<const char*, std::function<void(D&, D&)>>> table{
      {"loaded", [](D&, D&) {}},
      {"never there", [](D& a, D&) { a.clear_id(); }},
      {"never there", [&](D&, D& b) { b.set_id(next + 2); }},
      {"never there", [](D& a, D&) { a.set_cylinder(true); }},
      {"has not gone", [&](D& a, D&) { a.set_id(Spoiler(pack(whole)).surface().id()); }},
      {"gone twice", [&](D&, D& b) { b.set_id(next); }},
      {"into what never was", [&](D& a, D&) { a.set_into(next); }},
      {"into what never was", [&](D& a, D&) { a.set_into(next + 2); }},
      {"out of order", [&](D&, D& b) { b.set_revision(revision + 1); }},
      {"out of order", [](D&, D& b) { b.set_revision(1); }},
      {"out of order", [](D& a, D&) { a.set_born(5); }},
      {"parent that never was", [](D& a, D&) { a.add_parents(0); }},
      {"parent that never was", [&](D& a, D&) { a.add_parents(next + 2); }}};
  for (const auto& [message, spoil] : table) {
    Records records = whole;
    records.front().mutable_header()->set_next_id(next + 2);
    map_file::Removals& removals = *records.emplace_back().mutable_removals();
    records.back().set_key(0);
    for (std::uint32_t i = 0; i < 2; ++i) {
      D& removal = *removals.add_removals();
      removal.set_id(next + i);
      removal.set_born(1);
      removal.set_revision(2 + i);
      removal.add_parents(1);
    }
    spoil(*removals.mutable_removals(0), *removals.mutable_removals(1));
    EXPECT_THAT(loading(pack(records)), HasSubstr(message));
  }
}

}  // namespace
}  // namespace octosurf::test
