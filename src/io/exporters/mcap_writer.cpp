#include "io/exporters/mcap_writer.hpp"

#include <algorithm>
#include <concepts>
#include <new>
#include <zstd.h>

namespace octosurf::io {
namespace {

constexpr std::string_view compression = "zstd";
constexpr std::size_t chunk_size = std::size_t{1} << 20;

std::string compressed(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the only possible error
  packed.resize(size);
  return packed;
}

/// Content of a record, field by field; numbers are little-endian.
class FieldBytes {
 public:
  template <std::unsigned_integral Number>
  FieldBytes& add(Number number) {
    for (std::size_t i = 0; i < sizeof(Number); ++i)
      bytes_ += static_cast<char>(static_cast<unsigned char>(number >> (8 * i)));
    return *this;
  }
  /// A string, an array or a map: its size, then its bytes.
  FieldBytes& text(std::string_view text) {
    add(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace

void McapWriter::Span::extend(std::uint64_t begin, std::uint64_t end) {
  begin_ns = empty ? begin : std::min(begin_ns, begin);
  end_ns = empty ? end : std::max(end_ns, end);
  empty = false;
}

McapWriter::McapWriter(std::ostream& out) : out_(out) {
  std::string bytes(mcap_magic);
  add_record(bytes, Op::header, FieldBytes().text("").text("octosurf").bytes());  // profile, library
  put(bytes);
}

void McapWriter::add_record(std::string& to, Op op, std::string_view content, std::string_view rest) {
  to += FieldBytes()
            .add(static_cast<std::uint8_t>(op))
            .add(static_cast<std::uint64_t>(content.size() + rest.size()))
            .bytes();
  to += content;
  to += rest;
}

void McapWriter::put(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  written_ += bytes.size();
  crc_ = mcap_crc(bytes, crc_);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view type,
                                      std::string_view descriptors) {
  channels_.emplace_back();
  const auto id = static_cast<std::uint16_t>(channels_.size());  // of its schema, too
  std::string schema, channel;
  add_record(schema, Op::schema, FieldBytes().add(id).text(type).text("protobuf").text(descriptors).bytes());
  add_record(channel, Op::channel,
             FieldBytes().add(id).add(id).text(topic).text("protobuf").text("").bytes());
  chunk_ += schema + channel;
  schema_records_ += schema;
  channel_records_ += channel;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view message) {
  Channel& to = channels_.at(channel - 1U);
  to.in_chunk.push_back({time_ns, chunk_.size()});
  const auto number = static_cast<std::uint32_t>(to.messages++);
  add_record(chunk_, Op::message, FieldBytes().add(channel).add(number).add(time_ns).add(time_ns).bytes(),
             message);
  chunk_span_.extend(time_ns, time_ns);
  if (chunk_.size() >= chunk_size) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  const std::string packed = compressed(chunk_);
  const std::uint64_t chunk_begin = written_, size = chunk_.size();
  std::string record;
  add_record(record, Op::chunk,
             FieldBytes()
                 .add(chunk_span_.begin_ns)
                 .add(chunk_span_.end_ns)
                 .add(size)
                 .add(mcap_crc(chunk_))
                 .text(compression)
                 .add(static_cast<std::uint64_t>(packed.size()))
                 .bytes(),
             packed);
  put(record);

  const std::uint64_t index_begin = written_;
  std::string indexes;
  FieldBytes offsets;  // of each channel's index
  for (std::uint16_t id = 1; id <= channels_.size(); ++id) {
    std::vector<Place>& places = channels_[id - 1U].in_chunk;
    if (places.empty()) continue;
    FieldBytes entries;
    for (const Place& place : places) entries.add(place.time_ns).add(place.offset);
    offsets.add(id).add(index_begin + indexes.size());
    add_record(indexes, Op::message_index, FieldBytes().add(id).text(entries.bytes()).bytes());
    places.clear();
  }
  put(indexes);
  add_record(chunk_indexes_, Op::chunk_index,
             FieldBytes()
                 .add(chunk_span_.begin_ns)
                 .add(chunk_span_.end_ns)
                 .add(chunk_begin)
                 .add(static_cast<std::uint64_t>(record.size()))
                 .text(offsets.bytes())
                 .add(static_cast<std::uint64_t>(indexes.size()))
                 .text(compression)
                 .add(static_cast<std::uint64_t>(packed.size()))
                 .add(size)
                 .bytes());
  if (!chunk_span_.empty) span_.extend(chunk_span_.begin_ns, chunk_span_.end_ns);
  ++chunks_;
  chunk_.clear();
  chunk_span_ = {};
}

std::string McapWriter::statistics() const {
  std::uint64_t messages = 0;
  FieldBytes counts;
  for (std::uint16_t id = 1; id <= channels_.size(); ++id) {
    messages += channels_[id - 1U].messages;
    counts.add(id).add(channels_[id - 1U].messages);
  }
  const auto channels = static_cast<std::uint16_t>(channels_.size());
  std::string record;
  add_record(record, Op::statistics,
             FieldBytes()
                 .add(messages)
                 .add(channels)  // schemas
                 .add(std::uint32_t{channels})
                 .add(std::uint32_t{0})  // attachments
                 .add(std::uint32_t{0})  // metadata
                 .add(chunks_)
                 .add(span_.begin_ns)
                 .add(span_.end_ns)
                 .text(counts.bytes())
                 .bytes());
  return record;
}

void McapWriter::finish() {
  end_chunk();
  std::string record;
  add_record(record, Op::data_end, FieldBytes().add(crc_).bytes());
  put(record);

  const std::uint64_t summary_begin = written_;
  std::string summary, offsets;
  for (const auto& [op, records] :
       {std::pair(Op::schema, schema_records_), std::pair(Op::channel, channel_records_),
        std::pair(Op::statistics, statistics()), std::pair(Op::chunk_index, chunk_indexes_)}) {
    if (records.empty()) continue;
    add_record(offsets, Op::summary_offset,
               FieldBytes()
                   .add(static_cast<std::uint8_t>(op))
                   .add(summary_begin + summary.size())
                   .add(static_cast<std::uint64_t>(records.size()))
                   .bytes());
    summary += records;
  }
  const std::uint64_t offsets_begin = summary_begin + summary.size();
  summary += offsets;
  // The footer's checksum covers the summary and the footer's fields before it.
  std::string footer;
  add_record(footer, Op::footer, FieldBytes().add(summary_begin).add(offsets_begin).bytes(), "1234");
  footer.resize(footer.size() - 4);
  summary += footer;
  put(summary);
  put(FieldBytes().add(mcap_crc(summary)).bytes());
  put(mcap_magic);
}

}  // namespace octosurf::io
