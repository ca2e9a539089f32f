// Writes the messages of a program to a recording: one file, complete when it is finished.
#pragma once

#include <filesystem>
#include <string>

#include "common/replay/recordings/mcap_writer.h"
#include "common/wire/cdr.h"

namespace perdure::replay {

class RecordingWriter {
 public:
  /// Creates a file. Throws StartupError: kUnavailable, or kInputOutput if the disk is full.
  explicit RecordingWriter(const std::filesystem::path& file);

  /// Adds a message on `topic` ("odometry", …). Log times must not decrease. Reasons are those of
  /// encodeCdr and Writer::append.
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
  /// Writes the messages since the last cut as a chunk. Large chunks are cut automatically.
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
