#include "support/packed_map.hpp"

#include <array>
#include <fstream>
#include <google/protobuf/io/coded_stream.h>
#include <iterator>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

using io::Table;
using R = map_file::Record;

/// By table.
constexpr std::array<std::uint32_t, io::table_names.size()> fields{
    R::kHeader,   R::kOctree,   R::kAccumulated, R::kHeld,     R::kSurface,
    R::kCylinder, R::kRemovals, R::kSeenPatches, R::kScanPoses};

template <class Fill>
std::string made(const Fill& fill) {
  const MapBytes file;
  {
    const io::Database base(file.path(), io::Database::Access::fill);
    base.run("BEGIN");
    io::make_tables(base);
    io::RowWriter rows(&base, {}, 1);
    fill(rows);
    base.run("COMMIT");
  }
  return file.bytes();
}

}  // namespace

MapBytes::MapBytes(std::string_view bytes) {
  std::string file = (std::filesystem::temp_directory_path() / "octosurf-map-XXXXXX").string();
  ::close(::mkstemp(file.data()));
  std::ofstream(file, std::ios::binary) << bytes;
  path_ = file;
}
MapBytes::~MapBytes() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}
std::string MapBytes::bytes() const {
  std::ifstream in(path_, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string map_file_of(const surfaces::MapState& state, const io::MapFiles& files) {
  const io::MapHead head(state, state.occupancy.now(), nullptr);
  return made([&](io::RowWriter& rows) {
    head.write(rows, files);
    rows.pad(io::map_memory.least_file(head.memory(files.scans)));
  });
}

std::vector<std::string> records_of(std::string_view file) try {
  const MapBytes copy(file);
  io::RowReader reader(copy.path());
  std::vector<std::string> records;
  for (std::size_t table = 0; table < fields.size(); ++table)
    reader.for_each(static_cast<Table>(table), [&](std::int64_t key, const std::string& content) {
      if (table == 0 && key == io::files_key) return;
      std::string& record = records.emplace_back(1, static_cast<char>(fields[table] << 3 | 2));
      std::size_t rest = content.size();
      for (; rest >= 128; rest >>= 7) record.push_back(static_cast<char>(rest | 128));
      record.push_back(static_cast<char>(rest));
      map_file::Record only_key;
      only_key.set_key(key);
      record += content + only_key.SerializeAsString();
    });
  return records;
} catch (const Error&) {
  return {};
}

std::string map_file_of(const std::vector<std::string>& records,
                        const std::function<void(map_file::Files&)>& spoil, bool padded) {
  return made([&](io::RowWriter& rows) {
    for (const std::string& record : records) {
      google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(record.data()),
                                                static_cast<int>(record.size()));
      std::string content;
      std::uint32_t length = 0;
      const std::uint32_t field = in.ReadTag() >> 3;
      in.ReadVarint32(&length);
      in.ReadString(&content, static_cast<int>(length));
      map_file::Record only_key;
      only_key.ParseFromString(record.substr(static_cast<std::size_t>(in.CurrentPosition())));
      const auto table = std::find(fields.begin(), fields.end(), field) - fields.begin();
      if (table < static_cast<std::ptrdiff_t>(fields.size()))
        rows.put(static_cast<Table>(table), only_key.key(), content);
    }
    map_file::Files files;
    files.set_rows(rows.sums().total().count);
    files.set_digest(rows.sums().total().digest);
    if (spoil) spoil(files);
    rows.put(Table::state, io::files_key, files.SerializeAsString());
    if (padded) rows.pad(0);
  });
}

}  // namespace octosurf::test
