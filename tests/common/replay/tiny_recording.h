// Recordings of a few messages, made for tests.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "common/replay/mcap_writer.h"
#include "common/wire/cdr.h"

namespace perdure::replay {

class TinyRecording {
 public:
  explicit TinyRecording(const std::filesystem::path& file)
      : writer_(*mcap::Writer::create(file)) {}

  template <class T>
  void add(const std::string& topic, const T& value, std::uint64_t log_ns) {
    const auto bytes = wire::encodeCdr(value);
    if (!bytes) throw std::runtime_error(bytes.error().code + " " + bytes.error().detail);
    const std::string type = wire::Type<T>::descriptor().m_typename;
    draft_.add({channelOf(topic, type), ++sequence_, log_ns, log_ns, *bytes});
  }
  /// What was added since the last cut becomes a chunk.
  void cut() {
    if (draft_.empty()) return;
    (void)writer_.append(mcap::pack(draft_), catalogue_);
    draft_ = {};
  }
  void finish() {
    cut();
    (void)writer_.finish();
  }

 private:
  std::uint16_t channelOf(const std::string& topic, const std::string& type) {
    const std::string name = "perdure/ego/" + topic;
    for (const auto& [id, channel] : catalogue_.channels) {
      if (channel.topic == name) return id;
    }
    const auto id = static_cast<std::uint16_t>(catalogue_.channels.size() + 1);
    catalogue_.schemas[id] = {id, type, "omgidl", wire::idlOf(type)};
    catalogue_.channels[id] = {id, id, name, "cdr"};
    return id;
  }

  mcap::Writer writer_;
  mcap::Catalogue catalogue_;
  mcap::Draft draft_;
  std::uint32_t sequence_ = 0;
};

}  // namespace perdure::replay
