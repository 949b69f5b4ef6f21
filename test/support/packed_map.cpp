#include "support/packed_map.hpp"

#include "io/map_file/map_file.hpp"
#include "io/map_file/record_stream.hpp"
#include "map_file.pb.h"

#include <algorithm>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

constexpr std::size_t head_bytes = io::map_file_magic.size() + 4;

/// The oldest version that has all of them, as write_map() writes: scans' poses came with version 3,
/// departures with 4, steady drift with 5.
std::uint32_t version_of(const std::vector<std::string>& records) {
  std::uint32_t version = 2;
  for (const std::string& bytes : records) {
    map_file::Record record;
    if (!record.ParseFromString(bytes)) continue;
    if (record.has_scan_poses()) version = std::max(version, 3U);
    if (record.has_departures()) version = std::max(version, 4U);
    for (const auto& hypothesis : record.header().alignment().hypotheses())
      if (!hypothesis.steady().empty()) version = std::max(version, 5U);
  }
  return version;
}

}  // namespace

std::vector<std::string> records_of(std::string_view file) {
  if (file.size() < head_bytes) return {};
  try {
    std::istringstream in{std::string(file.substr(head_bytes))};
    io::RecordReader reader(in, std::uint64_t{1} << 24, "input");
    std::vector<std::string> records;
    for (std::string record; reader.next(record);) records.push_back(record);
    if (!records.empty()) records.pop_back();
    return records;
  } catch (const Error&) {
    return {};
  }
}

std::string map_file_of(const std::vector<std::string>& records, bool with_footer) {
  std::ostringstream out;
  out << io::map_file_magic;
  const std::uint32_t version = version_of(records);
  for (int shift = 0; shift < 32; shift += 8) out.put(static_cast<char>(version >> shift & 0xff));
  io::RecordWriter writer(out);
  for (const std::string& record : records) writer.put(record);
  if (with_footer) {
    map_file::Record footer;
    footer.mutable_footer()->set_records(writer.records());
    footer.mutable_footer()->set_crc32(writer.crc32());
    writer.put(footer.SerializeAsString());
  }
  writer.finish();
  return out.str();
}

}  // namespace octosurf::test
