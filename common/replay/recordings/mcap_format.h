// MCAP, the container format of recordings (mcap.dev/spec, version 0): its records and their
// encoding. Numbers are little-endian. Internal to common/replay.
#pragma once

#include <array>
#include <concepts>
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
inline constexpr std::size_t kRecordHead = 9;      ///< opcode and length
inline constexpr std::size_t kFooterContent = 20;  ///< bytes
inline constexpr std::size_t kMessageHead = 22;    ///< bytes before a message's data
inline constexpr std::uint64_t kMostRecords = 512u
                                              << 20;  ///< largest size of an unpacked chunk, bytes

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

/// In each record, fields() lists the fields once, for writing and reading.
struct Schema {
  static constexpr Op kOp = Op::kSchema;
  std::uint16_t id = 0;
  std::string name, encoding, text;
  bool operator==(const Schema&) const = default;
  static bool fields(auto& m, auto& a) {
    return a(m.id) && a(m.name) && a(m.encoding) && a(m.text) && m.id != 0;
  }
};

struct Channel {
  static constexpr Op kOp = Op::kChannel;
  std::uint16_t id = 0, schema = 0;
  std::string topic, encoding;
  std::map<std::string, std::string> metadata = {};
  bool operator==(const Channel&) const = default;
  static bool fields(auto& m, auto& a) {
    return a(m.id) && a(m.schema) && a(m.topic) && a(m.encoding) && a(m.metadata);
  }
};

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0, publish_ns = 0;  ///< times since the epoch
  Bytes data = {};
  /// The fields before the data, which fill the rest of the record.
  static bool fields(auto& m, auto& a) {
    return a(m.channel) && a(m.sequence) && a(m.log_ns) && a(m.publish_ns);
  }
};

struct ChunkIndex {
  static constexpr Op kOp = Op::kChunkIndex;
  std::uint64_t start_ns = 0, end_ns = 0;  ///< log times of the first and the last message
  std::uint64_t offset = 0, length = 0;    ///< the chunk's record, including its header
  std::map<std::uint16_t, std::uint64_t> index_offsets =
      {};  ///< offsets of the message indexes, by channel
  std::uint64_t index_length = 0;
  std::string compression = {};
  std::uint64_t packed = 0, unpacked = 0;  ///< sizes of the chunk's records in bytes
  static bool fields(auto& m, auto& a) {
    return a(m.start_ns) && a(m.end_ns) && a(m.offset) && a(m.length) && a(m.index_offsets) &&
           a(m.index_length) && a(m.compression) && a(m.packed) && a(m.unpacked);
  }
};

struct Statistics {
  static constexpr Op kOp = Op::kStatistics;
  std::uint64_t messages = 0, start_ns = 0, end_ns = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, chunks = 0;
  std::map<std::uint16_t, std::uint64_t> by_channel = {};
  static bool fields(auto& m, auto& a) {
    std::uint32_t attachments = 0, metadata = 0;
    return a(m.messages) && a(m.schemas) && a(m.channels) && a(attachments) && a(metadata) &&
           a(m.chunks) && a(m.start_ns) && a(m.end_ns) && a(m.by_channel);
  }
};

/// Appends values in the encoding of MCAP.
class Put {
 public:
  explicit Put(std::vector<std::uint8_t>& to) : to_(to) {}

  bool operator()(std::unsigned_integral auto x) {
    for (std::size_t i = 0; i < sizeof x; ++i) {
      to_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(x) >> (8 * i)));
    }
    return true;
  }
  bool operator()(std::string_view text) {
    (*this)(static_cast<std::uint32_t>(text.size()));
    to_.insert(to_.end(), text.begin(), text.end());
    return true;
  }
  template <class Key, class Value>
  bool operator()(const std::map<Key, Value>& map) {
    std::vector<std::uint8_t> entries;
    for (const auto& [key, value] : map) {
      Put{entries}(key);
      Put{entries}(value);
    }
    (*this)(static_cast<std::uint32_t>(entries.size()));
    bytes(entries);
    return true;
  }
  void bytes(Bytes bytes) { to_.insert(to_.end(), bytes.begin(), bytes.end()); }
  void record(Op op, Bytes content) {
    (*this)(static_cast<std::uint8_t>(op));
    (*this)(std::uint64_t{content.size()});
    bytes(content);
  }

 private:
  std::vector<std::uint8_t>& to_;
};

/// Reads values. Each call returns false and consumes nothing if the bytes end too early.
class Take {
 public:
  explicit Take(Bytes bytes) : bytes_(bytes) {}

  template <std::unsigned_integral X>
  bool operator()(X& x) {
    if (bytes_.size() < sizeof(X)) return false;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(X); ++i) value |= std::uint64_t{bytes_[i]} << (8 * i);
    x = static_cast<X>(value);
    bytes_ = bytes_.subspan(sizeof(X));
    return true;
  }
  bool operator()(std::string& text) {
    Bytes part;
    if (!counted(part)) return false;
    text.assign(part.begin(), part.end());
    return true;
  }
  template <class Key, class Value>
  bool operator()(std::map<Key, Value>& map) {
    Bytes part;
    if (!counted(part)) return false;
    Take entries(part);
    while (!entries.rest().empty()) {
      Key key{};
      Value value{};
      if (!entries(key) || !entries(value)) return false;
      map[key] = value;
    }
    return true;
  }
  bool bytes(Bytes& part, std::uint64_t length) {
    if (length > bytes_.size()) return false;
    part = bytes_.first(length);
    bytes_ = bytes_.subspan(length);
    return true;
  }
  Bytes rest() const { return bytes_; }

 private:
  /// Reads a length of four bytes and that number of bytes.
  bool counted(Bytes& part) {
    std::uint32_t length = 0;
    return (*this)(length) && bytes(part, length);
  }

  Bytes bytes_;
};

struct Record {
  Op op{};
  Bytes content;
};
/// Removes the first record from `bytes` and returns it. Returns nothing if it is truncated.
std::optional<Record> takeRecord(Bytes& bytes);

template <class M>
void putRecord(std::vector<std::uint8_t>& to, const M& record) {
  std::vector<std::uint8_t> content;
  Put put(content);
  M::fields(record, put);
  Put(to).record(M::kOp, content);
}
/// Decodes the content of a record. Returns nothing if it is truncated or invalid.
template <class M>
std::optional<M> recordFrom(Bytes content) {
  Take take(content);
  M record;
  return M::fields(record, take) ? std::optional(std::move(record)) : std::nullopt;
}
void putMessage(std::vector<std::uint8_t>& to, const Message& message);
std::optional<Message> messageFrom(Bytes content);

/// CRC-32 (ISO-HDLC) as used by MCAP; `before` is the checksum of the preceding bytes.
std::uint32_t crc(Bytes bytes, std::uint32_t before = 0);

}  // namespace perdure::replay::mcap
