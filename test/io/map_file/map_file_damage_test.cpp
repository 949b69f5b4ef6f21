// Damaged, foreign and hostile map files: an Error(data), never anything worse.
#include "io/map_file/map_file.hpp"
#include "io/map_file/record_stream.hpp"
#include "map_files.hpp"
#include "support/invariants.hpp"
#include "support/packed_map.hpp"
#include "surfaces/map_state.hpp"

#include <boost/crc.hpp>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <ranges>
#include <zstd.h>

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
  for (const std::string& content : {std::string(), std::string("a text\n"), good.substr(12),
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
    bytes[8] = static_cast<char>(version);
    EXPECT_THAT(loading(bytes), says("has version " + std::to_string(version), words,
                                     "this octosurf reads version " + std::to_string(ours)));
  }
  bytes[8] = 0;
  EXPECT_THAT(loading(bytes), HasSubstr("has no version"));
}

/// A file whose zstd frame is `size` times `unit`, compressed with the given window.
std::string repeated(const std::string& unit, std::size_t times, int window_log) {
  std::string file(io::map_file_magic);
  file += {static_cast<char>(io::map_file_version), 0, 0, 0};
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, window_log);
  std::vector<char> buffer(1 << 17);
  for (std::size_t i = 0; i <= times; ++i) {
    ZSTD_inBuffer in{unit.data(), i < times ? unit.size() : 0, 0};
    for (std::size_t left = 1; left != 0;) {
      ZSTD_outBuffer out{buffer.data(), buffer.size(), 0};
      left = ZSTD_compressStream2(context.get(), &out, &in, i < times ? ZSTD_e_continue : ZSTD_e_end);
      file.append(buffer.data(), out.pos);
      if (i < times && in.pos == in.size) break;
    }
  }
  return file;
}

/// What reading these records is refused with, after so many of them.
std::string refused(const std::string& unit, std::size_t times, std::uint64_t most, std::uint64_t after) {
  std::istringstream in(repeated(unit, times, 21).substr(12));
  io::RecordReader reader(in, most, "records");
  const std::string message = failure(Error::Kind::data, [&] {
    for (std::string record; reader.next(record);) EXPECT_LE(record.capacity(), io::record_limit + most);
  });
  EXPECT_EQ(reader.records(), after);
  return message;
}

TEST_F(DamagedMapFiles, Bombs) {
  for (const char byte : {'\xff', '\0'})
    EXPECT_THAT(loading(repeated(std::string(1 << 20, byte), 2000, 21)), HasSubstr("is damaged"));
  EXPECT_THAT(loading(repeated(good, 1, 27)), HasSubstr("zstd says")) << "its window is 128 MiB";
  // One octree record after the other, as large as they may be, and then many more.
  const std::string length = "\xff\xff\xff\x1f";  // just below the limit: 2²⁶ − 1
  EXPECT_THAT(refused(length + std::string((std::size_t{1} << 26) - 1, '\0'), 40, 100 << 20, 1),
              HasSubstr("decompresses to far more"));
}

TEST_F(DamagedMapFiles, LengthsAreNotTrusted) {
  for (const auto& [plain, words] : {std::pair("\xff\xff\xff\x1f....", "ends within a record"),
                                     {"\x81\x80\x80\x20....", "over the limit"},
                                     {"\xff\xff\xff\xff\xff\xff", "a length has no end"},
                                     {"\x80", "ends within a length"}})
    EXPECT_THAT(refused(plain, 1, 1 << 20, 0), HasSubstr(words));
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
  std::string& octree() { return *records[1].mutable_octree(); }
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
  void repeat(Kind kind) {
    const map_file::Record copy = *first(kind);
    records.insert(first(kind), copy);
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
      {"begin with a header", [](S& s) { s.records.erase(s.records.begin()); }},
      {"another number of points", [](S& s) { s.repeat(Kind::kHeader); }},
      {"a parameter 'gravity' that this octosurf does not know",
       [](S& s) { s.header().add_parameters()->set_name("gravity"); }},
      {"a parameter 'a?b?' that", [](S& s) { s.header().add_parameters()->set_name("a\nb\xff"); }},
      {"resolution: is -1", [](S& s) { s.header().mutable_parameters(0)->set_value(-1); }},
      {"resolution: is not given", [](S& s) { s.header().mutable_parameters(0)->clear_value(); }},
      {"a parameter makes no sense", [](S& s) { s.header().mutable_parameters(0)->set_value(not_a_number); }},
      {"a parameter makes no sense", [](S& s) { s.header().mutable_parameters(7)->set_value(1e300); }},
      {"header is not complete", [](S& s) { s.header().clear_revision(); }},
      {"header is not complete", [](S& s) { s.header().clear_bt_crc32(); }},
      {"no such next surface id", [](S& s) { s.header().set_next_id(0); }},
      {"no such next surface id", [](S& s) { s.header().set_next_id((1 << 24) + 1); }},
      {"histogram", [](S& s) { s.header().add_noise_histogram(0); }},
      {"noise makes no sense", [](S& s) { s.header().set_range_noise(-1e-9); }},
      {"noise makes no sense", [](S& s) { s.header().set_range_noise(not_a_number); }},
      {"another number of points", [](S& s) { s.header().set_points(s.header().points() + 1); }},
      // Octree
      {"chunk is empty", [](S& s) { s.octree().clear(); }},
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
      {"outside the octree", [](S& s) { s.accumulated().add_blocks(1ULL << 48); }},
      {"follow waiting blocks",
       [](S& s) {
         s.accumulated().add_blocks(0);
         s.repeat(Kind::kAccumulated);
       }},
      // Marks of kept scans: as many as there are poses
      {"marks of its scans are missing",
       [](S& s) { s.records.insert(s.first(Kind::kSurface), {})->mutable_scan_poses()->add_marks(1); }},
      // Surfaces
      {"voxels belong to a surface that is not there",
       [](S& s) { s.records.erase(s.first(Kind::kSurface)); }},
      {"id is out of order", [](S& s) { s.repeat(Kind::kSurface); }},
      {"not given out yet", [](S& s) { last_surface(s.records).set_id(s.header().next_id()); }},
      {"id is out of order", [](S& s) { s.surface().clear_id(); }},
      {"other inliers than the octree", [](S& s) { s.surface().set_inliers(3); }},
      {"other inliers than the octree",
       [](S& s) {
         const auto last = std::ranges::find(s.records | std::views::reverse, Kind::kSurface,
                                             &map_file::Record::content_case);
         s.records.insert(last.base(), map_file::Record(*last));
         s.header().set_next_id(s.header().next_id() + 1);
         last_surface(s.records).set_id(s.header().next_id() - 1);
         last_surface(s.records).set_inliers(0);
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
      // Order
      {"voxels belong to a surface that is not there",
       [](S& s) { std::swap(*s.first(Kind::kAccumulated), *s.first(Kind::kSurface)); }},
      {"records are missing", [](S& s) { s.records.emplace_back().mutable_footer(); }},
      {"not one field", [](S& s) { s.records.emplace_back(); }},
      {"out of order",
       [](S& s) { s.records.emplace_back().mutable_unknown_fields()->assign("\x3a\x00", 2); }},
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
       }},
      {"not given out yet", [](S& s) { s.cylinder().set_id(s.header().next_cylinder_id()); }},
      {"id is out of order", [](S& s) { s.cylinder().clear_id(); }},
      {"id is out of order", [](S& s) { s.repeat(Kind::kCylinder); }},
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
         s.repeat(Kind::kCylinder);
         s.records.back().mutable_cylinder()->set_id(s.header().next_cylinder_id() - 1);
       }},
      {"one that is to come", [](S& s) { s.cylinder().set_revision(s.header().revision() + 1); }},
      {"one that is to come", [](S& s) { s.cylinder().clear_revision(); }},
      {"a surface that is not there",
       [](S& s) { std::swap(s.records.back(), s.records[s.records.size() - 2]); }},
  };
  return table;
}

TEST_F(DamagedMapFiles, WholeFilesThatSayTheImpossible) {
  ASSERT_EQ(unpack(with_cylinder).back().content_case(), map_file::Record::kCylinder);
  for (const auto& [file, table] : {std::pair(good, spoiled_files()), {with_cylinder, spoiled_cylinders()}}) {
    ASSERT_EQ(loading(file), "loaded");
    ASSERT_EQ(pack(unpack(file)), file);
    for (std::size_t i = 0; i < table.size(); ++i) {
      Spoiler spoiler(file);
      ASSERT_NO_THROW(table[i].spoil(spoiler)) << "entry " << i;
      EXPECT_THAT(loading(pack(spoiler.records)), HasSubstr(table[i].message)) << "entry " << i;
    }
  }
}

/// Another way to the checksum: of all records but the last, each behind its length.
std::uint32_t crc_of(const std::vector<std::string>& records) {
  boost::crc_32_type crc;
  for (std::size_t i = 0; i + 1 < records.size(); ++i) {
    std::string length;
    {
      google::protobuf::io::StringOutputStream stream(&length);
      google::protobuf::io::CodedOutputStream(&stream).WriteVarint64(records[i].size());
    }
    crc.process_bytes(length.data(), length.size());
    crc.process_bytes(records[i].data(), records[i].size());
  }
  return crc.checksum();
}

TEST_F(DamagedMapFiles, AFooterThatDoesNotFit) {
  std::vector<std::string> bytes = records_of(good);
  EXPECT_THAT(loading(map_file_of(bytes, false)), HasSubstr("records are missing"));
  map_file::Record footer;
  footer.mutable_footer()->set_records(bytes.size());
  footer.mutable_footer()->set_crc32(0);
  bytes.push_back(footer.SerializeAsString());
  EXPECT_THAT(loading(map_file_of(bytes, false)), HasSubstr("checksum differs"));
  footer.mutable_footer()->set_crc32(crc_of(bytes));
  bytes.back() = footer.SerializeAsString();
  EXPECT_EQ(loading(map_file_of(bytes, false)), "loaded");
  EXPECT_THAT(loading(map_file_of(bytes, true)), HasSubstr("records follow the last one"));
  EXPECT_THAT(loading(map_file_of({}, false)), HasSubstr("begin with a header"));
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
    many.push_back({Removal::Of::surface, first + i, i % 3 == 0 ? 1U : 0U, i / 9000, 1 + i / 8000, {1, 2}});
  surfaces::state_of(map).surfaces.set_next_id(first + 20000);
  surfaces::state_of(map).removals = RemovalLog().with(many);
  save_map(map, folder / "a");
  const LoadedMap loaded = load_map(folder / "a");
  std::vector<Removal> read;
  loaded.map.snapshot()->removals.for_each_since(0, [&](const Removal& d) { read.push_back(d); });
  EXPECT_EQ(read, many);
}

TEST_F(DamagedMapFiles, RemovalsThatCannotBe) {
  const Records whole = without_history(map_of(changing_room(6)));
  const std::uint32_t next = whole.front().header().next_id();
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

constexpr io::Expansion limits{.free = std::uint64_t{1} << 20, .ratio = 12};
constexpr std::size_t megabyte = std::size_t{1} << 20;

std::string written(const std::vector<std::string>& records) {
  std::ostringstream out;
  io::RecordWriter writer(out);
  for (const std::string& record : records) writer.put(record);
  writer.finish(limits.least_file(writer.bytes()));
  return out.str();
}

std::vector<std::string> read(const std::string& file) {
  std::istringstream in(file);
  io::RecordReader reader(in, limits.most(file.size()), "file");
  std::vector<std::string> records;
  for (std::string record; reader.next(record);) records.push_back(record);
  return records;
}

TEST(RecordStream, WhatShrinksFarComesBack) {
  for (const std::size_t count : {1, 2, 20}) {
    const std::vector<std::string> records(count, std::string(megabyte, '\0'));
    EXPECT_EQ(read(written(records)), records);
    EXPECT_LT(written(records).size(), count * megabyte / 8) << "no longer than needed";
  }
}

TEST(RecordStream, WhatShrinksAsUsualIsNotMadeLonger) {
  std::mt19937_64 rng(seed());
  std::string noise(2 * megabyte, '\0');
  for (char& byte : noise) byte = static_cast<char>(rng() & 0xff);
  EXPECT_EQ(read(written({noise})), std::vector{noise});
  EXPECT_LT(written({noise}).size(), noise.size() + 1024);
}

TEST(RecordStream, DamageBehindTheFrameIsSeen) {
  std::mt19937_64 rng(seed());
  const std::string file = written({std::string(20 * megabyte, '\0')});
  const std::size_t zeros_from = file.find(std::string(4096, '\0'));
  ASSERT_NE(zeros_from, std::string::npos);
  ASSERT_NO_THROW(read(file));
  EXPECT_THROW(read(file + '\0'), Error);
  for (int round = 0; round < 20; ++round) {
    std::string damaged = file;
    char& byte = damaged[zeros_from - 8 + rng() % (file.size() - zeros_from + 8)];
    byte = static_cast<char>(byte ^ (1 << rng() % 8));
    EXPECT_THROW(read(damaged), Error);
    EXPECT_THROW(read(file.substr(0, zeros_from + rng() % (file.size() - zeros_from))), Error);
  }
}

}  // namespace
}  // namespace octosurf::test
