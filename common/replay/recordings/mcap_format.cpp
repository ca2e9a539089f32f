#include "common/replay/recordings/mcap_format.h"

#include <zlib.h>

#include <algorithm>

namespace perdure::replay::mcap {

void Put::text(std::string_view text) {
  number(static_cast<std::uint32_t>(text.size()));
  to_.insert(to_.end(), text.begin(), text.end());
}

void Put::counts(const std::map<std::uint16_t, std::uint64_t>& map) {
  constexpr std::size_t kEntry = sizeof(std::uint16_t) + sizeof(std::uint64_t);
  number(static_cast<std::uint32_t>(map.size() * kEntry));
  for (const auto& [key, value] : map) {
    number(key);
    number(value);
  }
}

void Put::record(Op op, const std::vector<std::uint8_t>& content) {
  number(static_cast<std::uint8_t>(op));
  number(static_cast<std::uint64_t>(content.size()));
  bytes(content);
}

bool Take::bytes(Bytes& part, std::uint64_t length) {
  if (length > bytes_.size()) return false;
  part = bytes_.first(length);
  bytes_ = bytes_.subspan(length);
  return true;
}

bool Take::text(std::string& text) {
  std::uint32_t length = 0;
  Bytes part;
  if (!number(length) || !bytes(part, length)) return false;
  text.assign(part.begin(), part.end());
  return true;
}

bool Take::counts(std::map<std::uint16_t, std::uint64_t>& map) {
  std::uint32_t length = 0;
  Bytes part;
  if (!number(length) || !bytes(part, length)) return false;
  Take entries(part);
  while (!entries.rest().empty()) {
    std::uint16_t key = 0;
    std::uint64_t value = 0;
    if (!entries.number(key) || !entries.number(value)) return false;
    map[key] = value;
  }
  return true;
}

std::optional<Record> takeRecord(Bytes& bytes) {
  Take take(bytes);
  std::uint8_t op = 0;
  std::uint64_t length = 0;
  Record record;
  if (!take.number(op) || !take.number(length) || !take.bytes(record.content, length)) {
    return std::nullopt;
  }
  record.op = static_cast<Op>(op);
  bytes = take.rest();
  return record;
}

void putSchema(std::vector<std::uint8_t>& to, const Schema& schema) {
  std::vector<std::uint8_t> content;
  Put put(content);
  put.number(schema.id);
  put.text(schema.name);
  put.text(schema.encoding);
  put.text(schema.text);
  Put(to).record(Op::kSchema, content);
}

std::optional<Schema> schemaFrom(Bytes content) {
  Take take(content);
  Schema schema;
  const bool whole = take.number(schema.id) && take.text(schema.name) &&
                     take.text(schema.encoding) && take.text(schema.text);
  return whole && schema.id != 0 ? std::optional(schema) : std::nullopt;
}

void putChannel(std::vector<std::uint8_t>& to, const Channel& channel) {
  std::vector<std::uint8_t> content, pairs;
  for (const auto& [key, value] : channel.metadata) {
    Put(pairs).text(key);
    Put(pairs).text(value);
  }
  Put put(content);
  put.number(channel.id);
  put.number(channel.schema);
  put.text(channel.topic);
  put.text(channel.encoding);
  put.number(static_cast<std::uint32_t>(pairs.size()));
  put.bytes(pairs);
  Put(to).record(Op::kChannel, content);
}

std::optional<Channel> channelFrom(Bytes content) {
  Take take(content);
  Channel channel;
  std::uint32_t length = 0;
  Bytes pairs;
  if (!take.number(channel.id) || !take.number(channel.schema) || !take.text(channel.topic) ||
      !take.text(channel.encoding) || !take.number(length) || !take.bytes(pairs, length)) {
    return std::nullopt;
  }
  Take entries(pairs);
  while (!entries.rest().empty()) {
    std::string key, value;
    if (!entries.text(key) || !entries.text(value)) return std::nullopt;
    channel.metadata[key] = value;
  }
  return channel;
}

void putMessage(std::vector<std::uint8_t>& to, const Message& message) {
  Put put(to);
  put.number(static_cast<std::uint8_t>(Op::kMessage));
  put.number(static_cast<std::uint64_t>(kMessageHead + message.data.size()));
  put.number(message.channel);
  put.number(message.sequence);
  put.number(message.log_ns);
  put.number(message.publish_ns);
  put.bytes(message.data);
}

std::optional<Message> messageFrom(Bytes content) {
  Take take(content);
  Message message;
  if (!take.number(message.channel) || !take.number(message.sequence) ||
      !take.number(message.log_ns) || !take.number(message.publish_ns)) {
    return std::nullopt;
  }
  message.data = take.rest();
  return message;
}

void putChunkIndex(std::vector<std::uint8_t>& to, const ChunkIndex& index) {
  std::vector<std::uint8_t> content;
  Put put(content);
  put.number(index.start_ns);
  put.number(index.end_ns);
  put.number(index.offset);
  put.number(index.length);
  put.counts(index.index_offsets);
  put.number(index.index_length);
  put.text(index.compression);
  put.number(index.packed);
  put.number(index.unpacked);
  Put(to).record(Op::kChunkIndex, content);
}

std::optional<ChunkIndex> chunkIndexFrom(Bytes content) {
  Take take(content);
  ChunkIndex index;
  const bool whole = take.number(index.start_ns) && take.number(index.end_ns) &&
                     take.number(index.offset) && take.number(index.length) &&
                     take.counts(index.index_offsets) && take.number(index.index_length) &&
                     take.text(index.compression) && take.number(index.packed) &&
                     take.number(index.unpacked);
  return whole ? std::optional(index) : std::nullopt;
}

void putStatistics(std::vector<std::uint8_t>& to, const Statistics& statistics) {
  std::vector<std::uint8_t> content;
  Put put(content);
  put.number(statistics.messages);
  put.number(static_cast<std::uint16_t>(statistics.schemas));
  put.number(statistics.channels);
  put.number(std::uint32_t{0});  // attachments
  put.number(std::uint32_t{0});  // metadata
  put.number(statistics.chunks);
  put.number(statistics.start_ns);
  put.number(statistics.end_ns);
  put.counts(statistics.by_channel);
  Put(to).record(Op::kStatistics, content);
}

std::optional<Statistics> statisticsFrom(Bytes content) {
  Take take(content);
  Statistics statistics;
  std::uint16_t schemas = 0;
  std::uint32_t attachments = 0, metadata = 0;
  const bool whole = take.number(statistics.messages) && take.number(schemas) &&
                     take.number(statistics.channels) && take.number(attachments) &&
                     take.number(metadata) && take.number(statistics.chunks) &&
                     take.number(statistics.start_ns) && take.number(statistics.end_ns) &&
                     take.counts(statistics.by_channel);
  statistics.schemas = schemas;
  return whole ? std::optional(statistics) : std::nullopt;
}

std::uint32_t crc(Bytes bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace perdure::replay::mcap
