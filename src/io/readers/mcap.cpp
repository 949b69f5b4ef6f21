// MCAP (mcap.dev/spec): records of an opcode and a length, messages in chunks or bare. Debian has no reader.
#include "io/mcap_format.hpp"
#include "io/readers/chunked_bag.hpp"
#include "io/text_file.hpp"

#include <limits>
#include <map>
#include <optional>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::uint64_t record_head = 9;  // opcode and length

using Op = McapOp;

class McapBag : public ChunkedBag {
 public:
  explicit McapBag(const std::filesystem::path& file) : ChunkedBag(file, "MCAP") {
    if (file_.left() < mcap_magic.size() || file_.take(mcap_magic.size()) != mcap_magic)
      file_.refuse("not an MCAP file", "record it again, or copy it again");
  }

  void read_messages(const Visit& visit, std::vector<std::string>* left_out) override {
    file_.seek(0);
    crc_ = crc32_of(file_.take(mcap_magic.size()));
    messages_ = 0;
    whole_ = true;
    while (read_record(visit, left_out)) {
    }
    if (whole_) check_statistics();
  }

 private:
  struct Channel {
    std::uint16_t schema = 0;
    std::string topic, encoding;
    std::optional<std::size_t> index;  // into topics_
  };

  /// A chunk's records, or a message outside of chunks.
  std::string read_block(std::uint64_t begin) override {
    const std::string head = file_.take(record_head);
    RecordBytes fields(head);
    const bool chunk = fields.u8() == static_cast<std::uint8_t>(Op::chunk);
    const std::string record = file_.take(fields.u64());
    return chunk ? unpack_at(begin, record) : record;
  }

  /// False at the end of the messages.
  bool read_record(const Visit& visit, std::vector<std::string>* left_out) {
    const std::uint64_t begin = file_.position();
    if (file_.left() == 0) file_.refuse("truncated: the end of its messages is missing", hint);
    const std::string head = file_.take(record_head);
    RecordBytes fields(head);
    const auto op = static_cast<Op>(fields.u8());
    const std::string record = file_.take(fields.u64());
    if (op == Op::footer) return false;
    if (op == Op::data_end) {
      const std::uint32_t crc = parse(begin, [&] { return RecordBytes(record).u32(); });
      if (whole_ && crc != 0 && crc != crc_) throw damage(begin, "the check sum of its messages is wrong");
      return false;
    }
    crc_ = crc32_of(record, crc32_of(head, crc_));
    try {
      if (op == Op::chunk)
        read_chunk(begin, unpack_at(begin, record), visit);
      else
        parse(begin, [&] { read_content(op, record, {begin, 0, 0, 0}, visit); });
    } catch (const Error& error) {
      if (!left_out) throw;
      whole_ = false;
      left_out->emplace_back(error.what());
    }
    return true;
  }

  void read_chunk(std::uint64_t begin, const std::string& records, const Visit& visit) {
    parse(begin, [&] {
      for (RecordBytes bytes(records); !bytes.at_end();) {
        const auto op = static_cast<Op>(bytes.u8());
        const std::uint64_t size = bytes.u64();
        const std::size_t offset = bytes.position();
        read_content(op, bytes.take(size), {begin, offset, 0, 0}, visit);
      }
    });
  }

  /// Schemas, channels and messages, inside a chunk or outside.
  void read_content(Op op, std::string_view record, MessagePlace place, const Visit& visit) {
    RecordBytes fields(record);
    if (op == Op::schema) {
      const std::uint16_t id = fields.u16();
      schemas_[id] = fields.text();
    } else if (op == Op::channel) {
      const std::uint16_t id = fields.u16();
      Channel channel{fields.u16(), {}, {}, {}};
      channel.topic = fields.text();
      channel.encoding = fields.text();
      channels_[id] = std::move(channel);
      topic_of(id);
    } else if (op == Op::message) {
      const std::uint16_t id = fields.u16();
      fields.u32();  // sequence
      const std::uint64_t logged_ns = fields.u64();
      fields.u64();  // published
      if (logged_ns > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
        fail_reading("a message of the year 2262 or later");
      place.offset += fields.position();
      place.size = fields.rest().size();
      ++messages_;
      visit({topic_of(id), static_cast<std::int64_t>(logged_ns), fields.rest(), place});
    }
  }

  std::size_t topic_of(std::uint16_t id) {
    const auto found = channels_.find(id);
    if (found == channels_.end()) fail_reading("a message of an unknown channel");
    Channel& channel = found->second;
    if (channel.index) return *channel.index;
    const auto schema = schemas_.find(channel.schema);
    const MessageEncoding encoding = channel.encoding == "cdr"    ? MessageEncoding::cdr
                                     : channel.encoding == "ros1" ? MessageEncoding::ros1
                                                                  : MessageEncoding::other;
    const BagTopic topic{channel.topic, schema == schemas_.end() ? "" : ros_type(schema->second), encoding};
    channel.index = topic_index(topic, file_.path());
    return *channel.index;
  }

  /// The records of a chunk.
  std::string unpack(std::string_view record) {
    RecordBytes fields(record);
    fields.u64();  // first and last time
    fields.u64();
    const std::uint64_t size = fields.u64();
    const std::uint32_t crc = fields.u32();
    const std::string_view format = fields.text();
    const std::string_view packed = fields.take(fields.u64());
    std::string records = unpacked(packed, format, size);
    if (crc != 0 && crc != crc32_of(records)) fail_reading("a chunk's check sum is wrong");
    return records;
  }

  std::string unpack_at(std::uint64_t begin, std::string_view record) {
    return parse(begin, [&] { return unpack(record); });
  }

  /// Compares with the recorder's counts, if present: a damaged length or opcode hides messages.
  void check_statistics() {
    while (file_.left() >= record_head) {
      const std::uint64_t begin = file_.position();
      const std::string head = file_.take(record_head);
      RecordBytes fields(head);
      const auto op = static_cast<Op>(fields.u8());
      const std::uint64_t size = fields.u64();
      if (op == Op::footer || size > file_.left()) return;
      if (op != Op::statistics) {
        file_.skip(size);
        continue;
      }
      const std::string record = file_.take(size);
      const std::uint64_t counted = parse(begin, [&] { return RecordBytes(record).u64(); });
      if (counted != messages_)
        throw damage(begin, "holds " + std::to_string(messages_) + " messages, but its statistics say " +
                                std::to_string(counted));
      return;
    }
  }

  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::uint32_t crc_ = 0;
  std::uint64_t messages_ = 0;
  bool whole_ = true;  // nothing was skipped so far
};

}  // namespace

std::unique_ptr<Bag> open_mcap(const std::filesystem::path& file) { return std::make_unique<McapBag>(file); }

}  // namespace octosurf::io
