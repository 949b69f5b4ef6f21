#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace octosurf::io {

/// An SQLite database that octosurf reads, or writes; not both with one of these. Throws std::bad_alloc;
/// otherwise, reading, Error(data), and writing, Error(output).
class Database {
 public:
  enum class Access {
    read,        ///< of a file that nobody trusts: no value larger than `largest`, no endless work
    read_still,  ///< the same; nobody writes it meanwhile
    read_log,    ///< the same, with the log beside it, neither locked nor written
    write,       ///< in place: until the transaction is committed, whatever happens, the file stays as it was
    fill,        ///< of a new file that nobody else knows: without transactions and waiting for the disk
  };
  Database(std::filesystem::path file, Access access, std::uint64_t largest = 0);

  class Statement {
   public:
    Statement(const Database& base, const std::string& sql);
    /// Binds its parameters, and steps: true if there is a row. Text is bound as a blob.
    template <class... Values>
    bool run(const Values&... values) {
      reset();
      int at = 0;
      (bind(++at, values), ...);
      return step();
    }
    bool step();
    std::int64_t integer(int column) const;
    std::string_view bytes(int column) const;  ///< until the next step

   private:
    void reset();
    void bind(int at, std::int64_t value);
    void bind(int at, std::string_view value);
    const Database& base_;
    std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement_;
  };

  /// Of reading from here on: some steps a byte.
  void allow_work(std::uint64_t file_bytes);
  /// Statements without results.
  void run(const std::string& sql) const;

 private:
  [[noreturn]] void fail(int code) const;
  void require(int code) const;

  std::filesystem::path file_;
  Access access_;
  std::uint64_t steps_left_;
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> base_;
};

}  // namespace octosurf::io
