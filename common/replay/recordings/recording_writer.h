// Recordings of messages that a program has at hand: one file, whole when it is finished.
#pragma once

#include <filesystem>
#include <string>

#include "common/replay/recordings/mcap_writer.h"
#include "common/wire/cdr.h"

namespace perdure::replay {

class RecordingWriter {
 public:
  /// A new file. Throws StartupError: kUnavailable; the disk is full: kInputOutput.
  explicit RecordingWriter(const std::filesystem::path& file);

  /// Log times do not go back. `topic` is "odometry", …; reasons as encodeCdr and Writer::append.
  template <class T>
  Result<void> add(const std::string& topic, const T& value, std::uint64_t log_ns) {
    const auto bytes = wire::encodeCdr(value);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string type = wire::Type<T>::descriptor().m_typename;
    return addBytes({topic, type, wire::idlOf(type)}, *bytes, log_ns);
  }

  struct Kind {
    std::string topic, type, idl;
  };
  Result<void> addBytes(const Kind& kind, mcap::Bytes data, std::uint64_t log_ns);
  /// What was added since the last cut becomes a chunk; it comes by itself where that is large.
  Result<void> cut();
  Result<void> finish();

 private:
  std::uint16_t channelOf(const Kind& kind);

  mcap::Writer file_;
  mcap::Catalogue catalogue_;
  mcap::Draft draft_;
  std::uint32_t sequence_ = 0;
};

}  // namespace perdure::replay
