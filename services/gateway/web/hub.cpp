#include "services/gateway/web/hub.h"

#include <algorithm>
#include <utility>

namespace perdure::gateway::web {
namespace {

constexpr int kMostASecond = 200;        // messages from one client
constexpr std::size_t kMostOfOne = 512;  // subscriptions of one client

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // clang 14 does not deduce this itself

}  // namespace

Hub::Hub(std::string name, std::string session, std::size_t most_events, Told told)
    : name_(std::move(name)),
      session_(std::move(session)),
      most_events_(most_events),
      told_(std::move(told)) {}

void Hub::offer(std::vector<ChannelInfo> channels, std::vector<ServiceInfo> services,
                std::optional<TimeRange> range) {
  range_ = range;
  for (ChannelInfo& info : channels) channels_[info.id].info = std::move(info);
  services_ = std::move(services);
}

void Hub::join(Viewer& viewer, bool plays) {
  viewer.id_ = next_id_++;
  viewer.plays_ = plays;
  viewers_[viewer.id_] = &viewer;
  std::vector<ChannelInfo> channels;
  for (const auto& [id, kept] : channels_) channels.push_back(kept.info);
  say(viewer, protocol::serverInfo(name_, session_, plays ? range_ : std::nullopt));
  say(viewer, protocol::advertise(channels));
  say(viewer, protocol::advertiseServices(services_));
  if (!playback_.empty() && plays) say(viewer, playback_, false);
}

void Hub::leave(Viewer& viewer) {
  if (viewers_.erase(viewer.id_) == 0) return;
  dropped_by_gone_ += viewer.outbox_.dropped();
  for (const auto& [subscription, channel] : viewer.channel_of_) release(channel);
  viewer.channel_of_.clear();
  tellWanted();
}

std::uint64_t Hub::dropped() const {
  std::uint64_t dropped = dropped_by_gone_;
  for (const auto& [id, viewer] : viewers_) dropped += viewer->outbox_.dropped();
  return dropped;
}

bool Hub::saysTooMuch(Viewer& viewer, std::chrono::steady_clock::time_point now) const {
  if (now - viewer.second_ >= std::chrono::seconds(1)) {
    viewer.second_ = now;
    viewer.said_ = 0;
  }
  return ++viewer.said_ > kMostASecond;
}

void Hub::hear(Viewer& viewer, std::string_view bytes, bool text,
               std::chrono::steady_clock::time_point now) {
  if (saysTooMuch(viewer, now)) {
    reasons_.add("client_cut_too_many_messages");
    viewer.cut("a client may say " + std::to_string(kMostASecond) + " messages a second");
    return;
  }
  const auto message =
      text ? protocol::parseText(bytes)
           : protocol::parseBinary(
                 {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!message) {
    reasons_.add("client_said_" + message.error().code);
    complain(viewer, message.error().detail);
    return;
  }
  handle(viewer, *message);
}

void Hub::handle(Viewer& viewer, const protocol::ClientMessage& message) {
  using namespace protocol;
  std::visit(
      Overloaded{[&](const Subscribe& m) {
                   for (const Subscription& one : m.subscriptions) subscribe(viewer, one);
                   tellWanted();
                 },
                 [&](const Unsubscribe& m) {
                   for (const std::uint32_t id : m.ids) unsubscribe(viewer, id);
                   tellWanted();
                 },
                 [&](const GetParameters& m) { say(viewer, noParameters(m.id.substr(0, 128))); },
                 [&](const FetchAsset& m) {
                   say(viewer, assetMissing(m.request, "this gateway has no assets"), false);
                 },
                 [&](const ServiceCall& m) { callService(viewer, m); },
                 [&](const PlaybackRequest& m) {
                   if (told_.playback) {
                     told_.playback(m);
                   } else {
                     complain(viewer, "this is live: there is nothing to play back");
                   }
                 },
                 [](const Ignored&) {},
                 [&](const NotOffered& m) {
                   reasons_.add("client_said_not_offered");
                   complain(viewer, m.what +
                                        ": this gateway only shows; its serverInfo has what "
                                        "it is capable of");
                 }},
      message);
}

void Hub::subscribe(Viewer& viewer, const protocol::Subscription& wanted) {
  const auto channel = channels_.find(wanted.channel);
  if (channel == channels_.end()) {
    complain(viewer, "there is no channel " + std::to_string(wanted.channel));
    return;
  }
  if (viewer.channel_of_.size() >= kMostOfOne) {
    reasons_.add("client_said_too_many_subscriptions");
    complain(viewer, "a client may subscribe " + std::to_string(kMostOfOne) + " times");
    return;
  }
  if (!viewer.channel_of_.emplace(wanted.id, wanted.channel).second) {
    complain(viewer, "the subscription " + std::to_string(wanted.id) + " is there already");
    return;
  }
  if (viewer.channel_of_.size() == 1 && time_) viewer.outbox_.putTime(protocol::time(*time_));
  Kept& kept = channel->second;
  ++kept.subscriptions;
  for (const Encoded& message : kept.messages) {
    viewer.outbox_.put(message, wanted.id, kept.info.delivery);
  }
  viewer.flush();
}

void Hub::unsubscribe(Viewer& viewer, std::uint32_t subscription) {
  const auto found = viewer.channel_of_.find(subscription);
  if (found == viewer.channel_of_.end()) {
    complain(viewer, "there is no subscription " + std::to_string(subscription));
    return;
  }
  release(found->second);
  viewer.channel_of_.erase(found);
  viewer.outbox_.forget(subscription);
}

/// Removes a subscription. After the last one, the channel is not computed any more, so its stored
/// messages are cleared.
void Hub::release(std::uint32_t channel) {
  Kept& kept = channels_.at(channel);
  if (--kept.subscriptions == 0) kept.messages.clear();
}

void Hub::tellWanted() {
  Channels now;
  for (const auto& [id, kept] : channels_) {
    if (kept.subscriptions > 0) now.insert(id);
  }
  if (now == wanted_) return;
  wanted_ = std::move(now);
  if (wanted_.empty()) time_.reset();
  told_.wanted(wanted_);
}

void Hub::callService(Viewer& viewer, const protocol::ServiceCall& call) {
  const bool known =
      std::ranges::any_of(services_, [&](const auto& one) { return one.id == call.service; });
  if (!known || call.encoding != "json") {
    const std::string why = known ? "a request is JSON" : "there is no such service";
    say(viewer, protocol::serviceFailure(call.service, call.call, why));
    return;
  }
  told_.call({viewer.id_, call.service, call.call, call.payload});
}

void Hub::answer(const Answer& answer) {
  const auto viewer = viewers_.find(answer.client);
  if (viewer == viewers_.end()) return;  // the client has left in the meantime
  if (answer.ok) {
    say(*viewer->second, protocol::serviceResponse(answer.service, answer.call, answer.payload),
        false);
  } else {
    say(*viewer->second, protocol::serviceFailure(answer.service, answer.call, answer.payload));
  }
}

void Hub::say(Viewer& viewer, std::string message, bool text) {
  if (viewer.outbox_.putControl(std::move(message), text)) {
    viewer.flush();
    return;
  }
  reasons_.add("client_cut_does_not_read");
  viewer.cut("it asks and does not read the answers");
}

void Hub::complain(Viewer& viewer, const std::string& sentence) {
  say(viewer, protocol::status(protocol::StatusLevel::kError, sentence));
}

void Hub::publish(const Encoded& message) {
  const auto channel = channels_.find(message.channel);
  // If the last viewer has left, drops the message, which was made before this was known.
  if (channel == channels_.end() || channel->second.subscriptions == 0) return;
  Kept& kept = channel->second;
  ++published_;
  kept.messages.push_back(
      {message.channel, message.time, message.whole ? message.whole : message.payload});
  const std::size_t most = kept.info.delivery == Delivery::kEach ? most_events_ : 1;
  if (kept.messages.size() > most) kept.messages.pop_front();
  for (const auto& [id, viewer] : viewers_) {
    bool any = false;
    for (const auto& [subscription, its] : viewer->channel_of_) {
      if (its != message.channel) continue;
      viewer->outbox_.put(message, subscription, kept.info.delivery);
      any = true;
    }
    if (any) viewer->flush();
  }
}

void Hub::tellPlayback(const PlaybackState& state) {
  for (const auto& [id, viewer] : viewers_)
    if (viewer->plays_) say(*viewer, protocol::playbackState(state), false);
  PlaybackState later = state;
  later.id.clear();
  later.did_seek = false;
  playback_ = protocol::playbackState(later);
}

void Hub::tellTime(TimePoint time) {
  if (!wanted_.empty()) time_ = time;
  for (const auto& [id, viewer] : viewers_) {
    if (viewer->channel_of_.empty()) continue;
    viewer->outbox_.putTime(protocol::time(time));
    viewer->flush();
  }
}

}  // namespace perdure::gateway::web
