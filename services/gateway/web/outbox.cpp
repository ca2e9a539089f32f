#include "services/gateway/web/outbox.h"

#include <algorithm>
#include <utility>

namespace perdure::gateway::web {

Outbox::Waiting* Outbox::find(Kind kind, std::uint32_t subscription) {
  const auto found = std::ranges::find_if(waiting_, [&](const Waiting& one) {
    return one.kind == kind && one.message.subscription == subscription;
  });
  return found == waiting_.end() ? nullptr : &*found;
}

void Outbox::put(const Encoded& message, std::uint32_t subscription, Delivery delivery) {
  Outgoing outgoing{.text = false,
                    .subscription = subscription,
                    .has_head = true,
                    .head = protocol::messageHead(subscription, message.time),
                    .payload = message.payload};
  if (delivery != Delivery::kEach) {
    if (Waiting* old = find(Kind::kNewest, subscription)) {
      if (message.whole) outgoing.payload = message.whole;
      old->message = std::move(outgoing);
      ++dropped_;
      return;
    }
    waiting_.push_back({Kind::kNewest, std::move(outgoing)});
    return;
  }
  std::size_t& waiting = events_[subscription];
  if (waiting >= most_events_) {
    const auto oldest = std::ranges::find_if(waiting_, [&](const Waiting& one) {
      return one.kind == Kind::kEvent && one.message.subscription == subscription;
    });
    waiting_.erase(oldest);
    --waiting;
    ++dropped_;
    ++lost_events_;
  }
  ++waiting;
  waiting_.push_back({Kind::kEvent, std::move(outgoing)});
}

bool Outbox::putControl(std::string message, bool text) {
  if (control_ >= most_control_) return false;
  ++control_;
  waiting_.push_back(
      {Kind::kControl,
       {.text = text, .payload = std::make_shared<const std::string>(std::move(message))}});
  return true;
}

void Outbox::putTime(std::string message) {
  auto payload = std::make_shared<const std::string>(std::move(message));
  if (Waiting* old = find(Kind::kTime, 0)) {
    old->message.payload = std::move(payload);
    return;
  }
  waiting_.push_back({Kind::kTime, {.payload = std::move(payload)}});
}

void Outbox::forget(std::uint32_t subscription) {
  std::erase_if(waiting_, [&](const Waiting& one) {
    return one.message.has_head && one.message.subscription == subscription;
  });
  events_.erase(subscription);
}

std::optional<Outgoing> Outbox::take() {
  if (waiting_.empty()) return std::nullopt;
  Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  if (next.kind == Kind::kControl) --control_;
  if (next.kind == Kind::kEvent) --events_[next.message.subscription];
  return std::move(next.message);
}

std::uint64_t Outbox::takeLostEvents() { return std::exchange(lost_events_, 0); }

}  // namespace perdure::gateway::web
