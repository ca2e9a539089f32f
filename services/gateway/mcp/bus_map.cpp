#include "services/gateway/mcp/bus_map.h"

#include <chrono>

namespace perdure::gateway::mcp {
namespace {

constexpr double kPatience_s = 3.0;
constexpr std::size_t kMostEnded = 4096;

MapReply answered(Result<MapReply> reply) {
  if (!reply) {
    throw NoAnswer(reply.error().code == "no_answer"
                       ? "map_store does not answer; see perdure doctor"
                       : "There is no map_store on this bus; start perdure-map-store.");
  }
  if (!reply->ok) throw NoAnswer(reply->error);
  return *std::move(reply);
}

}  // namespace

BusMap::BusMap(const bus::Participant& participant, bool takes_corrections)
    : participant_(participant),
      takes_corrections_(takes_corrections),
      client_(participant),
      events_(participant, bus::kTopic<Event>),
      calibrations_(participant, bus::kTopic<Calibration>) {}

void BusMap::onEvent(const Event& event) {
  if (!first_event_) first_event_ = event.stamp.time;
  last_event_ = event.stamp.time;
  const bool merged = event.kind == EventKind::kMerged;
  if (!merged && event.kind != EventKind::kGone && event.kind != EventKind::kMoved) return;
  Ended ended{event.kind, event.stamp.time, merged ? event.object_id : 0, {}};
  ended.last.id = merged ? event.other_id : event.object_id;
  ended.last.existence = merged ? 0.0 : event.probability;
  ended_.push_back(std::move(ended));
  if (ended_.size() > kMostEnded) {
    ended_.pop_front();
    first_event_ = ended_.front().time;
  }
}

void BusMap::follow() {
  events_.drain([this](const Event& event) { onEvent(event); });
  calibrations_.drain([this](const Calibration& calibration) { calibration_ = calibration; });
}

std::optional<Objects> BusMap::newestObjects() const {
  using Clock = std::chrono::steady_clock;
  bus::Reader<Objects> reader(participant_, bus::kTopic<Objects>, bus::ReadFrom::kKept);
  bus::WaitLoop loop(participant_);
  std::optional<Objects> newest;
  loop.on(reader, [&](const Objects& objects) { newest = objects; });
  const auto end = Clock::now() + std::chrono::milliseconds(500);
  while (!newest && Clock::now() < end) loop.runOnce(std::chrono::milliseconds(20));
  return newest;
}

State BusMap::begin() {
  follow();
  const auto objects = newestObjects();
  State state;
  state.now = objects ? objects->stamp.time : last_event_.value_or(TimePoint());
  if (objects && calibration_) {
    state.cameras = mapping::sightsOf(*calibration_, objects->T_WB, objects->up_W);
  }
  state.ended.assign(ended_.begin(), ended_.end());
  state.ended_from = first_event_.value_or(state.now);
  return state;
}

MapReply BusMap::ask(const MapQuery& query) { return answered(client_.ask(query, kPatience_s)); }

Correction BusMap::correct(const Correction& correction) {
  const MapReply reply = answered(client_.correct(correction, kPatience_s));
  if (reply.corrections.empty()) throw NoAnswer("map_store's reply lacks the correction");
  return reply.corrections.front();
}

}  // namespace perdure::gateway::mcp
