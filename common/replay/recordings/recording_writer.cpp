#include "common/replay/recordings/recording_writer.h"

#include <utility>

#include "common/base/errors.h"

namespace perdure::replay {
namespace {

mcap::Writer created(const std::filesystem::path& path) {
  auto file = mcap::Writer::create(path);
  if (!file) throw StartupError(mcap::exitCodeOf(file.error()), file.error().detail);
  return *std::move(file);
}

}  // namespace

RecordingWriter::RecordingWriter(const std::filesystem::path& file) : file_(created(file)) {}

Result<void> RecordingWriter::addBytes(const Kind& kind, mcap::Bytes data, std::uint64_t log_ns) {
  constexpr std::size_t kLargest = 4u << 20;
  draft_.add({channelOf(kind), ++sequence_, log_ns, log_ns, data});
  return draft_.bytes() < kLargest ? Result<void>() : cut();
}

Result<void> RecordingWriter::cut() {
  if (draft_.empty()) return {};
  return file_.append(mcap::pack(std::exchange(draft_, {})), catalogue_);
}

Result<void> RecordingWriter::finish() {
  if (auto written = cut(); !written) return written;
  return file_.finish();
}

std::uint16_t RecordingWriter::channelOf(const Kind& kind) {
  const std::string name = "perdure/ego/" + kind.topic;
  for (const auto& [id, channel] : catalogue_.channels) {
    if (channel.topic == name) return id;
  }
  const auto id = static_cast<std::uint16_t>(catalogue_.channels.size() + 1);
  catalogue_.schemas[id] = {id, kind.type, "omgidl", kind.idl};
  catalogue_.channels[id] = {id, id, name, "cdr"};
  return id;
}

}  // namespace perdure::replay
