// Readers and writers of domain messages, with conversion, checks and counts. A writer may be used
// by any one thread at a time; counts may be read from any thread.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/bus/domain.h"
#include "common/bus/topics.h"
#include "common/wire/codec.h"

namespace perdure::bus {

struct WriterOptions {
  /// For exclusive topics: readers receive messages of the live writer with the highest strength.
  std::int32_t strength = 0;
  double lease_s = 0.0;  ///< lease of the liveliness; 0: that of the topic table
};

/// Common base of readers and writers: a DDS entity, a name for its counts, and refusals.
class Endpoint {
 public:
  const std::string& topic() const { return topic_; }
  std::int32_t handle() const { return handle_; }
  /// Returns the detail, with the fix, of the first refusal of each kind, by the name of its count.
  std::map<std::string, std::string> firstDetails() const;

 protected:
  Endpoint(std::string topic, std::shared_ptr<const Entity> entity);
  const std::shared_ptr<const Entity>& entity() const { return entity_; }
  void replace(std::shared_ptr<const Entity> entity);
  void count(const char* what, const Reason& reason);
  /// Adds `n` to the count "<topic>_<what>" if `n` is not 0.
  void add(ReasonCounts& counts, const char* what, std::uint64_t n) const;
  void addRefusals(ReasonCounts& counts) const;
  /// Returns the reason of a failure of DDS, and counts it as <topic>_<what>_<error>.
  Result<void> outcome(const char* what, std::int32_t code);

 private:
  std::string topic_, count_prefix_;
  std::shared_ptr<const Entity> entity_;
  std::atomic<std::int32_t> handle_;
  mutable std::mutex mutex_;
  ReasonCounts refusals_;
  std::map<std::string, std::string> first_details_;
};

/// A reader of Perdure's messages or of those of third-party programs.
class AnyReader : public Endpoint {
 public:
  std::size_t matched() const;
  /// Adds the counts of DDS and of the checks since the start: <topic>_malformed_<reason>,
  /// _incompatible_qos and _sample_lost.
  void report(ReasonCounts& counts) const;

 protected:
  using Endpoint::Endpoint;
};

/// A writer of Perdure's messages or of those of third-party programs.
class AnyWriter : public Endpoint {
 public:
  std::size_t matched() const;
  /// Adds the counts <topic>_write_<error> and _incompatible_qos.
  void report(ReasonCounts& counts) const;

 protected:
  using Endpoint::Endpoint;
};

class RawWriter;

/// The earlier messages that a reader receives.
enum class ReadFrom {
  kNow,  ///< no stored messages, except those of a latched topic
  kNew,  ///< no stored messages, not even those of a latched topic
  /// The newest message, from writers that store it (Qos::kept); other writers do not match.
  kKept,
};

class RawReader : public AnyReader {
 public:
  /// The number of matched writers that missed their lease, because they were killed, stopped or
  /// disconnected.
  std::size_t silent() const;
  /// Returns the highest strength among the matched writers of an exclusive topic, except `own`.
  /// Returns nothing if there are no other writers.
  std::optional<std::int32_t> strongestBut(const RawWriter& own) const;
  /// Also adds _sample_rejected, _in_shared_memory, and the present number of _writers_silent.
  void report(ReasonCounts& counts) const;

 protected:
  RawReader(const Participant& participant, const std::string& topic,
            ReadFrom from = ReadFrom::kNow);
  /// Takes at most one batch of the available messages. Returns true if more may be available.
  bool takeBatch(const std::function<void(const void* wire)>& on_value,
                 const std::function<void(const void* wire)>& on_gone);
  using InPlace = std::function<void(std::span<const std::uint8_t>, std::shared_ptr<const void>)>;
  /// Takes messages without copying them. Each message stays valid while its keeper exists.
  bool takeBatchInPlace(const InPlace& on_value);

 private:
  std::atomic<std::uint64_t> in_shared_memory_{0};
};

template <class T>
class Reader : public RawReader {
 public:
  using Handler = std::function<void(const T&)>;

  Reader(const Participant& participant, const Topic<T>& topic, ReadFrom from = ReadFrom::kNow)
      : RawReader(participant, topic.name, from) {}

  /// Passes all received messages to `handler`, in order; malformed messages are counted. `on_gone`
  /// receives the key of each disposed instance (other fields are undefined).
  void drain(const Handler& handler, const Handler& on_gone = {}) {
    while (drainBatch(handler, on_gone)) {
    }
  }
  /// Works like drain(), but for at most one batch. Returns true if more messages may be available.
  bool drainBatch(const Handler& handler, const Handler& on_gone = {}) {
    const auto offer = [&](const Result<T>& value) {
      if (value) {
        handler(*value);
      } else {
        count("malformed", value.error());
      }
    };
    if constexpr (wire::kDecodedInPlace<T>) {
      return takeBatchInPlace(
          [&](std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper) {
            offer(wire::decodeInPlace<T>(cdr, std::move(keeper)));
          });
    } else {
      using Wire = typename wire::Type<T>::Wire;
      const auto on_key = [&](const void* sample) {
        if (on_gone) on_gone(wire::decodeKey<T>(*static_cast<const Wire*>(sample)));
      };
      return takeBatch(
          [&](const void* sample) { offer(wire::decode<T>(*static_cast<const Wire*>(sample))); },
          on_key);
    }
  }
};

class RawWriter : public AnyWriter {
 public:
  std::int32_t strength() const { return strength_; }
  /// Sets the strength on an exclusive topic. It may be called at any time.
  void setStrength(std::int32_t strength);
  /// Asserts liveliness without a message, for exclusive topics.
  void assertLiveliness();
  /// The number of times that this writer missed its own lease and was considered dead.
  std::uint64_t livelinessLost() const;
  /// Waits until every matched reader has acknowledged all messages. Returns false on timeout.
  bool waitForAcknowledgement(double seconds);
  /// Also adds <topic>_refused_<reason> (invalid values of this process), _liveliness_lost and
  /// _left_shared_memory_<reason>.
  void report(ReasonCounts& counts) const;

 protected:
  RawWriter(const Participant& participant, const std::string& topic, const WriterOptions& options);
  /// Writes a message whose pixels have `bytes` bytes. If they do not fit into shared memory, the
  /// writer changes to the network permanently.
  Result<void> writeWire(const void* wire, std::size_t bytes = 0);
  Result<void> disposeWire(const void* wire);
  void unregisterWire(const void* wire);

 private:
  void leaveSharedMemory(const Reason& reason);
  void awaitJoin();

  const Participant participant_;
  const WriterOptions options_;
  std::int32_t strength_;
  bool in_shared_memory_;
  bool joined_ = false;
};

template <class T>
class Writer : public RawWriter {
 public:
  Writer(const Participant& participant, const Topic<T>& topic, const WriterOptions& options = {})
      : RawWriter(participant, topic.name, options) {}

  /// Writes a value. If the value cannot be written, counts and returns the reason.
  Result<void> write(const T& value) {
    typename wire::Type<T>::Wire sample;
    if (auto encoded = wire::encode(value, sample, arena_); !encoded) {
      count("refused", encoded.error());
      return encoded;
    }
    if constexpr (wire::kDecodedInPlace<T>) return writeWire(&sample, sample.pixels._length);
    return writeWire(&sample);
  }
  /// Releases an exclusive topic without a key. Until the next write, readers receive the writer
  /// with the next lower strength.
  void release() {
    typename wire::Type<T>::Wire sample{};
    unregisterWire(&sample);
  }
  /// Disposes the instance with the key of `key`; other fields are not read. Late joiners receive
  /// neither the instance nor the disposal.
  Result<void> dispose(const T& key) {
    typename wire::Type<T>::Wire sample;
    (void)wire::encode(key, sample, arena_);  // fields other than the key may be invalid
    return disposeWire(&sample);
  }

 private:
  wire::Arena arena_;
};

}  // namespace perdure::bus
