// What waits to be sent to one client: bounded whatever the client does. Of a channel with
// Delivery::kNewest the newest message replaces the one that waits; of kEach the oldest are lost.
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
  std::uint32_t subscription = 0;  ///< 0 bytes of head where this is the protocol's own message
  bool has_head = false;
  protocol::MessageHead head{};
  std::shared_ptr<const std::string> payload;
  std::size_t bytes() const { return payload->size() + (has_head ? head.size() : 0); }
};

class Outbox {
 public:
  /// At most so many events of one subscription, and so many messages of the protocol itself.
  Outbox(std::size_t most_events, std::size_t most_control)
      : most_events_(most_events), most_control_(most_control) {}

  void put(const Encoded& message, std::uint32_t subscription, Delivery delivery);
  /// False where the client has let too many wait: it does not read.
  bool putControl(std::string message, bool text);
  /// The time of the newest message; replaces one that waits.
  void putTime(std::string message);
  /// What waits for this subscription is not wanted any more.
  void forget(std::uint32_t subscription);

  std::optional<Outgoing> take();
  std::size_t size() const { return waiting_.size(); }
  std::uint64_t dropped() const { return dropped_; }
  /// Events that were lost since it was asked last.
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
  std::map<std::uint32_t, std::size_t> events_;  ///< that wait, by subscription
  std::size_t control_ = 0;
  std::uint64_t dropped_ = 0, lost_events_ = 0;
};

}  // namespace perdure::gateway::web
