// Events and their positions.
#include "services/gateway/node.h"

namespace perdure::gateway {
namespace {

constexpr std::size_t kMostEvents = 256;
constexpr std::chrono::seconds kThen{1};  // largest time difference between an event and its pose

}  // namespace

void Node::onEvent(const Event& event) {
  events_.push_back({event, placeOf(event)});
  unplaced_ = unplaced_ || (event.object_id == 0 && !events_.back().place);
  if (events_.size() > kMostEvents) events_.pop_front();
  noteReturns(event);
  if (event.kind == EventKind::kLoopClosed || event.kind == EventKind::kLoopWithdrawn ||
      event.kind == EventKind::kRelocalised) {
    graph_pace_.changed();
  }
  if (wants(kEvents)) sendEvent(events_.back(), false);
  if (wants(kLog)) sendEvent(events_.back(), true);
}

/// Adds the positions of events that arrived before the first pose of their W, for later clients.
void Node::placeEvents() {
  if (!unplaced_) return;
  unplaced_ = false;
  for (Happened& happened : events_) {
    if (happened.event.object_id != 0 || happened.place) continue;
    happened.place = placeOf(happened.event);
    unplaced_ = unplaced_ || (!happened.place && happened.event.stamp.time >= body()->time);
  }
}

/// Returns the position of an event: that of its object or, for an event without object, that of
/// the vehicle at that time.
std::optional<Eigen::Vector3d> Node::placeOf(const Event& event) const {
  const auto now = body();
  if (!now || event.world != now->world) return std::nullopt;
  if (event.object_id == 0) {
    const TimePoint then = event.stamp.time, known = now->time;
    return then < known + kThen && known < then + kThen ? std::optional(now->T_WB.p) : std::nullopt;
  }
  if (!objects_) return std::nullopt;
  for (const ObjectBelief& object : objects_->objects) {
    if (object.id == event.object_id) return Eigen::Vector3d(object.best().mean.head<3>());
  }
  return std::nullopt;
}

void Node::sendEvent(const Happened& happened, bool as_log) {
  const Event& event = happened.event;
  const auto place = happened.place ? happened.place : placeOf(event);
  send(as_log ? kLog : kEvents, as_log ? eventLog(event) : eventJson(event, place),
       event.stamp.time);
}

/// Stores predictions of reappearance. A prediction is valid until the object is detected again or
/// removed.
void Node::noteReturns(const Event& event) {
  if (event.kind == EventKind::kPredictedReturn) {
    returns_[event.object_id] = event;
  } else if (event.kind == EventKind::kReappeared || event.kind == EventKind::kGone ||
             event.kind == EventKind::kMerged || event.kind == EventKind::kArchived) {
    returns_.erase(event.object_id);
  }
}

}  // namespace perdure::gateway
