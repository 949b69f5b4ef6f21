#include "support/packed_map.hpp"

#include "io/map_file/map_file.hpp"
#include "io/map_file/record_stream.hpp"
#include "map_file.pb.h"

#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

constexpr std::size_t head_bytes = io::map_file_magic.size() + 4;

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
  for (int shift = 0; shift < 32; shift += 8)
    out.put(static_cast<char>(io::map_file_version >> shift & 0xff));
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
