// MCAP, the container format of recordings (mcap.dev/spec, version 0): its records and their
// encoding. Numbers are little-endian. Internal to common/replay.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay::mcap {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t kRecordHead = 9;              ///< opcode and length
inline constexpr std::size_t kFooterContent = 20;          ///< bytes
inline constexpr std::size_t kMessageHead = 22;            ///< bytes before a message's data
inline constexpr std::uint64_t kMostRecords = 512u << 20;  ///< bytes in a chunk, unpacked

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

struct Schema {
  std::uint16_t id = 0;
  std::string name, encoding, text;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::uint16_t id = 0, schema = 0;
  std::string topic, encoding;
  std::map<std::string, std::string> metadata = {};
  bool operator==(const Channel&) const = default;
};

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0, publish_ns = 0;  ///< times since the epoch
  Bytes data = {};
};

struct ChunkIndex {
  std::uint64_t start_ns = 0, end_ns = 0;  ///< log times of the first and the last message
  std::uint64_t offset = 0, length = 0;    ///< the chunk's record, including its header
  std::map<std::uint16_t, std::uint64_t> index_offsets = {};  ///< offsets by channel
  std::uint64_t index_length = 0;
  std::string compression = {};
  std::uint64_t packed = 0, unpacked = 0;  ///< size of its records in bytes
};

struct Statistics {
  std::uint64_t messages = 0, start_ns = 0, end_ns = 0;
  std::uint32_t schemas = 0, channels = 0, chunks = 0;
  std::map<std::uint16_t, std::uint64_t> by_channel = {};
};

/// Appends values.
class Put {
 public:
  explicit Put(std::vector<std::uint8_t>& to) : to_(to) {}

  template <class X>
  void number(X x) {
    for (std::size_t i = 0; i < sizeof(X); ++i) {
      to_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(x) >> (8 * i)));
    }
  }
  void bytes(Bytes bytes) { to_.insert(to_.end(), bytes.begin(), bytes.end()); }
  void text(std::string_view text);
  void counts(const std::map<std::uint16_t, std::uint64_t>& map);
  void record(Op op, const std::vector<std::uint8_t>& content);

 private:
  std::vector<std::uint8_t>& to_;
};

/// Reads values. Returns false and consumes nothing if the bytes end too early.
class Take {
 public:
  explicit Take(Bytes bytes) : bytes_(bytes) {}

  template <class X>
  bool number(X& x) {
    if (bytes_.size() < sizeof(X)) return false;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(X); ++i) value |= std::uint64_t{bytes_[i]} << (8 * i);
    x = static_cast<X>(value);
    bytes_ = bytes_.subspan(sizeof(X));
    return true;
  }
  bool bytes(Bytes& part, std::uint64_t length);
  bool text(std::string& text);
  bool counts(std::map<std::uint16_t, std::uint64_t>& map);
  Bytes rest() const { return bytes_; }

 private:
  Bytes bytes_;
};

struct Record {
  Op op{};
  Bytes content;
};
/// Removes the first record from `bytes` and returns it. Returns nothing if it is truncated.
std::optional<Record> takeRecord(Bytes& bytes);

void putSchema(std::vector<std::uint8_t>& to, const Schema& schema);
void putChannel(std::vector<std::uint8_t>& to, const Channel& channel);
void putMessage(std::vector<std::uint8_t>& to, const Message& message);
void putChunkIndex(std::vector<std::uint8_t>& to, const ChunkIndex& index);
void putStatistics(std::vector<std::uint8_t>& to, const Statistics& statistics);

std::optional<Schema> schemaFrom(Bytes content);
std::optional<Channel> channelFrom(Bytes content);
std::optional<Message> messageFrom(Bytes content);
std::optional<ChunkIndex> chunkIndexFrom(Bytes content);
std::optional<Statistics> statisticsFrom(Bytes content);

/// CRC-32 (ISO-HDLC) as used by MCAP; `before` is the checksum of the preceding bytes.
std::uint32_t crc(Bytes bytes, std::uint32_t before = 0);

}  // namespace perdure::replay::mcap
