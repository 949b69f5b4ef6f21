// A ROS 2 bag's .db3: tables `topics` and `messages` in a SQLite database.
#include "io/readers/bag.hpp"
#include "io/readers/bounded_file.hpp"

#include <map>
#include <sqlite3.h>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Steps of SQLite's virtual machine between checks for endless loops, and its limits, per byte of the file
// and in total: a row takes some ten steps and at least ten bytes.
constexpr int steps_between_looks = 1000;
constexpr std::uint64_t steps_per_byte = 10, free_steps = 1000000;

std::filesystem::path log_of(const std::filesystem::path& file) { return file.string() + "-wal"; }

class SqliteBag : public Bag {
 public:
  explicit SqliteBag(const std::filesystem::path& file)
      : file_(file), size_(size_of_bag_file(file)), base_(opened(file), &sqlite3_close) {
    // The file is untrusted: no value larger than the file itself, no functions in its schema.
    sqlite3_limit(
        base_.get(), SQLITE_LIMIT_LENGTH,
        static_cast<int>(std::min<std::uint64_t>(std::max<std::uint64_t>(size_, 1000000), 1 << 30)));
    sqlite3_db_config(base_.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(base_.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_progress_handler(base_.get(), steps_between_looks, &SqliteBag::goes_in_circles, this);
    require_tables();
  }

  void read_messages(const Visit& visit, std::vector<std::string>*) override {
    steps_ = 0;
    read_topics();
    // In recording order, whatever the time stamps.
    const Statement all = prepared("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id");
    while (step(all)) {
      const auto found = indices_by_id_.find(sqlite3_column_int64(all.get(), 1));
      if (found == indices_by_id_.end()) refuse("a message of an unknown topic");
      const auto id = static_cast<std::uint64_t>(sqlite3_column_int64(all.get(), 0));
      visit({found->second, sqlite3_column_int64(all.get(), 2), blob(all, 3), {id, 0, 0, 0}});
    }
    // SQLite reads missing bytes of the last page as zeros.
    const Statement whole =
        prepared("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
    if (step(whole) && static_cast<std::uint64_t>(sqlite3_column_int64(whole.get(), 0)) > size_)
      refuse("it ends within its last page");
  }

  std::string_view read(const MessagePlace& place) override {
    steps_ = 0;
    const Statement one = prepared("SELECT data FROM messages WHERE id = ?");
    sqlite3_bind_int64(one.get(), 1, static_cast<std::int64_t>(place.block));
    if (!step(one)) refuse("changed while it was read");
    return message_ = blob(one, 0);
  }

 private:
  using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

  /// A killed recorder leaves much in a log beside the file. It is read in memory alone:
  /// without locks, which need another file, and not written into the base at the end. If it has none, the
  /// base does not change, lest SQLite begin one (format versions 2, bytes 18 and 19) where nobody may write.
  static sqlite3* opened(const std::filesystem::path& file) {
    BoundedFile head(file);
    const bool logged = size_of_bag_file(file) > head.size();
    std::string uri = "file://";
    for (const char c : std::filesystem::absolute(file).string())
      uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
    if (!logged && head.take(20).ends_with("\2\2")) uri += "?immutable=1";
    sqlite3* base = nullptr;
    const int error = sqlite3_open_v2(uri.c_str(), &base, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI,
                                      logged ? "unix-none" : nullptr);
    if (base == nullptr) throw std::bad_alloc();
    if (error == SQLITE_OK) {
      sqlite3_db_config(base, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
      if (logged) sqlite3_exec(base, "PRAGMA locking_mode = EXCLUSIVE", nullptr, nullptr, nullptr);
      return base;
    }
    const std::string what = sqlite3_errmsg(base);
    sqlite3_close(base);
    throw Error(Error::Kind::data, file.string(), "cannot be read (SQLite says " + what + ")");
  }

  static int goes_in_circles(void* self) {
    auto& bag = *static_cast<SqliteBag*>(self);
    bag.steps_ += steps_between_looks;
    return bag.steps_ > free_steps + steps_per_byte * bag.size_ ? 1 : 0;
  }

  /// Requires tables, not views, which could compute data without end.
  void require_tables() {
    const Statement tables = prepared(
        "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages') AND "
        "sql NOT LIKE '%VIRTUAL%' AND sql NOT LIKE '%GENERATED%'");
    if (!step(tables) || sqlite3_column_int(tables.get(), 0) != 2)
      throw Error(Error::Kind::data, file_.string(), "an SQLite database, but no ROS 2 bag",
                  "a bag has the tables topics and messages");
  }

  void read_topics() {
    const Statement all = prepared("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    indices_by_id_.clear();
    while (step(all)) {
      const MessageEncoding encoding = text(all, 3) == "cdr" ? MessageEncoding::cdr : MessageEncoding::other;
      indices_by_id_[sqlite3_column_int64(all.get(), 0)] =
          topic_index({text(all, 1), ros_type(text(all, 2)), encoding}, file_);
    }
  }

  Statement prepared(const char* query) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(base_.get(), query, -1, &statement, nullptr) != SQLITE_OK) refuse_damaged();
    return {statement, &sqlite3_finalize};
  }

  bool step(const Statement& statement) {
    const int result = sqlite3_step(statement.get());
    if (result == SQLITE_NOMEM) throw std::bad_alloc();
    if (result != SQLITE_ROW && result != SQLITE_DONE) refuse_damaged();
    return result == SQLITE_ROW;
  }

  static std::string text(const Statement& row, int column) {
    const unsigned char* value = sqlite3_column_text(row.get(), column);
    return value ? reinterpret_cast<const char*>(value) : "";
  }

  static std::string_view blob(const Statement& row, int column) {
    const void* value = sqlite3_column_blob(row.get(), column);
    const int size = sqlite3_column_bytes(row.get(), column);
    return {static_cast<const char*>(value), value ? static_cast<std::size_t>(size) : 0};
  }

  [[noreturn]] void refuse_damaged() { refuse(std::string("SQLite says ") + sqlite3_errmsg(base_.get())); }
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), "a damaged bag: " + what,
                "copy the bag again, or repair it by sqlite3's .recover; --skip-bad maps what is whole");
  }

  std::filesystem::path file_;
  std::uint64_t size_ = 0, steps_ = 0;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> base_;
  std::map<std::int64_t, std::size_t> indices_by_id_;
  std::string message_;  // read last
};

}  // namespace

std::uint64_t size_of_bag_file(const std::filesystem::path& file) {
  const std::filesystem::path log = log_of(file);
  return BoundedFile(file).size() + (std::filesystem::exists(log) ? BoundedFile(log).size() : 0);
}

std::unique_ptr<Bag> open_sqlite_bag(const std::filesystem::path& file) {
  return std::make_unique<SqliteBag>(file);
}

}  // namespace octosurf::io
