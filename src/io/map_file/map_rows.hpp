#pragma once

#include "io/database.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf::io {

/// Limit of counts in files; larger ones are damage. Increments from here cannot overflow.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 48;

/// Reports damage of a file as an Error(data): "`where`: is damaged: `of` `what`".
struct Damage {
  std::string where, of;
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::data, where, "is damaged: " + of + what, "restore it from a backup");
  }
  void require(bool holds, const char* what) const {
    if (!holds) fail(what);
  }
};

/// Limit of a file's expansion on reading: a constant plus a multiple of its size.
struct Expansion {
  std::uint64_t free = 0, ratio = 1;
  std::uint64_t most(std::uint64_t file_bytes) const { return free + ratio * file_bytes; }
  /// Minimum file size for an expansion to `bytes`.
  std::uint64_t least_file(std::uint64_t bytes) const {
    return bytes <= free ? 0 : (bytes - free + ratio - 1) / ratio;
  }
};

/// A map file's tables, in the order in which they are read (map_file.hpp).
enum class Table { state, octree, waiting, held, surfaces, cylinders, removals, seen_patches, kept_scans };
inline constexpr std::array table_names{"state",     "octree",   "waiting",      "held",      "surfaces",
                                        "cylinders", "removals", "seen_patches", "kept_scans"};

/// Keys of the table `state`.
enum : std::int64_t { header_key = 1, files_key = 2 };

/// What the rows of a map file hold, without their contents.
struct RowSums {
  struct Row {
    std::uint64_t sum;    ///< of key and content
    std::uint64_t bytes;  ///< uncompressed
    bool kept;            ///< in the save that goes on
  };
  std::array<std::map<std::int64_t, Row>, table_names.size()> rows;

  /// Of all rows but that of its files.
  struct Total {
    std::uint64_t count = 0, bytes = 0;
    std::uint64_t digest = 0;  ///< of the map's content, whoever saved it: without the kept scans
  };
  Total total() const;
  std::uint64_t files_sum() const;  ///< of the row of its files, which identifies a save; 0: none
};

/// Adds, replaces and removes rows of a map file. Only those that differ from what it holds are written.
class RowWriter {
 public:
  /// `base`: null to compute sums alone. `held`: what the file holds. `revision`: noted with what is written.
  RowWriter(const Database* base, RowSums held, std::uint64_t revision);
  ~RowWriter();

  /// Throws Error(output) if the content is larger than the limit.
  void put(Table table, std::int64_t key, std::string_view content);
  void keep(Table table, std::int64_t key);  ///< as it is in the file
  void keep_all(Table table);
  void finish();  ///< removes what was neither put nor kept, but the row of the files
  /// Makes the file at least so long, and long enough for what is in it.
  void pad(std::uint64_t least_bytes);
  RowSums& sums() { return sums_; }

 private:
  struct Output;
  RowSums sums_;
  std::uint64_t revision_;
  std::unique_ptr<Output> output_;
};

/// Makes the tables in an empty file.
void make_tables(const Database& base);

/// Rows of a map file that nobody trusts. Throws Error(data).
class RowReader : public Damage {
 public:
  explicit RowReader(const std::filesystem::path& file);
  ~RowReader();

  /// By ascending key.
  void for_each(Table table, const std::function<void(std::int64_t key, std::string& content)>& visit);
  const RowSums& sums() const { return sums_; }  ///< of what was read so far
  std::uint64_t file_bytes() const { return file_bytes_; }

 private:
  struct Input;
  std::uint64_t file_bytes_ = 0, stored_left_ = 0, plain_left_ = 0;
  RowSums sums_;
  std::unique_ptr<Input> input_;
};

}  // namespace octosurf::io
