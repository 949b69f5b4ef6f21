#include "io/exporters/mcap_writer.hpp"

#include "io/mcap_format.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <concepts>
#include <map>
#include <new>
#include <string_view>
#include <zstd.h>

namespace octosurf::io {
namespace {

constexpr std::string_view compression = "zstd";

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

void add_record(std::string& to, McapOp op, std::string_view content, std::string_view rest = {}) {
  to += content_of(static_cast<std::uint8_t>(op), static_cast<std::uint64_t>(content.size() + rest.size()));
  to += content;
  to += rest;
}

struct Channel {
  std::uint16_t id = 0;  ///< of its schema, too
  std::uint32_t messages = 0;
  std::string index;  ///< time and offset in the chunk of each
};

}  // namespace

void write_mcap(std::ostream& out, const std::vector<McapMessage>& messages, const std::string& descriptors) {
  std::map<std::string, Channel> channels;  // by topic
  std::string schemas, definitions;
  for (const McapMessage& message : messages) {
    if (channels.contains(message.topic)) continue;
    const auto id = static_cast<std::uint16_t>(channels.size() + 1);
    channels[message.topic].id = id;
    add_record(schemas, McapOp::schema, content_of(id, message.type, "protobuf", descriptors));
    add_record(definitions, McapOp::channel, content_of(id, id, message.topic, "protobuf", ""));
  }
  std::string chunk = schemas + definitions;
  for (const McapMessage& message : messages) {
    Channel& channel = channels[message.topic];
    channel.index += content_of(message.time_ns, std::uint64_t{chunk.size()});
    add_record(chunk, McapOp::message,
               content_of(channel.id, channel.messages++, message.time_ns, message.time_ns), message.bytes);
  }
  const auto [first, last] = std::ranges::minmax_element(messages, {}, &McapMessage::time_ns);
  const std::uint64_t begin_ns = messages.empty() ? 0 : first->time_ns,
                      end_ns = messages.empty() ? 0 : last->time_ns;

  std::string file(mcap_magic);
  add_record(file, McapOp::header, content_of("", "octosurf"));  // profile, library
  const std::string packed = compressed(chunk);
  const std::uint64_t chunk_begin = file.size(), size = chunk.size(), packed_size = packed.size();
  add_record(file, McapOp::chunk,
             content_of(begin_ns, end_ns, size, crc32_of(chunk), compression, packed_size), packed);
  const std::uint64_t index_begin = file.size();
  std::string offsets, counts;  // of each channel
  for (const auto& [topic, channel] : channels) {
    offsets += content_of(channel.id, std::uint64_t{file.size()});
    counts += content_of(channel.id, std::uint64_t{channel.messages});
    add_record(file, McapOp::message_index, content_of(channel.id, channel.index));
  }
  const std::uint64_t index_size = file.size() - index_begin;
  add_record(file, McapOp::data_end, content_of(crc32_of(file)));

  const auto count = static_cast<std::uint16_t>(channels.size());
  std::string statistics, chunk_index, summary, groups;
  add_record(statistics, McapOp::statistics,
             content_of(std::uint64_t{messages.size()}, count /* schemas */, std::uint32_t{count},
                        std::uint32_t{0} /* attachments */, std::uint32_t{0} /* metadata */,
                        std::uint32_t{1} /* chunks */, begin_ns, end_ns, counts));
  add_record(chunk_index, McapOp::chunk_index,
             content_of(begin_ns, end_ns, chunk_begin, index_begin - chunk_begin, offsets, index_size,
                        compression, packed_size, size));
  const std::uint64_t summary_begin = file.size();
  for (const auto& [op, records] :
       {std::pair(McapOp::schema, schemas), std::pair(McapOp::channel, definitions),
        std::pair(McapOp::statistics, statistics), std::pair(McapOp::chunk_index, chunk_index)}) {
    if (records.empty()) continue;
    add_record(groups, McapOp::summary_offset,
               content_of(static_cast<std::uint8_t>(op), summary_begin + summary.size(),
                          std::uint64_t{records.size()}));
    summary += records;
  }
  // The footer's checksum covers the summary and the footer's fields before it.
  std::string footer;
  add_record(footer, McapOp::footer, content_of(summary_begin, summary_begin + summary.size()), "1234");
  footer.resize(footer.size() - 4);
  summary += groups + footer;
  file += summary + content_of(crc32_of(summary));
  file += mcap_magic;
  out.write(file.data(), static_cast<std::streamsize>(file.size()));
}

}  // namespace octosurf::io
