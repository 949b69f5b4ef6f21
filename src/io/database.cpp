#include "io/database.hpp"

#include "io/new_file.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <new>
#include <sqlite3.h>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Steps of SQLite's virtual machine between checks for endless work, and its limits per byte of the file and
// in total: a row takes some ten steps and at least ten bytes.
constexpr int steps_between_looks = 1000;
constexpr std::uint64_t steps_per_byte = 10, free_steps = 1000000;
constexpr int patience_ms = 10000;  // for others' locks: a large map is read, or a save written, in less

/// SQLite deletes the file that a journal names as the one above it, whichever that is, after taking back
/// what the journal holds. octosurf's journals name none.
void require_own_journal(const std::string& file) {
  std::ifstream journal(file + "-journal", std::ios::binary);
  std::string end(8, '\0');
  journal.seekg(-8, std::ios::end).read(end.data(), 8);
  if (journal && end == "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7")
    throw Error(Error::Kind::data, file + "-journal", "names another file, which would be deleted",
                "remove the journal: octosurf has not written it");
}

}  // namespace

Database::Database(std::filesystem::path file, Access access, std::uint64_t largest)
    : file_(std::move(file)), access_(access), base_(nullptr, &sqlite3_close) {
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(file_).string())
    uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
  if (access == Access::read_still) uri += "?immutable=1";
  const bool reads = access < Access::write;
  if (!reads) require_own_journal(file_.string());
  sqlite3* base = nullptr;
  const int code = sqlite3_open_v2(uri.c_str(), &base,
                                   SQLITE_OPEN_URI | (reads ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE),
                                   access == Access::read_log ? "unix-none" : nullptr);
  if (base == nullptr) throw std::bad_alloc();
  base_.reset(base);
  require(code);
  sqlite3_busy_timeout(base, patience_ms);
  sqlite3_db_config(base, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(base, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  if (reads) {
    sqlite3_db_config(base, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_limit(base, SQLITE_LIMIT_LENGTH, static_cast<int>(largest));
    allow_work(std::filesystem::file_size(file_));
    sqlite3_progress_handler(
        base, steps_between_looks,
        [](void* left) {
          auto& steps = *static_cast<std::uint64_t*>(left);
          steps -= std::min<std::uint64_t>(steps, steps_between_looks);
          return steps == 0 ? 1 : 0;
        },
        &steps_left_);
  }
  if (access == Access::read_log) run("PRAGMA locking_mode = EXCLUSIVE");
  // EXTRA waits for the journal's end to be on disk, too; a spill would lock out readers early.
  if (access == Access::write)
    run("PRAGMA temp_store = MEMORY; PRAGMA cache_spill = OFF; PRAGMA synchronous = EXTRA");
  if (access == Access::fill)
    run("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA locking_mode = EXCLUSIVE");
}

void Database::allow_work(std::uint64_t file_bytes) {
  steps_left_ = free_steps + steps_per_byte * file_bytes;
}

void Database::require(int code) const {
  if (code != SQLITE_OK && code != SQLITE_ROW && code != SQLITE_DONE) fail(code);
}

void Database::fail(int code) const {
  if ((code & 0xff) == SQLITE_NOMEM) throw std::bad_alloc();
  const std::string says = std::string("SQLite says ") + sqlite3_errmsg(base_.get());
  if (access_ < Access::write)
    throw Error(Error::Kind::data, file_.string(), "is damaged: " + says,
                "restore it from a backup, or repair it by sqlite3's .recover");
  int failure = 0;  // of the file itself; SQLite keeps its journal's to itself
  sqlite3_file_control(base_.get(), nullptr, SQLITE_FCNTL_LAST_ERRNO, &failure);
  const int kind = code & 0xff;
  if (kind == SQLITE_FULL || kind == SQLITE_IOERR)
    fail_to_write(file_, "cannot be written", kind == SQLITE_FULL ? ENOSPC : failure != 0 ? failure : EIO);
  if (kind == SQLITE_CANTOPEN) fail_to_write(file_, "cannot be written", sqlite3_system_errno(base_.get()));
  throw Error(Error::Kind::output, file_.string(), "cannot be written: " + says,
              "wait until others have closed it, or give another name");
}

void Database::run(const std::string& sql) const {
  require(sqlite3_exec(base_.get(), sql.c_str(), nullptr, nullptr, nullptr));
}

Database::Statement::Statement(const Database& base, const std::string& sql)
    : base_(base), statement_(nullptr, &sqlite3_finalize) {
  sqlite3_stmt* statement = nullptr;
  base.require(sqlite3_prepare_v2(base.base_.get(), sql.c_str(), -1, &statement, nullptr));
  statement_.reset(statement);
}

void Database::Statement::reset() { sqlite3_reset(statement_.get()); }

void Database::Statement::bind(int at, std::int64_t value) {
  base_.require(sqlite3_bind_int64(statement_.get(), at, value));
}

void Database::Statement::bind(int at, std::string_view value) {
  base_.require(sqlite3_bind_blob64(statement_.get(), at, value.data(), value.size(), SQLITE_STATIC));
}

bool Database::Statement::step() {
  const int code = sqlite3_step(statement_.get());
  base_.require(code);
  return code == SQLITE_ROW;
}

std::int64_t Database::Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string_view Database::Statement::bytes(int column) const {
  const void* value = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {static_cast<const char*>(value), value != nullptr ? static_cast<std::size_t>(size) : 0};
}

}  // namespace octosurf::io
