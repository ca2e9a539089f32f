// Bags of ROS 1 (format 2.0): records of named fields and data, and messages in chunks, each
// followed by an index. The reader scans the record headers. A bag that was never closed
// (`.bag.active`, or renamed) is therefore read as far as possible.
#include <algorithm>
#include <cstring>
#include <functional>
#include <queue>
#include <tuple>

#include "common/base/errors.h"
#include "common/replay/recordings/mcap_format.h"
#include "common/replay/recordings/read_file.h"
#include "common/replay/recordings/ros_messages.h"
#include "common/replay/recordings/unpack.h"

namespace perdure::replay {
namespace {

using Bytes = std::span<const std::uint8_t>;
using HeadFields = std::map<std::string, std::string>;

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kMostHead = 1u << 20;
constexpr std::uint64_t kMostChunk = 64u << 20;  // rosbag writes 768 kB
constexpr std::uint64_t kMostHeld = 1u << 30;    // largest memory of chunks unpacked at one time

enum class Op : std::uint8_t { kMessage = 2, kIndex = 4, kChunk = 5, kConnection = 7 };

template <class X>
X numberIn(std::string_view bytes) {
  X x = 0;
  mcap::Take take({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  take(x);
  return x;
}

/// Parses "name=value" fields, each preceded by its length. Returns nothing if the lengths do not
/// fit.
std::optional<HeadFields> fieldsOf(Bytes head) {
  HeadFields fields;
  mcap::Take take(head);
  while (!take.rest().empty()) {
    std::string field;
    if (!take(field)) return std::nullopt;
    const auto sign = field.find('=');
    if (sign == std::string::npos) return std::nullopt;
    fields[field.substr(0, sign)] = field.substr(sign + 1);
  }
  return fields;
}

std::uint64_t nanoseconds(std::uint32_t seconds, std::uint32_t rest) {
  return std::uint64_t{seconds} * 1'000'000'000 + rest;
}

std::optional<Op> opOf(const HeadFields& fields) {
  const auto op = fields.find("op");
  if (op == fields.end() || op->second.size() != 1) return std::nullopt;
  return static_cast<Op>(op->second[0]);
}

std::string valueOf(const HeadFields& fields, const std::string& name) {
  const auto found = fields.find(name);
  return found == fields.end() ? "" : found->second;
}

struct ChunkPlace {
  std::uint64_t at = 0, packed = 0;
  std::uint32_t unpacked = 0;
  std::string compression = {};
  std::uint64_t start_ns = UINT64_MAX, end_ns = 0;
  std::set<std::uint32_t> connections = {};
  std::uint64_t number = 0;  ///< number of the chunk in the order of the file
};

class Bag : public RosSource {
 public:
  explicit Bag(const std::filesystem::path& path) : file_(opened(path)) {
    walk();
    for (ChunkPlace& chunk : chunks_) {
      if (chunk.connections.empty()) {
        indexByLooking(chunk);
      } else if (!knowsAllOf(chunk)) {
        learnConnections(chunk);
      }
    }
    for (const auto& [connection, n] : counts_) {
      const auto known = connections_.find(connection);
      if (known == connections_.end()) continue;
      RosTopic& topic = topics_[known->second.first];
      topic.type = known->second.second;
      topic.encoding = ros::Encoding::kRos1;
      topic.messages += n;
    }
    for (std::size_t i = 0; i < chunks_.size(); ++i) chunks_[i].number = i;
    std::stable_sort(chunks_.begin(), chunks_.end(),
                     [](const auto& a, const auto& b) { return a.start_ns < b.start_ns; });
  }

  void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) override {
    wanted_ = wanted;
    from_ns_ = from_ns;
    next_chunk_ = 0;
    pending_ = {};
  }

  std::optional<RosMessage> next() override {
    while (next_chunk_ < chunks_.size() &&
           (pending_.empty() || chunks_[next_chunk_].start_ns <= pending_.top().message.log_ns)) {
      load(chunks_[next_chunk_++]);
    }
    if (pending_.empty()) return std::nullopt;
    RosMessage message = pending_.top().message;
    pending_.pop();
    return message;
  }

 private:
  struct Pending {
    RosMessage message;
    std::uint64_t order = 0;
    /// The top of the queue is the largest element, here the earliest one.
    bool operator<(const Pending& other) const {
      return std::tie(message.log_ns, order) > std::tie(other.message.log_ns, other.order);
    }
  };
  using Records = std::shared_ptr<const std::vector<std::uint8_t>>;

  static ReadFile opened(const std::filesystem::path& path) {
    auto file = ReadFile::open(path);
    if (!file) throw StartupError(ExitCode::kUnavailable, file.error().detail);
    if (file->size() == 0) {
      throw StartupError(ExitCode::kUnavailable, "{} is empty, 0 bytes; fetch it again",
                         path.c_str());
    }
    const auto begin = file->read(0, kMagic.size());
    if (std::equal(begin.begin(), begin.end(), kMagic.begin(), kMagic.end())) {
      return *std::move(file);
    }
    const bool older = std::string(begin.begin(), begin.end()).starts_with("#ROSBAG V1");
    throw StartupError(ExitCode::kUnavailable, "{} {}", path.c_str(),
                       older ? "is a bag of format 1; `rosbag fix` makes a newer one of it"
                             : "is no bag of ROS 1; fetch it again");
  }

  void walk() {
    std::uint64_t at = kMagic.size();
    while (at < file_.size()) {
      const auto length = numberAt(at);
      const std::uint64_t data_at = at + 8 + length.value_or(0);
      if (!length || *length > kMostHead || data_at > file_.size()) return cutAt(at);
      const auto fields = fieldsOf(file_.read(at + 4, *length));
      const auto data = numberAt(data_at - 4);
      if (!fields || !data || *data > file_.size() - data_at) return cutAt(at);
      take(*fields, data_at, *data);
      at = data_at + *data;
    }
  }

  std::optional<std::uint32_t> numberAt(std::uint64_t at) const {
    const auto bytes = file_.read(at, 4);
    std::uint32_t number = 0;
    return mcap::Take(bytes)(number) ? std::optional(number) : std::nullopt;
  }

  void cutAt(std::uint64_t at) {
    count({"unfinished", name() + " was not finished: " + std::to_string(file_.size() - at) +
                             " bytes at its end are lost; `rosbag reindex` makes it whole"});
  }

  void take(const HeadFields& fields, std::uint64_t at, std::uint32_t length) {
    const auto op = opOf(fields);
    if (op == Op::kChunk) {
      chunks_.push_back({at, length, numberIn<std::uint32_t>(valueOf(fields, "size")),
                         valueOf(fields, "compression")});
    } else if (op == Op::kConnection) {
      takeConnection(fields,
                     length > kMostHead ? std::vector<std::uint8_t>() : file_.read(at, length));
    } else if (op == Op::kIndex && !chunks_.empty()) {
      takeIndex(fields, file_.read(at, length));
    }
  }

  void takeConnection(const HeadFields& fields, Bytes data) {
    const auto more = fieldsOf(data);
    if (!more) return count({"connection_damaged", name() + ": a topic of no type"});
    connections_[numberIn<std::uint32_t>(valueOf(fields, "conn"))] = {valueOf(fields, "topic"),
                                                                      valueOf(*more, "type")};
  }

  void takeIndex(const HeadFields& fields, Bytes entries) {
    const auto connection = numberIn<std::uint32_t>(valueOf(fields, "conn"));
    mcap::Take take(entries);
    std::uint32_t seconds = 0, rest = 0, offset = 0;
    while (take(seconds) && take(rest) && take(offset)) {
      note(chunks_.back(), connection, nanoseconds(seconds, rest));
    }
  }

  void note(ChunkPlace& chunk, std::uint32_t connection, std::uint64_t log_ns) {
    chunk.start_ns = std::min(chunk.start_ns, log_ns);
    chunk.end_ns = std::max(chunk.end_ns, log_ns);
    chunk.connections.insert(connection);
    ++counts_[connection];
    start_ns_ = std::min(start_ns_, log_ns);
    end_ns_ = std::max(end_ns_, log_ns);
  }

  bool knowsAllOf(const ChunkPlace& chunk) const {
    return std::all_of(chunk.connections.begin(), chunk.connections.end(),
                       [this](std::uint32_t one) { return connections_.contains(one); });
  }

  /// Reads the connection records in a chunk. This is necessary if the end of the file, which
  /// repeats them, is missing.
  void learnConnections(const ChunkPlace& chunk) {
    if (const auto records = unpack(chunk))
      forEachMessage(**records, [](std::uint32_t, std::uint64_t, Bytes) {});
  }

  void indexByLooking(ChunkPlace& chunk) {
    const auto records = unpack(chunk);
    if (!records) return count(records.error());
    forEachMessage(**records, [&](std::uint32_t connection, std::uint64_t log_ns, Bytes) {
      note(chunk, connection, log_ns);
    });
  }

  Result<Records> unpack(const ChunkPlace& chunk) const {
    auto packed = file_.read(chunk.at, chunk.packed);
    if (packed.size() != chunk.packed) return fail("file", name() + " cannot be read");
    if (chunk.compression.empty() || chunk.compression == "none")
      return std::make_shared<const std::vector<std::uint8_t>>(std::move(packed));
    std::vector<std::uint8_t> records;
    if (chunk.compression == "bz2") {
      records = unpackedBz2(packed, kMostChunk);
    } else if (chunk.compression == "lz4") {
      records = unpackedLz4(packed, kMostChunk);
    } else {
      return fail("chunk_of_other_compression",
                  name() + ": chunks packed by " + chunk.compression +
                      " are not read; `rosbag decompress` unpacks them");
    }
    if (records.size() != chunk.unpacked) {
      return fail("chunk_damaged", name() + ": a chunk does not unpack");
    }
    return std::make_shared<const std::vector<std::uint8_t>>(std::move(records));
  }

  void forEachMessage(Bytes records,
                      const std::function<void(std::uint32_t, std::uint64_t, Bytes)>& visit) {
    mcap::Take take(records);
    while (!take.rest().empty()) {
      std::uint32_t length = 0;
      Bytes head, data;
      const bool whole =
          take(length) && take.bytes(head, length) && take(length) && take.bytes(data, length);
      const auto fields = whole ? fieldsOf(head) : std::nullopt;
      if (!fields) {
        return count({"chunk_damaged", name() + ": a chunk ends within a record"});
      }
      const auto op = opOf(*fields);
      if (op == Op::kConnection) takeConnection(*fields, data);
      if (op != Op::kMessage) continue;
      const auto time = numberIn<std::uint64_t>(valueOf(*fields, "time"));
      visit(numberIn<std::uint32_t>(valueOf(*fields, "conn")),
            nanoseconds(static_cast<std::uint32_t>(time), static_cast<std::uint32_t>(time >> 32)),
            data);
    }
  }

  bool isWanted(std::uint32_t connection) const {
    const auto known = connections_.find(connection);
    return known != connections_.end() && wanted_.contains(known->second.first);
  }

  /// Limits the memory of unpacked chunks. Chunks whose times overlap are in memory together; those
  /// of rosbag overlap by fractions of a second.
  void hold(const Records& records) {
    std::erase_if(held_, [](const auto& one) { return one.expired(); });
    std::uint64_t sum = records->size();
    for (const auto& one : held_)
      if (const auto still = one.lock()) sum += still->size();
    if (sum > kMostHeld) {
      throw StartupError(ExitCode::kUnavailable,
                         name() +
                             ": the times of more than 1 GiB of its chunks overlap; "
                             "record again, or sort it: `rosbag filter IN OUT True`");
    }
    held_.push_back(records);
  }

  void load(const ChunkPlace& chunk) {
    const bool any = std::any_of(chunk.connections.begin(), chunk.connections.end(),
                                 [this](std::uint32_t connection) { return isWanted(connection); });
    if (!any || chunk.end_ns < from_ns_) return;
    const auto records = unpack(chunk);
    if (!records) return count(records.error());
    hold(*records);
    constexpr int kMessageBits = 24;
    std::uint64_t place = chunk.number << kMessageBits;
    forEachMessage(**records, [&](std::uint32_t connection, std::uint64_t log_ns, Bytes data) {
      ++place;
      if (!isWanted(connection)) return;
      pending_.push({{connections_.at(connection).first, log_ns, place, data, *records}, order_++});
    });
  }

  std::string name() const { return file_.path().string(); }

  ReadFile file_;
  std::map<std::uint32_t, std::pair<std::string, std::string>> connections_;  ///< topic and type
  std::map<std::uint32_t, std::uint64_t> counts_;
  std::vector<ChunkPlace> chunks_;  ///< sorted by time
  std::set<std::string> wanted_;
  std::uint64_t from_ns_ = 0, order_ = 0;
  std::size_t next_chunk_ = 0;
  std::priority_queue<Pending> pending_;
  std::vector<std::weak_ptr<const std::vector<std::uint8_t>>> held_;
};

}  // namespace

std::unique_ptr<RosSource> openBag(const std::filesystem::path& file) {
  return std::make_unique<Bag>(file);
}

}  // namespace perdure::replay
