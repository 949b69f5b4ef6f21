#include "io/exporters/mcap_writer.hpp"

#include "io/text_file.hpp"

#include <algorithm>
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

template <std::unsigned_integral Number>
void add_field(std::string& content, Number number) {
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    content += static_cast<char>(static_cast<unsigned char>(number >> (8 * i)));
}

void add_field(std::string& content, std::string_view text) {
  add_field(content, static_cast<std::uint32_t>(text.size()));
  content += text;
}

/// Content of a record: numbers little-endian; a string, an array or a map behind its size.
template <class... Fields>
std::string content_of(const Fields&... fields) {
  std::string content;
  (add_field(content, fields), ...);
  return content;
}

}  // namespace

void McapWriter::Span::extend(std::uint64_t begin, std::uint64_t end) {
  begin_ns = empty ? begin : std::min(begin_ns, begin);
  end_ns = empty ? end : std::max(end_ns, end);
  empty = false;
}

McapWriter::McapWriter(std::ostream& out) : out_(out) {
  std::string bytes(mcap_magic);
  add_record(bytes, Op::header, content_of("", "octosurf"));  // profile, library
  put(bytes);
}

void McapWriter::add_record(std::string& to, Op op, std::string_view content, std::string_view rest) {
  to += content_of(static_cast<std::uint8_t>(op), static_cast<std::uint64_t>(content.size() + rest.size()));
  to += content;
  to += rest;
}

void McapWriter::put(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  written_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view type,
                                      std::string_view descriptors) {
  channels_.emplace_back();
  const auto id = static_cast<std::uint16_t>(channels_.size());  // of its schema, too
  std::string schema, channel;
  add_record(schema, Op::schema, content_of(id, type, "protobuf", descriptors));
  add_record(channel, Op::channel, content_of(id, id, topic, "protobuf", ""));
  chunk_ += schema + channel;
  schema_records_ += schema;
  channel_records_ += channel;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view message) {
  Channel& to = channels_.at(channel - 1U);
  to.in_chunk.push_back({time_ns, chunk_.size()});
  const auto number = static_cast<std::uint32_t>(to.messages++);
  add_record(chunk_, Op::message, content_of(channel, number, time_ns, time_ns), message);
  chunk_span_.extend(time_ns, time_ns);
  if (chunk_.size() >= chunk_size) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  const std::string packed = compressed(chunk_);
  const std::uint64_t chunk_begin = written_, size = chunk_.size();
  std::string record;
  add_record(record, Op::chunk,
             content_of(chunk_span_.begin_ns, chunk_span_.end_ns, size, crc32_of(chunk_), compression,
                        static_cast<std::uint64_t>(packed.size())),
             packed);
  put(record);

  const std::uint64_t index_begin = written_;
  std::string indexes, offsets;  // of each channel
  for (std::uint16_t id = 1; id <= channels_.size(); ++id) {
    std::vector<Place>& places = channels_[id - 1U].in_chunk;
    if (places.empty()) continue;
    std::string entries;
    for (const Place& place : places) entries += content_of(place.time_ns, place.offset);
    offsets += content_of(id, index_begin + indexes.size());
    add_record(indexes, Op::message_index, content_of(id, entries));
    places.clear();
  }
  put(indexes);
  add_record(chunk_indexes_, Op::chunk_index,
             content_of(chunk_span_.begin_ns, chunk_span_.end_ns, chunk_begin,
                        static_cast<std::uint64_t>(record.size()), offsets,
                        static_cast<std::uint64_t>(indexes.size()), compression,
                        static_cast<std::uint64_t>(packed.size()), size));
  if (!chunk_span_.empty) span_.extend(chunk_span_.begin_ns, chunk_span_.end_ns);
  ++chunks_;
  chunk_.clear();
  chunk_span_ = {};
}

std::string McapWriter::statistics() const {
  std::uint64_t messages = 0;
  std::string counts;
  for (std::uint16_t id = 1; id <= channels_.size(); ++id) {
    messages += channels_[id - 1U].messages;
    counts += content_of(id, channels_[id - 1U].messages);
  }
  const auto channels = static_cast<std::uint16_t>(channels_.size());
  std::string record;
  add_record(record, Op::statistics,
             content_of(messages, channels /* schemas */, std::uint32_t{channels},
                        std::uint32_t{0} /* attachments */, std::uint32_t{0} /* metadata */, chunks_,
                        span_.begin_ns, span_.end_ns, counts));
  return record;
}

void McapWriter::finish() {
  end_chunk();
  std::string record;
  add_record(record, Op::data_end, content_of(crc_));
  put(record);

  const std::uint64_t summary_begin = written_;
  std::string summary, offsets;
  for (const auto& [op, records] :
       {std::pair(Op::schema, schema_records_), std::pair(Op::channel, channel_records_),
        std::pair(Op::statistics, statistics()), std::pair(Op::chunk_index, chunk_indexes_)}) {
    if (records.empty()) continue;
    add_record(offsets, Op::summary_offset,
               content_of(static_cast<std::uint8_t>(op), summary_begin + summary.size(),
                          static_cast<std::uint64_t>(records.size())));
    summary += records;
  }
  const std::uint64_t offsets_begin = summary_begin + summary.size();
  summary += offsets;
  // The footer's checksum covers the summary and the footer's fields before it.
  std::string footer;
  add_record(footer, Op::footer, content_of(summary_begin, offsets_begin), "1234");
  footer.resize(footer.size() - 4);
  summary += footer;
  put(summary);
  put(content_of(crc32_of(summary)));
  put(mcap_magic);
}

}  // namespace octosurf::io
