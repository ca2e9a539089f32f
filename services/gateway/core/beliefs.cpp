#include "services/gateway/core/beliefs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/types/cuboid.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr double kSampleEvery = 0.5;       // s
constexpr std::size_t kMostSamples = 600;  // five minutes
constexpr std::size_t kMostHistories = 4000;

/// Writes centre, yaw, size and their standard deviations, with the keys of the schema.
void putState(JsonWriter& json, const Vector7d& mean, const Matrix7d& P) {
  const Eigen::Vector3d size = mean.tail<3>().array().exp();
  const Eigen::Vector3d size_sigma = size.array() * P.diagonal().tail<3>().array().max(0.0).sqrt();
  json.key("c");
  putNumbers(json, {mean.data(), 3}, 3);
  json.key("yaw").number(mean[3], 4).key("size");
  putNumbers(json, {size.data(), 3}, 3);
  const std::array<double, 6> cov{P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
  json.key("cov");
  putNumbers(json, cov, 6);
  json.key("yaw_sigma").number(std::sqrt(std::max(0.0, P(3, 3))), 4).key("size_sigma");
  putNumbers(json, {size_sigma.data(), 3}, 3);
}

void putGlance(JsonWriter& json, const ObjectBelief& object) {
  const ClassBelief& best = object.best();
  json.begin('{').key("id").integer(object.id).key("class").text(best.name);
  json.key("p").number(best.probability).key("r").number(object.existence);
  putState(json, best.mean, best.covariance);
  json.key("visibility").text(perdure::nameOf(object.visibility));
  json.key("fraction").number(object.visible_fraction, 3);
  json.key("blocked_by").integer(object.blocked_by);
  json.key("confirmed").boolean(object.confirmed);
  json.key("moving").number(object.moving, 3).key("velocity");
  putNumbers(json, {object.velocity.data(), 3}, 3);
  json.key("hits").integer(object.hits);
  json.key("first_s").number(toSeconds(object.first_seen), 3);
  json.key("last_s").number(toSeconds(object.last_seen), 3);
  json.key("recalled").boolean(object.recalled).end('}');
}

void putGlance(JsonWriter& json, const MapObject& object, bool elsewhere) {
  json.begin('{').key("id").integer(object.id).key("class").text(object.class_name);
  json.key("p").number(object.class_probability).key("r").number(object.existence);
  putState(json, object.mean, object.covariance);
  json.key("visibility").text(perdure::nameOf(object.visibility));
  json.key("confirmed").boolean(true).key("hits").integer(object.hits);
  json.key("memory").text(object.memory == Memory::kWorking ? "working" : "long_term");
  json.key("provisional").boolean(object.provisional).key("elsewhere").boolean(elsewhere);
  json.key("first_s").number(toSeconds(object.first_seen), 3);
  json.key("last_s").number(toSeconds(object.last_seen), 3).end('}');
}

template <class Kind>
std::string kindName(std::size_t i, std::size_t known) {
  return i < known ? perdure::nameOf(static_cast<Kind>(i)) : fmt::format("kind_{}", i);
}

void putNats(JsonWriter& json, const std::vector<double>& nats) {
  json.begin('{');
  for (std::size_t i = 0; i < nats.size(); ++i) {
    if (nats[i] == 0.0) continue;
    json.key(kindName<ClassEvidence>(i, kClassEvidences)).number(nats[i]);
  }
  json.end('}');
}

void putLedger(JsonWriter& json, const Ledger& why) {
  json.key("existence").begin('{');
  for (std::size_t i = 0; i < why.existence.size(); ++i) {
    const LedgerEntry& entry = why.existence[i];
    if (entry.count == 0 && entry.log_odds == 0.0) continue;
    json.key(kindName<ExistenceEvidence>(i, kExistenceEvidences)).begin('{');
    json.key("nats").number(entry.log_odds).key("count").integer(entry.count);
    json.key("first_s").number(toSeconds(entry.first), 3);
    json.key("last_s").number(toSeconds(entry.last), 3).end('}');
  }
  json.end('}').key("ledger").begin('{');
  for (const ClassLedger& one : why.classes) {
    json.textKey(one.name);
    putNats(json, one.log_odds);
  }
  json.end('}');
  if (why.ousted.empty()) return;
  const OustedClass& last = why.ousted.back();
  json.key("ousted").begin('{').key("class").text(last.name).key("by").text(last.by);
  json.key("at_s").number(toSeconds(last.at), 3).key("nats");
  putNats(json, last.log_odds);
  json.end('}');
}

void putClasses(JsonWriter& json, const ObjectBelief& object) {
  json.key("classes").begin('[');
  for (const ClassBelief& belief : object.classes) {
    json.begin('{').key("class").text(belief.name).key("p").number(belief.probability, 6);
    json.key("mean");
    putNumbers(json, {belief.mean.data(), 7});
    json.key("covariance").begin('[');
    for (int row = 0; row < 7; ++row) {
      const Vector7d values = belief.covariance.row(row);
      putNumbers(json, {values.data(), 7}, 8);
    }
    json.end(']').end('}');
  }
  json.end(']');
}

std::string thing(const Event& event) {
  if (event.object_id == 0) return "";
  const std::string name = event.class_name.empty() ? "object" : event.class_name;
  return fmt::format("{} {}", name, event.object_id);
}

/// Describes an event in a sentence.
std::string sentenceOf(const Event& e) {
  const std::string what = thing(e);
  const std::string other = e.other_id == 0 ? "" : fmt::format("{}", e.other_id);
  switch (e.kind) {
    case EventKind::kBorn:
      return what + " is seen for the first time";
    case EventKind::kConfirmed:
      return fmt::format("{} is confirmed ({:.2f})", what, e.probability);
    case EventKind::kClassResolved:
      return fmt::format("object {} is a {} ({:.2f})", e.object_id, e.class_name, e.probability);
    case EventKind::kOccluded:
      return what + " is hidden" + (other.empty() ? "" : " by " + other);
    case EventKind::kLeftView:
      return what + " has left the view";
    case EventKind::kReappeared:
      return what + " is seen again";
    case EventKind::kMerged:
      return fmt::format("{} and {} are one", what, e.other_id);
    case EventKind::kArchived:
      return what + " is kept on the map only";
    case EventKind::kRecalled:
      return what + " is recalled from the map";
    case EventKind::kMissing:
      return what + " is not where it should be";
    case EventKind::kGone:
      return what + " is gone";
    case EventKind::kMoved:
      return what + " has moved";
    case EventKind::kPredictedReturn:
      return fmt::format("{} should be seen again in {:.1f} s ({:.1f} to {:.1f})", what,
                         e.returns_in_s[0], e.returns_in_s[1], e.returns_in_s[2]);
    case EventKind::kModelChanged:
      return "the network was changed";
    case EventKind::kRestored:
      return "the working set was restored";
    case EventKind::kLoopClosed:
      return "the map closed a loop";
    case EventKind::kLoopWithdrawn:
      return "the map took a loop back";
    case EventKind::kRelocalised:
      return "this session is found on the map of before";
  }
  return perdure::nameOf(e.kind);
}

}  // namespace

std::string objectsAtAGlance(const Objects& objects, double latency_ms) {
  JsonWriter json(1024 + 640 * objects.objects.size());
  json.begin('{').key("timestamp");
  putTime(json, objects.stamp.time);
  json.key("frame_id").text(kOdomFrame).key("world").text(toHex(objects.world.world));
  json.key("epoch").integer(objects.world.epoch).key("sequence").integer(objects.stamp.sequence);
  json.key("latency_ms").number(latency_ms, 1);
  const RigidTransform& T = objects.T_WB;
  const std::array<double, 7> body{T.p.x(), T.p.y(), T.p.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()};
  json.key("body");
  putNumbers(json, body, 5);
  json.key("up");
  putNumbers(json, {objects.up_W.data(), 3}, 5);
  json.key("objects").begin('[');
  for (const ObjectBelief& object : objects.objects) putGlance(json, object);
  return json.end(']').end('}').take();
}

std::string eventJson(const Event& e, const std::optional<Eigen::Vector3d>& place) {
  JsonWriter json;
  json.begin('{').key("timestamp");
  putTime(json, e.stamp.time);
  json.key("world").text(toHex(e.world.world)).key("epoch").integer(e.world.epoch);
  json.key("event").text(perdure::nameOf(e.kind)).key("object_id").integer(e.object_id);
  json.key("other_id").integer(e.other_id).key("class").text(e.class_name);
  json.key("probability").number(e.probability).key("detail").text(e.detail);
  json.key("words").text(sentenceOf(e)).key("returns_in_s");
  putNumbers(json, e.returns_in_s, 2);
  if (place) {
    json.key("at");
    putNumbers(json, {place->data(), 3}, 3);
  }
  return json.end('}').take();
}

std::string eventLog(const Event& e) {
  constexpr int kInfo = 2, kWarning = 3;
  const bool warns = e.kind == EventKind::kMissing || e.kind == EventKind::kGone ||
                     e.kind == EventKind::kLoopWithdrawn;
  JsonWriter json;
  json.begin('{').key("timestamp");
  putTime(json, e.stamp.time);
  json.key("level").integer(warns ? kWarning : kInfo);
  json.key("message").text(sentenceOf(e) + (e.detail.empty() ? "" : ": " + e.detail));
  json.key("name").text(perdure::nameOf(e.kind)).key("file").text("").key("line").integer(0);
  return json.end('}').take();
}

std::string detectionsJson(const Detections& detections, const ModelInfo* model) {
  JsonWriter json(512 + 128 * detections.detections.size());
  json.begin('{').key("timestamp");
  putTime(json, detections.stamp.time);
  json.key("camera").text(detections.camera).key("sequence").integer(detections.stamp.sequence);
  json.key("detections").begin('[');
  for (const Detection& one : detections.detections) {
    const std::array<double, 4> box{one.box.x1, one.box.y1, one.box.x2, one.box.y2};
    json.begin('{').key("box");
    putNumbers(json, box, 1);
    const auto& a = one.activations;
    if (a.size() > 1) {
      const auto best =
          static_cast<std::size_t>(std::max_element(a.begin() + 1, a.end()) - a.begin());
      const bool named = model != nullptr && best - 1 < model->classes.size();
      json.key("class").text(named ? model->classes[best - 1] : fmt::format("class {}", best));
      json.key("nats").number(a[best] - a[0], 3);
    }
    json.key("primed").boolean(one.primed).end('}');
  }
  return json.end(']').end('}').take();
}

std::string modelJson(const ModelInfo& model) {
  JsonWriter json;
  json.begin('{').key("name").text(model.name).key("hash").text(toHex(model.hash));
  json.key("classes").begin('[');
  for (const std::string& name : model.classes) json.text(name);
  json.end(']').key("input_width").integer(model.input_width);
  return json.key("input_height").integer(model.input_height).end('}').take();
}

std::string mapReplyJson(const MapReply& reply, const WorldId& map) {
  JsonWriter json(256 + 512 * reply.objects.size());
  json.begin('{').key("truncated").boolean(reply.truncated).key("objects").begin('[');
  for (const MapObject& object : reply.objects) putGlance(json, object, object.world != map);
  return json.end(']').end('}').take();
}

void History::add(const Objects& objects) {
  const double now = toSeconds(objects.stamp.time);
  for (const ObjectBelief& object : objects.objects) {
    auto& samples = samples_[object.id];
    if (!samples.empty() && std::abs(now - samples.back().time_s) < kSampleEvery) continue;
    samples.push_back({now, object.existence, object.best().probability, object.visible_fraction});
    if (samples.size() > kMostSamples) samples.pop_front();
  }
  // Ids increase, so the smallest is the oldest.
  while (samples_.size() > kMostHistories) samples_.erase(samples_.begin());
}

const std::deque<History::Sample>* History::of(ObjectId id) const {
  const auto found = samples_.find(id);
  return found == samples_.end() ? nullptr : &found->second;
}

std::string objectInFull(const ObjectBelief& object, const std::optional<Event>& returns,
                         const std::deque<History::Sample>* history) {
  JsonWriter json(8192);
  json.begin('{').key("found").boolean(true).key("object");
  putGlance(json, object);
  putClasses(json, object);
  putLedger(json, object.why);
  if (returns) {
    json.key("returns").begin('{').key("said_s").number(toSeconds(returns->stamp.time), 3);
    json.key("in_s");
    putNumbers(json, returns->returns_in_s, 2);
    json.end('}');
  }
  json.key("history").begin('[');
  if (history != nullptr) {
    for (const History::Sample& s : *history) {
      const std::array<double, 4> row{s.time_s, s.existence, s.probability, s.fraction};
      putNumbers(json, row, 3);
    }
  }
  return json.end(']').end('}').take();
}

std::string mapJson(const MapLayer::View& view, const std::vector<MapObject>& shown,
                    TimePoint time) {
  JsonWriter json(256 + 512 * shown.size());
  json.begin('{').key("timestamp");
  putTime(json, time);
  json.key("frame_id").text(kMapFrame).key("all").integer(view.here.size());
  json.key("elsewhere").integer(view.elsewhere).key("objects").begin('[');
  for (const MapObject& object : shown) putGlance(json, object, false);
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway
