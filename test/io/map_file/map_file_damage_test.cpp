// Damaged, foreign and hostile map files: an Error(data), never anything worse.
#include "io/map_file/map_file.hpp"
#include "io/map_file/record_stream.hpp"
#include "map_files.hpp"
#include "support/invariants.hpp"
#include "support/packed_map.hpp"

#include <boost/crc.hpp>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <zstd.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

class DamagedMapFiles : public MapFiles {
 protected:
  static void SetUpTestSuite() {
    // Made once for all tests: what varies from world to world is the damage.
    Parameters few_voxels;
    few_voxels.occupancy.resolution = 0.1;
    good = new std::string(
        bytes_of(map_of(changing_room(9, std::mt19937_64(20)), few_voxels)));    // fixed: see above
    auto records = unpack(bytes_of(map_of(pillar(5, 0, std::mt19937_64(21)))));  // fixed: see above
    std::erase_if(records, [](const map_file::Record& record) {
      return record.has_removals() || record.has_seen_patches();
    });
    with_cylinder = new std::string(pack(records));
  }
  static void TearDownTestSuite() {
    delete good;
    delete with_cylinder;
  }
  static std::string *good, *with_cylinder;
};
std::string* DamagedMapFiles::good = nullptr;
std::string* DamagedMapFiles::with_cylinder = nullptr;

TEST_F(DamagedMapFiles, ForeignFiles) {
  const auto foreign = HasSubstr("is not an octosurf map");
  EXPECT_THAT(loading(""), foreign);
  EXPECT_THAT(loading("a text\n"), foreign);
  EXPECT_THAT(loading("\x89PNG\r\n\x1a\n and more of the picture"), foreign);
  EXPECT_THAT(loading("# Octomap OcTree binary file\nid OcTree\nsize 1\nres 0.1\ndata\n"), foreign);
  EXPECT_THAT(loading(good->substr(12)), foreign) << "zstd, but not a map";
  loading("");
  fs::resize_file(folder / "map.surfaces", std::uintmax_t{8} << 30);  // zeros, with holes
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "map"); }), foreign);
}

TEST_F(DamagedMapFiles, OtherVersions) {
  std::string bytes = *good;
  constexpr std::uint32_t ours = io::map_file_version;
  const std::string reads = "this octosurf reads version " + std::to_string(ours);
  bytes[8] = static_cast<char>(ours + 1);
  EXPECT_THAT(loading(bytes), AllOf(HasSubstr("has version " + std::to_string(ours + 1)), HasSubstr(reads),
                                    HasSubstr("newer octosurf")));
  bytes[8] = static_cast<char>(ours - 1);
  EXPECT_THAT(loading(bytes), AllOf(HasSubstr("has version " + std::to_string(ours - 1)), HasSubstr(reads),
                                    HasSubstr("make the map anew")));
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

TEST_F(DamagedMapFiles, Bombs) {
  const std::string megabyte(1 << 20, '\xff');
  EXPECT_THAT(loading(repeated(megabyte, 2000, 21)), HasSubstr("is damaged"));
  EXPECT_THAT(loading(repeated(std::string(1 << 20, '\0'), 2000, 21)), HasSubstr("is damaged"));
  EXPECT_THAT(loading(repeated(*good, 1, 27)), HasSubstr("zstd says")) << "its window is 128 MiB";

  // One octree record after the other, as large as they may be, and then many more.
  std::string chunk = "\xff\xff\xff\x1f";  // a length just below the limit: 2²⁶ − 1
  chunk.append((std::size_t{1} << 26) - 1, '\0');
  const std::string bomb = repeated(chunk, 40, 21);
  std::istringstream in(bomb.substr(12));
  io::RecordReader reader(in, 100 << 20, "bomb");
  EXPECT_THAT(failure(Error::Kind::data,
                      [&] {
                        for (std::string record; reader.next(record);)
                          EXPECT_LE(record.size(), io::record_limit);
                      }),
              HasSubstr("decompresses to far more"));
  EXPECT_EQ(reader.records(), 1U);
}

TEST_F(DamagedMapFiles, LengthsAreNotTrusted) {
  const auto stream = [](const std::string& plain) {
    const std::string file = repeated(plain, 1, 17);
    std::istringstream in(file.substr(12));
    io::RecordReader reader(in, 1 << 20, "lengths");
    return failure(Error::Kind::data, [&] {
      for (std::string record; reader.next(record);) EXPECT_LE(record.capacity(), std::size_t{2} << 20);
    });
  };
  EXPECT_THAT(stream("\xff\xff\xff\x1f...."), HasSubstr("ends within a record"));
  EXPECT_THAT(stream("\x81\x80\x80\x20...."), HasSubstr("over the limit"));
  EXPECT_THAT(stream("\xff\xff\xff\xff\xff\xff"), HasSubstr("a length has no end"));
  EXPECT_THAT(stream("\x80"), HasSubstr("ends within a length"));
}

using Records = std::vector<map_file::Record>;

/// Records of the good file by kind, to be spoiled and packed again with a checksum that is right.
struct Spoiler {
  explicit Spoiler(const std::string& file) : records(unpack(file)) {}
  std::size_t first(map_file::Record::ContentCase kind) const {
    const auto found =
        std::ranges::find_if(records, [&](const auto& record) { return record.content_case() == kind; });
    if (found == records.end()) throw std::runtime_error("no such record");
    return static_cast<std::size_t>(found - records.begin());
  }
  std::size_t last(map_file::Record::ContentCase kind) const {
    std::size_t found = first(kind);
    for (std::size_t i = found; i < records.size(); ++i)
      if (records[i].content_case() == kind) found = i;
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
  map_file::Cylinder& cylinder() { return *records[first(map_file::Record::kCylinder)].mutable_cylinder(); }
  map_file::Accumulated& accumulated() {
    return *records[first(map_file::Record::kAccumulated)].mutable_accumulated();
  }
  map_file::SeenPatches& patches() {
    return *records[first(map_file::Record::kSeenPatches)].mutable_seen_patches();
  }
  void erase(std::size_t i) { records.erase(records.begin() + static_cast<std::ptrdiff_t>(i)); }
  void repeat(std::size_t i) {
    const map_file::Record copy = records[i];
    records.insert(records.begin() + static_cast<std::ptrdiff_t>(i), copy);
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
  using Record = map_file::Record;
  static const std::vector<Spoiled> table{
      // Header
      {"begin with a header", [](S& s) { s.erase(0); }},
      {"another number of points", [](S& s) { s.repeat(0); }},
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
         s.repeat(s.first(Record::kAccumulated));
       }},
      // Surfaces
      {"voxels belong to a surface that is not there", [](S& s) { s.erase(s.first(Record::kSurface)); }},
      {"id is out of order", [](S& s) { s.repeat(s.first(Record::kSurface)); }},
      {"not given out yet",
       [](S& s) { s.records[s.last(Record::kSurface)].mutable_surface()->set_id(s.header().next_id()); }},
      {"id is out of order", [](S& s) { s.surface().clear_id(); }},
      {"other inliers than the octree", [](S& s) { s.surface().set_inliers(3); }},
      {"other inliers than the octree",
       [](S& s) {
         s.header().set_next_id(s.header().next_id() + 1);
         const std::size_t last = s.last(Record::kSurface);
         s.repeat(last);
         s.records[last + 1].mutable_surface()->set_id(s.header().next_id() - 1);
         s.records[last + 1].mutable_surface()->set_inliers(0);
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
      {"do not add up", [](S& s) { s.surface().mutable_polygons()->set_vertices(0, 1 << 30); }},
      {"do not add up", [](S& s) { s.surface().mutable_polygons()->add_rings(0xffffffff); }},
      {"do not add up", [](S& s) { s.surface().mutable_polygons()->add_uv(0); }},
      {"without rings", [](S& s) { s.surface().mutable_polygons()->add_rings(0); }},
      {"fewer than three",
       [](S& s) {
         auto& p = *s.surface().mutable_polygons();
         p.add_rings(1);
         p.add_vertices(2);
         for (int i = 0; i < 4; ++i) p.add_uv(i);
       }},
      // Rings that are none: with a right checksum these crashed triangulations, or went round in them for
      // ever.
      {"a vertex twice",
       [](S& s) {
         auto& p = *s.surface().mutable_polygons();
         for (int i = 0; i < 6; ++i) p.set_uv(i, p.uv(i % 2));
       }},
      {"a vertex twice",  // a spike: there and back
       [](S& s) {
         auto& p = *s.surface().mutable_polygons();
         for (int i = 0; i < 2; ++i) p.set_uv(i + 4, p.uv(i));
       }},
      {"a ring",
       [](S& s) {  // the other way round
         auto& p = *s.surface().mutable_polygons();
         for (int a = 0, b = static_cast<int>(p.vertices(0)) - 1; a < b; ++a, --b)
           for (int i = 0; i < 2; ++i) std::swap((*p.mutable_uv())[2 * a + i], (*p.mutable_uv())[2 * b + i]);
       }},
      {"more than h apart", [](S& s) { scale(s.surface().mutable_polygons()->mutable_uv(), 5); }},
      {"counts make no sense", [](S& s) { s.header().set_revision(~0ULL); }},
      {"counts make no sense", [](S& s) { s.header().set_scans(1ULL << 48); }},
      {"evidence that no scan gives", [](S& s) { s.surface().set_evidence(0, 1e30); }},
      {"a polygon outside", [](S& s) { s.surface().mutable_polygons()->set_uv(1, not_a_number); }},
      {"a polygon outside", [](S& s) { s.surface().mutable_polygons()->set_uv(0, 1e12); }},
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
       [](S& s) {
         std::swap(s.records[s.first(Record::kAccumulated)], s.records[s.first(Record::kSurface)]);
       }},
      {"records are missing", [](S& s) { s.records.emplace_back().mutable_footer(); }},
      {"not one field", [](S& s) { s.records.emplace_back(); }},
      {"out of order",
       [](S& s) { s.records.emplace_back().mutable_unknown_fields()->assign("\x3a\x00", 2); }},
  };
  return table;
}

const std::vector<Spoiled>& spoiled_cylinders() {
  using Record = map_file::Record;
  static const std::vector<Spoiled> table{
      {"no such next cylinder id", [](S& s) { s.header().set_next_cylinder_id(0); }},
      {"not given out yet",
       [](S& s) {
         s.header().clear_next_cylinder_id();
         s.cylinder().set_id(2);
       }},
      {"not given out yet", [](S& s) { s.cylinder().set_id(s.header().next_cylinder_id()); }},
      {"id is out of order", [](S& s) { s.cylinder().clear_id(); }},
      {"id is out of order", [](S& s) { s.repeat(s.first(Record::kCylinder)); }},
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
         s.repeat(s.first(Record::kCylinder));
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
  ASSERT_EQ(unpack(*with_cylinder).back().content_case(), map_file::Record::kCylinder);
  for (const auto& [file, table] :
       {std::pair(good, &spoiled_files()), {with_cylinder, &spoiled_cylinders()}}) {
    ASSERT_EQ(loading(*file), "loaded");
    ASSERT_EQ(pack(unpack(*file)), *file);
    for (std::size_t i = 0; i < table->size(); ++i) {
      Spoiler spoiler(*file);
      ASSERT_NO_THROW((*table)[i].spoil(spoiler)) << "entry " << i;
      EXPECT_THAT(loading(pack(spoiler.records)), HasSubstr((*table)[i].message)) << "entry " << i;
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
  const Records records = unpack(*good);
  std::vector<std::string> bytes;
  for (const map_file::Record& record : records) bytes.push_back(record.SerializeAsString());
  EXPECT_THAT(loading(map_file_of(bytes, false)), HasSubstr("records are missing"));
  map_file::Record footer;
  footer.mutable_footer()->set_records(records.size());
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
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const std::array<Scan, 2> scans{changing_room(10)[7], pillar(10)[7]};
  int loaded = 0;
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    const bool cylinder = round % 4 == 0;
    const Scan& scan = scans[cylinder ? 1 : 0];
    std::vector<std::string> mutated;
    for (const map_file::Record& record : unpack(cylinder ? *with_cylinder : *good))
      mutated.push_back(record.SerializeAsString());
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

}  // namespace
}  // namespace octosurf::test
