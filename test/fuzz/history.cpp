// Target for a map's history. An input is the file's records as they are before compression, footer left
// out: what is behind the checksum is what the fuzzer comes to.
#include "fuzz/input_file.hpp"
#include "history_file.pb.h"
#include "io/map_file/history_file.hpp"
#include "io/map_file/record_stream.hpp"

#include <sstream>

#include <octosurf/history.hpp>

namespace octosurf::fuzz {
namespace {

/// Takes the record at the front of `rest` off it, or what is left where its length says more.
std::string_view take_record(std::string_view& rest) {
  std::size_t length = 0, head = 0;
  for (unsigned shift = 0; head < rest.size() && shift < 63; shift += 7) {
    const auto byte = static_cast<std::uint8_t>(rest[head++]);
    length |= std::size_t{byte & 127U} << shift;
    if (byte < 128) break;
  }
  const std::string_view record = rest.substr(head, length);
  rest.remove_prefix(head + record.size());
  return record;
}

/// The file of these records, with a footer that is true of them.
std::string history_of(std::string_view records) {
  std::ostringstream out;
  out << io::history_file_magic;
  for (int shift = 0; shift < 32; shift += 8)
    out.put(static_cast<char>(io::history_file_version >> shift & 0xff));
  io::RecordWriter writer(out);
  while (!records.empty()) writer.put(take_record(records));
  history_file::Record footer;
  footer.mutable_footer()->set_crc32(writer.crc32());
  writer.put(footer.SerializeAsString());
  writer.finish();
  return out.str();
}

void promise_same(const History& a, const History& b) {
  promise(a.stride() == b.stride() && a.moments().size() == b.moments().size(), "a history stays as long");
  for (std::size_t i = 0; i < a.moments().size(); ++i) {
    const Moment &one = a.moments()[i], &other = b.moments()[i];
    promise(one.revision == other.revision && one.stamp_s == other.stamp_s, "a moment stays when it was");
    promise(one.surfaces.size() == other.surfaces.size() && one.cylinders.size() == other.cylinders.size(),
            "a moment keeps its shapes");
  }
}

}  // namespace

void fuzz_history(Bytes bytes) {
  const std::string file = history_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const InputFile input({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, ".history");
  std::optional<History> history = accepted([&] { return load_history(input.path()); });
  if (!history) return;
  const std::size_t peak = reading_peak;
  save_history(*history, input.path(), true);
  promise_same(*history, load_history(input.path()));
  const Moment* before = nullptr;
  for (const Moment& now : history->moments()) {
    changes_of(before, now);
    before = &now;
  }
  const std::uint64_t last = before == nullptr ? 0 : before->revision;
  history->thin();
  history->forget_after(last / 2);
  reading_peak = peak;
}

}  // namespace octosurf::fuzz
