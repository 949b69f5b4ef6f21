#include "io/map_file/map_rows.hpp"

#include "io/map_file/map_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>
#include <zlib.h>
#include <zstd.h>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

/// Largest content of a row.
constexpr std::uint64_t content_limit = std::uint64_t{64} << 20;
/// A row of it: zstd adds at most a 256th, SQLite some bytes.
constexpr std::uint64_t row_limit = content_limit + content_limit / 128;
/// Of all contents. Real maps compress to a third … a seventh, planes without noise to a thirtieth.
constexpr Expansion map_contents{.free = std::uint64_t{4} << 20, .ratio = 12};
constexpr int compression_level = 3;
constexpr std::uint64_t page_bytes = 4096;
constexpr std::uint64_t padding_in_row = std::uint64_t{16} << 20;

/// As SQLite stores it: what a file is compared with.
std::vector<std::string> schema() {
  std::vector<std::string> tables;
  for (const char* const name : table_names)
    tables.push_back(std::string("CREATE TABLE ") + name +
                     "(key INTEGER PRIMARY KEY, revision INTEGER NOT NULL, bytes INTEGER NOT NULL, "
                     "sum INTEGER NOT NULL, content BLOB NOT NULL)");
  tables.emplace_back("CREATE TABLE padding(zeros BLOB)");
  return tables;
}

std::size_t at(Table table) { return static_cast<std::size_t>(table); }

/// CRC-32 of table, key and content, and the content's Adler-32: two that one change hardly leaves both.
std::uint64_t sum_of(Table table, std::int64_t key, std::string_view content) {
  std::string place(1, static_cast<char>(table));
  for (int shift = 0; shift < 64; shift += 8) place.push_back(static_cast<char>(key >> shift & 0xff));
  const std::uint64_t crc = crc32_of(content, crc32_of(place));
  return crc << 32 | ::adler32_z(1, reinterpret_cast<const Bytef*>(content.data()), content.size());
}

}  // namespace

RowSums::Total RowSums::total() const {
  Total all;
  for (std::size_t table = 0; table < rows.size(); ++table)
    for (const auto& [key, row] : rows[table]) {
      if (table == at(Table::state) && key == files_key) continue;
      ++all.count;
      all.bytes += row.bytes;
      if (table != at(Table::kept_scans)) all.digest += row.sum;
    }
  return all;
}
std::uint64_t RowSums::files_sum() const {
  const auto row = rows[at(Table::state)].find(files_key);
  return row == rows[at(Table::state)].end() ? 0 : row->second.sum;
}

void make_tables(const Database& base) {
  base.run("PRAGMA page_size = " + std::to_string(page_bytes) + "; PRAGMA application_id = " +
           std::to_string(map_file_id) + "; PRAGMA user_version = " + std::to_string(map_file_version));
  for (const std::string& table : schema()) base.run(table);
}

struct RowWriter::Output {
  explicit Output(const Database& database) : base(database) {
    if (!context) throw std::bad_alloc();
    for (const std::string name : table_names) {
      replace.emplace_back(base, "REPLACE INTO " + name + " VALUES (?, ?, ?, ?, ?)");
      remove.emplace_back(base, "DELETE FROM " + name + " WHERE key = ?");
    }
  }
  std::string_view compressed(std::string_view content) {
    buffer.resize(ZSTD_compressBound(content.size()));
    const std::size_t size = ZSTD_compressCCtx(context.get(), buffer.data(), buffer.size(), content.data(),
                                               content.size(), compression_level);
    if (ZSTD_isError(size)) throw Error(Error::Kind::output, "zstd", ZSTD_getErrorName(size));
    return {buffer.data(), size};
  }
  const Database& base;
  std::vector<Database::Statement> replace, remove;
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context{ZSTD_createCCtx(), &ZSTD_freeCCtx};
  std::vector<char> buffer;
};

RowWriter::RowWriter(const Database* base, RowSums held, std::uint64_t revision)
    : sums_(std::move(held)),
      revision_(revision),
      output_(base != nullptr ? std::make_unique<Output>(*base) : nullptr) {
  for (auto& table : sums_.rows)
    for (auto& [key, row] : table) row.kept = false;
}
RowWriter::~RowWriter() = default;

void RowWriter::put(Table table, std::int64_t key, std::string_view content) {
  if (content.size() > content_limit)
    throw Error(Error::Kind::output, "map file",
                "a row of " + std::to_string(content.size()) + " bytes is over the format's limit",
                "map with a larger max_hole_size or resolution");
  const RowSums::Row row{sum_of(table, key, content), content.size(), true};
  const auto [known, is_new] = sums_.rows[at(table)].try_emplace(key, row);
  const bool same = !is_new && known->second.sum == row.sum && known->second.bytes == row.bytes;
  known->second = row;
  if (same || !output_) return;
  output_->replace[at(table)].run(key, static_cast<std::int64_t>(revision_),
                                  static_cast<std::int64_t>(row.bytes), static_cast<std::int64_t>(row.sum),
                                  output_->compressed(content));
}

void RowWriter::keep(Table table, std::int64_t key) { sums_.rows[at(table)].at(key).kept = true; }

void RowWriter::keep_all(Table table) {
  for (auto& [key, row] : sums_.rows[at(table)]) row.kept = true;
}

void RowWriter::finish() {
  for (std::size_t table = 0; table < sums_.rows.size(); ++table)
    std::erase_if(sums_.rows[table], [&](const auto& row) {
      if (row.second.kept || (table == at(Table::state) && row.first == files_key)) return false;
      if (output_) output_->remove[table].run(row.first);
      return true;
    });
}

void RowWriter::pad(std::uint64_t least_bytes) {
  Database::Statement pages(output_->base,
                            "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
  pages.run();
  const auto bytes = static_cast<std::uint64_t>(pages.integer(0));
  least_bytes = std::max(least_bytes, map_contents.least_file(sums_.total().bytes));
  for (std::uint64_t left = least_bytes - std::min(bytes, least_bytes); left > 0;) {
    const std::uint64_t some = std::min(left, padding_in_row);
    output_->base.run("INSERT INTO padding VALUES (zeroblob(" + std::to_string(some) + "))");
    left -= some;
  }
}

namespace {

/// Throws Error(data) unless its first bytes, SQLite's header, are a map file's of this version.
void require_kind(const fs::path& file) {
  std::string head(100, '\0');
  std::ifstream in(file, std::ios::binary);
  const std::string where = file.string(), ours = std::to_string(map_file_version);
  if (!in) throw Error(Error::Kind::data, where, "cannot be read", "check its rights");
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  const auto number = [&head](std::size_t from, std::size_t bytes) {  // the highest byte first
    std::uint32_t all = 0;
    for (std::size_t i = from; i < from + bytes; ++i) all = all << 8 | static_cast<unsigned char>(head[i]);
    return all;
  };
  if (head.starts_with("\x89OCTSF\r\n"))
    throw Error(Error::Kind::data, where,
                "was written by an older octosurf, this one reads version " + ours + " of the format",
                "make the map anew from its scans, or use the octosurf that wrote it");
  if (!head.starts_with(std::string_view("SQLite format 3\0", 16)) || number(68, 4) != map_file_id)
    throw Error(Error::Kind::data, where, "is not an octosurf map",
                "expected a .surfaces file of octosurf map");
  if (const std::uint32_t version = number(60, 4); version != map_file_version)
    throw Error(
        Error::Kind::data, where,
        "has version " + std::to_string(version) + " of the format, this octosurf reads version " + ours,
        version > map_file_version ? "use the newer octosurf that wrote it"
                                   : "make the map anew from its scans");
  // No log beside it, nothing reserved in a page.
  Damage{where, {}}.require(number(16, 2) == page_bytes && number(18, 3) == 0x010100,
                            "its pages are not as this format has them");
}

/// A save that was interrupted has left its journal beside the file: SQLite takes back what it had written.
void recover(const fs::path& file) try {
  std::error_code ignored;
  if (fs::exists(file.string() + "-journal", ignored))
    Database(file, Database::Access::write).run("SELECT count(*) FROM sqlite_master");
} catch (const Error& error) {  // where it may not be written, reading says whether that matters
  if (error.kind() == Error::Kind::data) throw;
}

}  // namespace

struct RowReader::Input {
  explicit Input(const fs::path& file) : base(file, Database::Access::read, row_limit) {
    if (!context) throw std::bad_alloc();
  }
  Database base;
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context{ZSTD_createDCtx(), &ZSTD_freeDCtx};
};

RowReader::RowReader(const fs::path& file) : Damage{file.string(), {}} {
  require_kind(file);
  recover(file);
  input_ = std::make_unique<Input>(file);
  input_->base.run("PRAGMA cell_size_check = ON; BEGIN");
  Database::Statement all(input_->base, "SELECT sql FROM sqlite_master ORDER BY rowid");
  const std::vector<std::string> expected = schema();
  std::size_t n = 0;
  for (; all.step(); ++n)
    require(n < expected.size() && all.bytes(0) == expected[n], "its tables are not as this format has them");
  require(n == expected.size(), "its tables are not as this format has them");
  // From here on nobody else writes. Another handle of the file, closed, would end that.
  Database::Statement pages(input_->base, "SELECT page_count FROM pragma_page_count");
  pages.step();
  file_bytes_ = stored_left_ = fs::file_size(file);
  plain_left_ = map_contents.most(file_bytes_);
  require(file_bytes_ == static_cast<std::uint64_t>(pages.integer(0)) * page_bytes,
          "it has another length than it says");
}
RowReader::~RowReader() = default;

void RowReader::for_each(Table table, const std::function<void(std::int64_t, std::string&)>& visit) {
  const std::string name = table_names[at(table)];
  Database::Statement all(input_->base, "SELECT key, bytes, sum, content FROM " + name + " ORDER BY key");
  std::string content;
  std::optional<std::int64_t> last;
  while (all.step()) {
    const std::int64_t key = all.integer(0);
    require(!last || key > *last, "its rows are out of order");
    last = key;
    const std::string_view stored = all.bytes(3);
    const auto bytes = static_cast<std::uint64_t>(all.integer(1));
    require(stored.size() <= stored_left_, "its rows are larger than the file");
    require(bytes <= content_limit, "a row is over the limit");
    require(bytes <= plain_left_, "it decompresses to far more than its size allows");
    stored_left_ -= stored.size();
    plain_left_ -= bytes;
    content.resize(bytes);
    const std::size_t size = ZSTD_decompressDCtx(input_->context.get(), content.data(), content.size(),
                                                 stored.data(), stored.size());
    if (ZSTD_isError(size)) fail(std::string("zstd says ") + ZSTD_getErrorName(size));
    const std::uint64_t sum = sum_of(table, key, content);
    require(size == bytes && sum == static_cast<std::uint64_t>(all.integer(2)),
            "the checksum of a row differs");
    sums_.rows[at(table)][key] = {sum, bytes, true};
    visit(key, content);
  }
}

}  // namespace octosurf::io
