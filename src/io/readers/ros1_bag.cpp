// ROS 1's bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of a header of named fields and of data;
// messages in chunks. rosbag's own library aborts for some flipped bytes, allocates as a record claims, and
// rejects bags whose recorder was killed.
#include "io/readers/chunked_bag.hpp"

#include <map>
#include <optional>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::string_view magic = "#ROSBAG V2.0\n";

enum class BagOp { message = 2, header = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

using HeaderFields = std::map<std::string_view, std::string_view>;

/// "name=value", each after its length.
HeaderFields fields_of(std::string_view header) {
  HeaderFields fields;
  for (RecordBytes bytes(header); !bytes.at_end();) {
    const std::string_view field = bytes.text();
    const auto equals = field.find('=');
    if (equals == std::string_view::npos) fail_reading("a header's field without a name");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return fields;
}

std::string_view value_of(const HeaderFields& fields, std::string_view name) {
  const auto found = fields.find(name);
  if (found == fields.end()) fail_reading("a record without its field " + std::string(name));
  return found->second;
}

std::uint32_t header_number(const HeaderFields& fields, std::string_view name) {
  return RecordBytes(value_of(fields, name)).u32();
}

BagOp op_of(const HeaderFields& fields) {
  return static_cast<BagOp>(RecordBytes(value_of(fields, "op")).u8());
}

class Ros1Bag : public ChunkedBag {
 public:
  explicit Ros1Bag(const std::filesystem::path& file) : ChunkedBag(file, "ROS 1 bag") {
    const std::string head = file_.take(std::min<std::uint64_t>(magic.size(), file_.left()));
    if (head == magic) return;
    if (head.starts_with("#ROSBAG V"))
      throw Error(Error::Kind::data, file.string(), "a ROS bag of a version before 2.0",
                  "rewrite it: rosbag migrate or rosbag fix");
    throw Error(Error::Kind::data, file.string(), "not a ROS 1 bag", "copy it again");
  }

  void read_messages(const Visit& visit, std::vector<std::string>* left_out) override {
    file_.seek(magic.size());
    counted_.clear();
    chunks_ = 0;
    chunks_announced_.reset();
    bool damaged = false;
    while (file_.left() > 0) read_record(visit, left_out, damaged);
    if (!damaged) check_counts(file_.position());
    if (!damaged && chunks_announced_ && *chunks_announced_ != chunks_)
      throw damage(0, "holds " + std::to_string(chunks_) + " chunks, but its head says " +
                          std::to_string(*chunks_announced_));
  }

 private:
  struct Record {
    std::string header, data;
  };
  Record take_record() {
    const auto sized = [&] {
      const std::string size = file_.take(4);
      return file_.take(RecordBytes(size).u32());
    };
    Record record;
    record.header = sized();
    record.data = sized();
    return record;
  }

  std::string read_block(std::uint64_t begin) override {
    const Record record = take_record();
    return parse(begin, [&] { return unpack(fields_of(record.header), record.data); });
  }

  void read_record(const Visit& visit, std::vector<std::string>* left_out, bool& damaged) {
    const std::uint64_t begin = file_.position();
    const Record record = take_record();
    try {
      parse(begin, [&] {
        const HeaderFields fields = fields_of(record.header);
        const BagOp op = op_of(fields);
        // A chunk is followed by its index, then the next chunk.
        if (op != BagOp::index) check_counts(begin);
        if (op == BagOp::chunk)
          read_chunk(begin, unpack(fields, record.data), visit);
        else if (op == BagOp::index)
          note_count(fields);
        else if (op == BagOp::connection)
          note_connection(fields, record.data);
        else if (op == BagOp::header)
          note_head(fields);
        else if (op != BagOp::chunk_info)
          fail_reading("a record of unknown kind");
      });
    } catch (const Error& error) {
      damaged = true;
      counted_.clear();
      if (!left_out) throw;
      left_out->emplace_back(error.what());
    }
  }

  void read_chunk(std::uint64_t begin, const std::string& records, const Visit& visit) {
    ++chunks_;
    for (RecordBytes bytes(records); !bytes.at_end();) {
      const HeaderFields fields = fields_of(bytes.text());
      const std::string_view data = bytes.text();
      const BagOp op = op_of(fields);
      if (op == BagOp::connection) {
        note_connection(fields, data);
      } else if (op == BagOp::message) {
        const std::uint32_t connection = header_number(fields, "conn");
        RecordBytes time(value_of(fields, "time"));
        const std::int64_t seconds = time.u32();
        const std::int64_t logged_ns = 1000000000 * seconds + time.u32();
        const auto topic = connections_.find(connection);
        if (topic == connections_.end()) fail_reading("a message of an unknown connection");
        ++counted_[connection];
        visit({topic->second, logged_ns, data, {begin, bytes.position() - data.size(), data.size(), 0}});
      } else {
        fail_reading("a chunk with a record of unknown kind");
      }
    }
  }

  /// The records of a chunk.
  std::string unpack(const HeaderFields& fields, std::string_view data) const {
    return unpacked(data, value_of(fields, "compression"), header_number(fields, "size"));
  }

  void note_connection(const HeaderFields& fields, std::string_view data) {
    const HeaderFields about = fields_of(data);
    const BagTopic topic{std::string(value_of(fields, "topic")), ros_type(value_of(about, "type")),
                         MessageEncoding::ros1};
    connections_[header_number(fields, "conn")] = topic_index(topic, file_.path());
  }

  /// The head is rewritten when the recorder ends; until then, it is empty.
  void note_head(const HeaderFields& fields) {
    if (RecordBytes(value_of(fields, "index_pos")).u64() == 0) return;
    chunks_announced_ = header_number(fields, "chunk_count");
  }

  void note_count(const HeaderFields& fields) {
    const std::uint32_t connection = header_number(fields, "conn"), count = header_number(fields, "count");
    if (counted_[connection] != count)
      fail_reading("a chunk with " + std::to_string(counted_[connection]) +
                   " messages of a connection, whose index has " + std::to_string(count));
    counted_.erase(connection);
    indexed_ = true;
  }

  /// Checks that the previous chunk had an index of all its messages; the last one of a truncated bag has
  /// none.
  void check_counts(std::uint64_t begin) {
    const bool some_missing = indexed_ && !counted_.empty();
    counted_.clear();
    indexed_ = false;
    if (some_missing) throw damage(begin, "a chunk whose index lacks a connection");
  }

  std::map<std::uint32_t, std::size_t> connections_;  // to topics_
  std::map<std::uint32_t, std::uint32_t> counted_;    // messages of the last chunk by connection
  bool indexed_ = false;                              // an index of that chunk was there
  std::uint32_t chunks_ = 0;
  std::optional<std::uint32_t> chunks_announced_;
};

}  // namespace

std::unique_ptr<Bag> open_ros1_bag(const std::filesystem::path& file) {
  return std::make_unique<Ros1Bag>(file);
}

}  // namespace octosurf::io
