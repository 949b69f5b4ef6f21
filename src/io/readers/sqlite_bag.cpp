// A ROS 2 bag's .db3: tables `topics` and `messages` in a SQLite database.
#include "io/database.hpp"
#include "io/readers/bag.hpp"
#include "io/readers/bounded_file.hpp"

#include <algorithm>
#include <map>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

std::filesystem::path log_of(const std::filesystem::path& file) { return file.string() + "-wal"; }

class SqliteBag : public Bag {
 public:
  explicit SqliteBag(const std::filesystem::path& file)
      : file_(file), size_(size_of_bag_file(file)), base_(file, access_to(file), largest_of(size_)) {
    // Tables, not views, which could compute data without end.
    Statement tables(base_,
                     "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', "
                     "'messages') AND sql NOT LIKE '%VIRTUAL%' AND sql NOT LIKE '%GENERATED%'");
    if (!tables.step() || tables.integer(0) != 2)
      throw Error(Error::Kind::data, file_.string(), "an SQLite database, but no ROS 2 bag",
                  "a bag has the tables topics and messages");
  }

  void read_messages(const Visit& visit, std::vector<std::string>*) override {
    base_.allow_work(size_);
    read_topics();
    // In recording order, whatever the time stamps.
    Statement all(base_, "SELECT id, topic_id, timestamp, data FROM messages ORDER BY id");
    while (all.step()) {
      const auto found = indices_by_id_.find(all.integer(1));
      if (found == indices_by_id_.end()) refuse("a message of an unknown topic");
      visit({found->second,
             all.integer(2),
             all.bytes(3),
             {static_cast<std::uint64_t>(all.integer(0)), 0, 0, 0}});
    }
    // SQLite reads missing bytes of the last page as zeros.
    Statement whole(base_, "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
    if (whole.step() && static_cast<std::uint64_t>(whole.integer(0)) > size_)
      refuse("it ends within its last page");
  }

  std::string_view read(const MessagePlace& place) override {
    base_.allow_work(size_);
    Statement one(base_, "SELECT data FROM messages WHERE id = ?");
    if (!one.run(static_cast<std::int64_t>(place.block))) refuse("changed while it was read");
    return message_ = one.bytes(0);
  }

 private:
  using Statement = Database::Statement;

  /// No value is larger than the file itself.
  static std::uint64_t largest_of(std::uint64_t size) {
    return std::min<std::uint64_t>(std::max<std::uint64_t>(size, 1000000), 1 << 30);
  }
  /// A killed recorder leaves much in a log beside the file. If it has none, the base does not change, lest
  /// SQLite begin one (format versions 2, bytes 18 and 19) where nobody may write.
  static Database::Access access_to(const std::filesystem::path& file) {
    BoundedFile head(file);
    if (size_of_bag_file(file) > head.size()) return Database::Access::read_log;
    return head.take(20).ends_with("\2\2") ? Database::Access::read_still : Database::Access::read;
  }

  void read_topics() {
    Statement all(base_, "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    indices_by_id_.clear();
    while (all.step()) {
      const MessageEncoding encoding = all.bytes(3) == "cdr" ? MessageEncoding::cdr : MessageEncoding::other;
      indices_by_id_[all.integer(0)] =
          topic_index({std::string(all.bytes(1)), ros_type(std::string(all.bytes(2))), encoding}, file_);
    }
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), "a damaged bag: " + what,
                "copy the bag again, or repair it by sqlite3's .recover; --skip-bad maps what is whole");
  }

  std::filesystem::path file_;
  std::uint64_t size_ = 0;
  Database base_;
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
