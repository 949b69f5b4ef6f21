#include "io/map_file/past.hpp"

#include "io/map_file/map_limits.hpp"
#include "io/map_file/record_stream.hpp"
#include "io/new_file.hpp"
#include "map_file.pb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <new>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <zstd.h>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view past_magic{"\x89OCTPS\r\n", 8};
constexpr std::size_t map_head = 12;                          // bytes before a map file's records
constexpr std::size_t undo_in_record = std::size_t{1} << 20;  // bytes of an undo in a record
constexpr std::uint64_t skippable_head = 8;                   // bytes of a skippable frame's
constexpr int undo_level = 9;  // a sixth smaller than level 3, in twice its time
constexpr int least_undo_window = 20, largest_undo_window = 30;  // log2 of bytes

std::string with_length(const std::string& record) {
  std::string bytes;
  std::size_t rest = record.size();
  for (; rest >= 128; rest >>= 7) bytes.push_back(static_cast<char>(rest | 128));
  bytes.push_back(static_cast<char>(rest));
  return bytes + record;
}

/// The head of a map file and its records, each behind its length. Throws Error(data).
std::string plain_of(const fs::path& file) {
  std::error_code failure;
  const std::uintmax_t bytes = fs::file_size(file, failure);
  std::ifstream in(file, std::ios::binary);
  std::string plain(map_head, '\0');
  std::string record;
  in.read(plain.data(), static_cast<std::streamsize>(plain.size()));
  if (failure || !in) throw Error(Error::Kind::data, file.string(), "cannot be read", "check its rights");
  RecordReader reader(in, map_stream.most(bytes), file.string());
  while (reader.next(record)) plain += std::string_view(with_length(record));
  return plain;
}

int window_for(std::size_t bytes) {
  return std::clamp(static_cast<int>(std::bit_width(bytes)), least_undo_window, largest_undo_window);
}

/// `before`, as a frame that needs `after` to be read.
std::string undo_of(const std::string& before, const std::string& after) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (!context) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, undo_level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, window_for(before.size() + after.size()));
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_enableLongDistanceMatching, 1);
  ZSTD_CCtx_refPrefix(context.get(), after.data(), after.size());
  const std::size_t most = ZSTD_compressBound(before.size());
  const auto undo = std::make_unique_for_overwrite<char[]>(most);  // takes memory as it is written
  const std::size_t size = ZSTD_compress2(context.get(), undo.get(), most, before.data(), before.size());
  if (ZSTD_isError(size)) throw Error(Error::Kind::output, "zstd", ZSTD_getErrorName(size));
  return {undo.get(), size};
}

std::string records_before(const std::string& after, const Session& session, const Damage& damage) {
  // As much as a map file's records may be, of all that is there.
  damage.require(session.before_plain <= map_stream.most(after.size() + session.undo.size()),
                 "an undo gives far more than its size allows");
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) throw std::bad_alloc();
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, largest_undo_window + 1);
  ZSTD_DCtx_refPrefix(context.get(), after.data(), after.size());
  std::string before(session.before_plain, '\0');
  const std::size_t size = ZSTD_decompressDCtx(context.get(), before.data(), before.size(),
                                               session.undo.data(), session.undo.size());
  damage.require(size == before.size(), "an undo does not fit the map after it");
  return before;
}

/// A map file of these records, of `bytes` bytes if the compressor is that of then.
std::string map_of_records(const std::string& plain, std::uint64_t bytes, const Damage& damage) {
  std::ostringstream out;
  out << plain.substr(0, map_head);
  RecordWriter writer(out);
  for (std::size_t at = map_head; at < plain.size();) {
    std::size_t length = 0;
    for (int shift = 0;; shift += 7) {
      damage.require(at < plain.size() && shift < 35, "a record has no end");
      const auto byte = static_cast<unsigned char>(plain[at++]);
      length |= static_cast<std::size_t>(byte & 127) << shift;
      if (byte < 128) break;
    }
    damage.require(length <= record_limit && length <= plain.size() - at, "a record has no end");
    writer.put(std::string_view(plain).substr(at, length));
    at += length;
  }
  writer.finish(std::max(bytes, skippable_head) - skippable_head);
  return std::move(out).str();
}

void put_past(const map_file::PastRecord& record, RecordWriter& records) {
  records.put(record.SerializeAsString());
}

void write_session(const Session& session, RecordWriter& records) {
  map_file::PastRecord record;
  map_file::PastSession& to = *record.mutable_session();
  if (session.date_s != 0) to.set_date_s(session.date_s);
  if (session.written_s != 0) to.set_written_s(session.written_s);
  to.set_revision(session.revision);
  to.set_scans(session.scans);
  to.set_surfaces(session.surfaces);
  to.set_area_m2(session.area_m2);
  to.mutable_appeared()->Add(session.appeared.begin(), session.appeared.end());
  to.mutable_changed()->Add(session.changed.begin(), session.changed.end());
  to.mutable_gone()->Add(session.gone.begin(), session.gone.end());
  to.mutable_merged()->Add(session.merged.begin(), session.merged.end());
  to.set_map_bytes(session.map.bytes);
  to.set_map_crc32(session.map.crc32);
  if (session.before.bytes != 0) {
    to.set_before_bytes(session.before.bytes);
    to.set_before_crc32(session.before.crc32);
    to.set_before_plain(session.before_plain);
  }
  put_past(record, records);
  for (std::size_t at = 0; at < session.undo.size(); at += undo_in_record) {
    record.Clear();
    record.set_undo(session.undo.substr(at, undo_in_record));
    put_past(record, records);
  }
}

Session read_session(const map_file::PastSession& from, const Damage& damage) {
  Session session;
  session.date_s = from.date_s();
  session.written_s = from.written_s();
  session.revision = from.revision();
  session.scans = from.scans();
  session.surfaces = from.surfaces();
  session.area_m2 = from.area_m2();
  damage.require(std::isfinite(session.date_s + session.written_s + session.area_m2),
                 "a number is not finite");
  session.appeared.assign(from.appeared().begin(), from.appeared().end());
  session.changed.assign(from.changed().begin(), from.changed().end());
  session.gone.assign(from.gone().begin(), from.gone().end());
  session.merged.assign(from.merged().begin(), from.merged().end());
  session.map = {from.map_bytes(), from.map_crc32()};
  session.before = {from.before_bytes(), from.before_crc32()};
  session.before_plain = from.before_plain();
  return session;
}

/// All sessions of a file, of the undo its length and what `keep` says. Throws Error(data).
std::vector<Session> read_past(const fs::path& file, bool keep = false) {
  std::error_code failure;
  const Damage damage{file.string(), {}};
  const std::uintmax_t bytes = fs::file_size(file, failure);
  std::ifstream in(file, std::ios::binary);
  if (failure || !in) throw Error(Error::Kind::data, file.string(), "cannot be read", "check its rights");
  std::string magic(past_magic.size(), '\0');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  damage.require(magic == past_magic, "it is no past of a map");
  RecordReader reader(in, map_stream.most(bytes), file.string());
  std::vector<Session> sessions;
  map_file::PastRecord record;
  bool ended = false;
  for (std::string text; reader.next(text);) {
    damage.require(!ended && record.ParseFromString(text), "a record cannot be read");
    if (record.has_session()) {
      sessions.push_back(read_session(record.session(), damage));
      sessions.back().file = file;
    } else if (record.has_undo()) {
      damage.require(!sessions.empty(), "an undo has no session");
      sessions.back().undo_bytes += record.undo().size();
      if (keep) sessions.back().undo += record.undo();
    } else {
      ended = true;
      damage.require(record.has_footer() && record.footer().records() + 1 == reader.records() &&
                         record.footer().crc32() == reader.crc32_before_last(),
                     "its checksum is another");
    }
  }
  damage.require(ended, "it ends too early");
  return sessions;
}

/// With its undo.
Session read_again(const Session& session) {
  for (Session& one : read_past(session.file, true))
    if (one.map == session.map && one.before == session.before) return std::move(one);
  throw Error(Error::Kind::data, session.file.string(), "was written anew while it was read", "try again");
}

/// Where sessions are kept: NAME.past of older versions, which has several, and NAME.past-*.
std::vector<fs::path> files_of_past(const fs::path& stem) {
  const fs::path one = file_of_map(stem, ".past");
  std::vector<fs::path> files;
  std::error_code failure;
  fs::directory_iterator entry(one.has_parent_path() ? one.parent_path() : ".", failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure)) {
    const std::string name = entry->path().filename().string(), own = one.filename().string();
    if ((name == own || name.starts_with(own + "-")) && whole_of_part(name).empty())
      files.push_back(one.parent_path() / name);
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Takes out of `all` those that lead to the map file `end`, oldest first.
std::vector<Session> chain_to(FileSum end, std::vector<Session>& all) {
  std::vector<Session> chain;
  while (end.bytes != 0) {
    const auto one = std::find_if(all.begin(), all.end(), [&](const Session& s) { return s.map == end; });
    if (one == all.end()) break;
    end = one->before;
    chain.push_back(std::move(*one));
    all.erase(one);
  }
  std::reverse(chain.begin(), chain.end());
  return chain;
}

void describe_session(Session& session, const Map& map) {
  const std::shared_ptr<const Snapshot> snapshot = map.snapshot();
  session.revision = snapshot->revision;
  session.scans = map.size().scans;
  session.surfaces = snapshot->surfaces.size();
  session.area_m2 = 0;
  for (const SurfacePtr& surface : snapshot->surfaces) session.area_m2 += surface->area_m2;
}

}  // namespace

Past past_of(const fs::path& stem) {
  Past past;
  std::vector<Session> all;
  for (const fs::path& file : files_of_past(stem)) try {
      for (Session& session : read_past(file)) all.push_back(std::move(session));
    } catch (const Error& error) {
      past.warnings.emplace_back(error.what());
    }
  // One that knows what was before goes before one that began anew at the same state.
  std::stable_sort(all.begin(), all.end(),
                   [](const Session& a, const Session& b) { return a.before.bytes > b.before.bytes; });
  const fs::path now = file_of_map(stem, ".surfaces"), before = file_of_map(stem, ".before");
  past.sessions = chain_to(sum_of(past.map = now).value_or(FileSum{}), all);
  if (past.sessions.empty()) past.sessions = chain_to(sum_of(past.map = before).value_or(FileSum{}), all);
  if (past.sessions.empty()) past.map = now;
  const std::vector<Session>& known = past.sessions;
  if (!known.empty() && known.front().before.bytes != 0)
    past.warnings.push_back(known.front().file.string() + ": what lies before it is not known");
  for (const Session& other : all)
    if (std::none_of(known.begin(), known.end(), [&](const Session& one) { return one.map == other.map; }))
      past.warnings.push_back(other.file.string() + ": leads to none of the map's states; it is kept");
  return past;
}

Map map_after(const Past& past, std::size_t at) {
  std::string plain = plain_of(past.map);
  for (std::size_t k = past.sessions.size(); --k > at;)
    plain = records_before(plain, read_again(past.sessions[k]), {past.sessions[k].file.string(), {}});
  const Damage damage{past.sessions.at(at).file.string(), {}};
  const std::string file = map_of_records(plain, past.sessions[at].map.bytes, damage);
  std::istringstream in(file);
  return surfaces::map_of(std::move(read_map(in, file.size(), damage.where).state));
}

PastKeeper::PastKeeper(fs::path stem, const fs::path& resumed, const Map* start)
    : stem_(std::move(stem)), resumes_(!resumed.empty()), past_(past_of(resumes_ ? resumed : stem_)) {
  if (!resumes_) {
    past_.warnings.clear();
    if (past_.sessions.size() > 1)
      past_.warnings = {past_.sessions.back().file.string() +
                        ": the map that is written over ends here, after " +
                        std::to_string(past_.sessions.size()) + " sessions, which are kept"};
    else if (past_.sessions.size() == 1 && past_.sessions.front().before.bytes == 0)
      replaced_ = past_.sessions.front().file;
    past_.sessions.clear();
  } else if (past_.sessions.empty()) {  // a map from before there was a past
    const std::optional<Map> loaded =
        start != nullptr ? std::nullopt : std::optional(load_map(past_.map).map);
    describe_session(past_.sessions.emplace_back(), start != nullptr ? *start : *loaded);
    past_.sessions.back().map = sum_of(past_.map).value_or(FileSum{});
    if (!past_.warnings.empty()) past_.warnings.push_back(past_.map.string() + ": its past begins anew");
  }
}

void PastKeeper::begin() {
  if (std::exchange(begun_, true)) return;
  std::error_code failure;
  const fs::path before = file_of_map(stem_, ".before");
  if (resumes_ && fs::equivalent(past_.map, before, failure)) return;
  fs::remove(before, failure);
  if (!resumes_) return;
  fs::create_hard_link(past_.map, before, failure);
  if (failure) fs::copy_file(past_.map, before, fs::copy_options::overwrite_existing, failure);
  if (failure)
    throw Error(Error::Kind::output, before.string(), "cannot be written: " + failure.message(),
                "check the disk");
}

/// A run that saved nothing leaves nothing behind.
PastKeeper::~PastKeeper() {
  std::error_code failure;
  const fs::path before = file_of_map(stem_, ".before"), after = file_of_map(stem_, ".surfaces");
  if (begun_ && (!fs::exists(after, failure) || fs::equivalent(before, after, failure)))
    fs::remove(before, failure);
}

void PastKeeper::write(Session& session) const {
  std::array<char, 40> states{};
  std::snprintf(states.data(), states.size(), ".past-%08x-%08x", session.before.crc32, session.map.crc32);
  session.file = file_of_map(stem_, states.data());
  std::error_code ignored;
  if (fs::exists(session.file, ignored)) return;  // the same again
  NewFile file(session.file, false);
  file.write([&](std::ostream& out) {
    out.write(past_magic.data(), past_magic.size());
    RecordWriter records(out);
    write_session(session, records);
    map_file::PastRecord footer;
    footer.mutable_footer()->set_records(records.records());
    footer.mutable_footer()->set_crc32(records.crc32());
    put_past(footer, records);
    records.finish(map_stream.least_file(records.bytes()));
  });
  file.commit();
  session.undo.clear();
}

void PastKeeper::save(const Map& map, std::optional<double> date_s, const MapChanges& changes) {
  const fs::path before = file_of_map(stem_, ".before"), after = file_of_map(stem_, ".surfaces");
  std::error_code ignored;
  Session session;
  session.written_s =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  session.date_s = date_s.value_or(session.written_s);
  describe_session(session, map);
  session.map = sum_of(after).value_or(FileSum{});
  if (fs::exists(before, ignored)) {
    session.before = sum_of(before).value_or(FileSum{});
    if (session.before == session.map) {  // nothing new
      fs::remove(before, ignored);
      return;
    }
    const std::string plain = plain_of(before);
    session.before_plain = plain.size();
    session.undo = undo_of(plain, plain_of(after));
    session.undo_bytes = session.undo.size();
    session.appeared = changes.appeared;
    session.changed = changes.changed;
    session.gone = changes.gone;
    for (const MapChanges::Successor& successor : changes.merged)
      if (session.merged.empty() || session.merged.back() != successor.before)
        session.merged.push_back(successor.before);
  }
  const std::vector<fs::path> own = files_of_past(stem_);
  for (Session& one : past_.sessions) {
    const auto is_it = [&](const fs::path& file) { return fs::equivalent(file, one.file, ignored); };
    if (std::any_of(own.begin(), own.end(), is_it)) continue;
    if (!one.file.empty()) one = read_again(one);  // of the map that this one began as
    write(one);
  }
  write(past_.sessions.emplace_back(std::move(session)));
  if (replaced_ != past_.sessions.back().file) fs::remove(replaced_, ignored);
  fs::remove(before, ignored);
}

}  // namespace octosurf::io
