// A bounded queue to one client. A message of kNewest replaces the waiting one; with kEach, the
// oldest is dropped.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "services/gateway/core/channels.h"
#include "services/gateway/protocol/server_message.h"

namespace perdure::gateway::web {

struct Outgoing {
  bool text = false;
  std::uint32_t subscription = 0;  ///< 0 for a message of the protocol itself
  bool has_head = false;
  protocol::MessageHead head{};
  std::shared_ptr<const std::string> payload;
  std::size_t bytes() const { return payload->size() + (has_head ? head.size() : 0); }
};

class Outbox {
 public:
  /// `most_events`: limit of waiting events per subscription. `most_control`: limit of messages of
  /// the protocol itself.
  Outbox(std::size_t most_events, std::size_t most_control)
      : most_events_(most_events), most_control_(most_control) {}

  void put(const Encoded& message, std::uint32_t subscription, Delivery delivery);
  /// Adds a message of the protocol itself. Returns false if too many wait, because the client does
  /// not read.
  bool putControl(std::string message, bool text);
  /// Adds the time of the newest message, which replaces a waiting one.
  void putTime(std::string message);
  void forget(std::uint32_t subscription);

  std::optional<Outgoing> take();
  std::size_t size() const { return waiting_.size(); }
  std::uint64_t dropped() const { return dropped_; }
  /// Returns the number of events lost since the last call.
  std::uint64_t takeLostEvents();

 private:
  enum class Kind { kControl, kTime, kNewest, kEvent };
  struct Waiting {
    Kind kind;
    Outgoing message;
  };
  Waiting* find(Kind kind, std::uint32_t subscription);

  const std::size_t most_events_, most_control_;
  std::deque<Waiting> waiting_;
  std::map<std::uint32_t, std::size_t> events_;  ///< number of waiting events, by subscription
  std::size_t control_ = 0;
  std::uint64_t dropped_ = 0, lost_events_ = 0;
};

}  // namespace perdure::gateway::web
