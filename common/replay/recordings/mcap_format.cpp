#include "common/replay/recordings/mcap_format.h"

#include <zlib.h>

namespace perdure::replay::mcap {

std::optional<Record> takeRecord(Bytes& bytes) {
  Take take(bytes);
  std::uint8_t op = 0;
  std::uint64_t length = 0;
  Record record;
  if (!take(op) || !take(length) || !take.bytes(record.content, length)) return std::nullopt;
  record.op = static_cast<Op>(op);
  bytes = take.rest();
  return record;
}

/// Writes the record directly into `to`, so that its large data are copied only once.
void putMessage(std::vector<std::uint8_t>& to, const Message& message) {
  Put put(to);
  put(static_cast<std::uint8_t>(Op::kMessage));
  put(std::uint64_t{kMessageHead + message.data.size()});
  Message::fields(message, put);
  put.bytes(message.data);
}

std::optional<Message> messageFrom(Bytes content) {
  Take take(content);
  Message message;
  if (!Message::fields(message, take)) return std::nullopt;
  message.data = take.rest();
  return message;
}

std::uint32_t crc(Bytes bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace perdure::replay::mcap
