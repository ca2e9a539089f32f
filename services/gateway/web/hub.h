// Manages the subscriptions of all clients, messages for late clients, and service calls.
// Single-threaded.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "services/gateway/core/channels.h"
#include "services/gateway/protocol/client_message.h"
#include "services/gateway/web/outbox.h"

namespace perdure::gateway::web {

/// A client, independent of its transport.
class Viewer {
 public:
  explicit Viewer(std::size_t most_events) : outbox_(most_events, kMostControl) {}
  virtual ~Viewer() = default;
  Outbox& outbox() { return outbox_; }
  std::uint64_t id() const { return id_; }

  /// Called when the outbox has a message to write.
  virtual void flush() = 0;
  /// Closes the client; `why` is the reason as text.
  virtual void cut(const std::string& why) = 0;

 private:
  friend class Hub;
  static constexpr std::size_t kMostControl = 256;
  Outbox outbox_;
  std::uint64_t id_ = 0;
  bool plays_ = true;
  std::map<std::uint32_t, std::uint32_t> channel_of_;  ///< channels by subscription
  std::chrono::steady_clock::time_point second_{};
  int said_ = 0;  ///< messages from the client in that second
};

class Hub {
 public:
  struct Told {
    std::function<void(const Channels&)> wanted;  ///< channels with viewers; called on change
    std::function<void(Call)> call;
    std::function<void(PlaybackRequest)> playback = {};  ///< controls playback; empty for live data
  };
  Hub(std::string name, std::string session, std::size_t most_events, Told told);

  /// Adds a client. `plays`: its subprotocol can control recordings.
  void join(Viewer& viewer, bool plays = true);
  void leave(Viewer& viewer);
  /// Handles a message from a client. A client that sends too many messages a second is
  /// disconnected.
  void hear(Viewer& viewer, std::string_view bytes, bool text,
            std::chrono::steady_clock::time_point now);

  /// Sets the channels and services, once; `channels` must not be empty.
  void offer(std::vector<ChannelInfo> channels, std::vector<ServiceInfo> services,
             std::optional<TimeRange> range = std::nullopt);
  void publish(const Encoded& message);
  void tellTime(TimePoint time);
  void answer(const Answer& answer);
  void tellPlayback(const PlaybackState& state);

  std::size_t clients() const { return viewers_.size(); }
  std::uint64_t published() const { return published_; }
  /// Returns how many messages slow clients have lost, including clients that have left.
  std::uint64_t dropped() const;
  const ReasonCounts& reasons() const { return reasons_; }
  ReasonCounts& reasons() { return reasons_; }

 private:
  struct Kept {
    ChannelInfo info;
    std::deque<Encoded> messages;  ///< for late clients: the last ones of kEach, the newest of
                                   ///< kNewest
    std::size_t subscriptions = 0;
  };
  void handle(Viewer& viewer, const protocol::ClientMessage& message);
  void subscribe(Viewer& viewer, const protocol::Subscription& wanted);
  void unsubscribe(Viewer& viewer, std::uint32_t subscription);
  void release(std::uint32_t channel);
  void callService(Viewer& viewer, const protocol::ServiceCall& call);
  void say(Viewer& viewer, std::string message, bool text = true);
  void complain(Viewer& viewer, const std::string& sentence);
  bool saysTooMuch(Viewer& viewer, std::chrono::steady_clock::time_point now) const;
  void tellWanted();

  const std::string name_, session_;
  const std::size_t most_events_;
  const Told told_;
  std::map<std::uint32_t, Kept> channels_;
  std::vector<ServiceInfo> services_;
  std::optional<TimeRange> range_;
  std::string playback_;           ///< the newest state, for late clients
  std::optional<TimePoint> time_;  ///< the newest time while there are viewers
  std::map<std::uint64_t, Viewer*> viewers_;
  std::uint64_t next_id_ = 1, published_ = 0, dropped_by_gone_ = 0;
  Channels wanted_;
  ReasonCounts reasons_;
};

}  // namespace perdure::gateway::web
