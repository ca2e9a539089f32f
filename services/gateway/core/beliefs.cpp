#include "services/gateway/core/beliefs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/types/cuboid.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr double kSampleEvery = 0.5;       // s
constexpr std::size_t kMostSamples = 600;  // per object: five minutes
constexpr std::size_t kMostHistories = 4000;

/// Writes centre, yaw, size and their standard deviations, with the keys of the schema.
void putState(JsonWriter& json, const Vector7d& mean, const Matrix7d& P) {
  const Eigen::Vector3d size = mean.tail<3>().array().exp();
  const Eigen::Vector3d size_sigma = size.array() * P.diagonal().tail<3>().array().max(0.0).sqrt();
  json.with("c", {mean.data(), 3}, 3).with("yaw", mean[3], 4).with("size", {size.data(), 3}, 3);
  const std::array<double, 6> cov{P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
  json.with("cov", cov, 6).with("yaw_sigma", std::sqrt(std::max(0.0, P(3, 3))), 4);
  json.with("size_sigma", {size_sigma.data(), 3}, 3);
}

void putGlance(JsonWriter& json, const ObjectBelief& object) {
  const ClassBelief& best = object.best();
  json.begin('{').with("id", object.id).with("class", best.name).with("p", best.probability);
  json.with("r", object.existence);
  putState(json, best.mean, best.covariance);
  json.with("visibility", perdure::nameOf(object.visibility));
  json.with("fraction", object.visible_fraction, 3).with("blocked_by", object.blocked_by);
  json.with("confirmed", object.confirmed).with("moving", object.moving, 3);
  json.with("velocity", {object.velocity.data(), 3}, 3).with("hits", object.hits);
  json.with("first_s", toSeconds(object.first_seen), 3);
  json.with("last_s", toSeconds(object.last_seen), 3).with("recalled", object.recalled).end('}');
}

void putGlance(JsonWriter& json, const MapObject& object, bool elsewhere) {
  json.begin('{').with("id", object.id).with("class", object.class_name);
  json.with("p", object.class_probability).with("r", object.existence);
  putState(json, object.mean, object.covariance);
  json.with("visibility", perdure::nameOf(object.visibility)).with("confirmed", true);
  json.with("hits", object.hits);
  json.with("memory", object.memory == Memory::kWorking ? "working" : "long_term");
  json.with("provisional", object.provisional).with("elsewhere", elsewhere);
  json.with("first_s", toSeconds(object.first_seen), 3);
  json.with("last_s", toSeconds(object.last_seen), 3).end('}');
}

void putCorrection(JsonWriter& json, const Correction& each) {
  json.begin('{').with("id", each.id).with("kind", perdure::nameOf(each.kind));
  json.with("object", each.object).with("other", each.other).with("class", each.class_name);
  json.with("nats", each.nats).with("author", each.author);
  json.with("time_s", toSeconds(each.time), 3).end('}');
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
    json.with("nats", entry.log_odds).with("count", entry.count);
    json.with("first_s", toSeconds(entry.first), 3).with("last_s", toSeconds(entry.last), 3);
    json.end('}');
  }
  json.end('}').key("ledger").begin('{');
  for (const ClassLedger& one : why.classes) {
    json.textKey(one.name);
    putNats(json, one.log_odds);
  }
  json.end('}');
  if (why.ousted.empty()) return;
  const OustedClass& last = why.ousted.back();
  json.key("ousted").begin('{').with("class", last.name).with("by", last.by);
  json.with("at_s", toSeconds(last.at), 3).key("nats");
  putNats(json, last.log_odds);
  json.end('}');
}

void putClasses(JsonWriter& json, const ObjectBelief& object) {
  json.key("classes").begin('[');
  for (const ClassBelief& belief : object.classes) {
    json.begin('{').with("class", belief.name).with("p", belief.probability, 6);
    json.with("mean", {belief.mean.data(), 7}).key("covariance").begin('[');
    for (int row = 0; row < 7; ++row) {
      const Vector7d values = belief.covariance.row(row);
      json.list({values.data(), 7}, 8);
    }
    json.end(']').end('}');
  }
  json.end(']');
}

/// Sentences about events. sentenceOf() replaces the names in braces.
constexpr std::pair<EventKind, const char*> kSentences[] = {
    {EventKind::kBorn, "{what} is seen for the first time"},
    {EventKind::kConfirmed, "{what} is confirmed ({p:.2f})"},
    {EventKind::kClassResolved, "object {id} is a {class} ({p:.2f})"},
    {EventKind::kOccluded, "{what} is hidden{by}"},
    {EventKind::kLeftView, "{what} has left the view"},
    {EventKind::kReappeared, "{what} is seen again"},
    {EventKind::kMerged, "{what} and {other} are one"},
    {EventKind::kArchived, "{what} is kept on the map only"},
    {EventKind::kRecalled, "{what} is recalled from the map"},
    {EventKind::kMissing, "{what} is not where it should be"},
    {EventKind::kGone, "{what} is gone"},
    {EventKind::kMoved, "{what} has moved"},
    {EventKind::kPredictedReturn,
     "{what} should be seen again in {in:.1f} s ({low:.1f} to {high:.1f})"},
    {EventKind::kModelChanged, "the network was changed"},
    {EventKind::kRestored, "the working set was restored"},
    {EventKind::kLoopClosed, "the map closed a loop"},
    {EventKind::kLoopWithdrawn, "the map took a loop back"},
    {EventKind::kRelocalised, "this session is found on the map of before"}};

std::string sentenceOf(const Event& e) {
  const std::string name = e.class_name.empty() ? "object" : e.class_name;
  const std::string what = e.object_id == 0 ? "" : fmt::format("{} {}", name, e.object_id);
  const std::string by = e.other_id == 0 ? "" : fmt::format(" by {}", e.other_id);
  for (const auto& [kind, sentence] : kSentences) {
    if (kind != e.kind) continue;
    return fmt::format(fmt::runtime(sentence), fmt::arg("what", what), fmt::arg("by", by),
                       fmt::arg("id", e.object_id), fmt::arg("class", e.class_name),
                       fmt::arg("p", e.probability), fmt::arg("other", e.other_id),
                       fmt::arg("in", e.returns_in_s[0]), fmt::arg("low", e.returns_in_s[1]),
                       fmt::arg("high", e.returns_in_s[2]));
  }
  return perdure::nameOf(e.kind);
}

}  // namespace

std::string objectsAtAGlance(const Objects& objects, double latency_ms, double body_sigma) {
  JsonWriter json(1024 + 640 * objects.objects.size());
  json.begin('{').with("timestamp", objects.stamp.time).with("frame_id", kOdomFrame);
  json.with("world", toHex(objects.world.world)).with("epoch", objects.world.epoch);
  json.with("sequence", objects.stamp.sequence).with("latency_ms", latency_ms, 1);
  const RigidTransform& T = objects.T_WB;
  const std::array<double, 7> body{T.p.x(), T.p.y(), T.p.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()};
  json.with("body", body, 5).with("body_sigma", body_sigma, 4);
  json.with("up", {objects.up_W.data(), 3}, 5).key("objects").begin('[');
  for (const ObjectBelief& object : objects.objects) putGlance(json, object);
  return json.end(']').end('}').take();
}

std::string eventJson(const Event& e, const std::optional<Eigen::Vector3d>& place) {
  JsonWriter json;
  json.begin('{').with("timestamp", e.stamp.time).with("world", toHex(e.world.world));
  json.with("epoch", e.world.epoch).with("event", perdure::nameOf(e.kind));
  json.with("object_id", e.object_id).with("other_id", e.other_id).with("class", e.class_name);
  json.with("probability", e.probability).with("detail", e.detail).with("words", sentenceOf(e));
  json.with("returns_in_s", e.returns_in_s, 2);
  if (place) {
    json.with("at", {place->data(), 3}, 3);
  }
  return json.end('}').take();
}

std::string eventLog(const Event& e) {
  constexpr int kInfo = 2, kWarning = 3;
  const bool warns = e.kind == EventKind::kMissing || e.kind == EventKind::kGone ||
                     e.kind == EventKind::kLoopWithdrawn;
  JsonWriter json;
  json.begin('{').with("timestamp", e.stamp.time).with("level", warns ? kWarning : kInfo);
  json.with("message", sentenceOf(e) + (e.detail.empty() ? "" : ": " + e.detail));
  json.with("name", perdure::nameOf(e.kind)).with("file", "").with("line", 0);
  return json.end('}').take();
}

std::string detectionsJson(const Detections& detections, const ModelInfo* model) {
  JsonWriter json(512 + 128 * detections.detections.size());
  json.begin('{').with("timestamp", detections.stamp.time).with("camera", detections.camera);
  json.with("sequence", detections.stamp.sequence).key("detections").begin('[');
  for (const Detection& one : detections.detections) {
    const std::array<double, 4> box{one.box.x1, one.box.y1, one.box.x2, one.box.y2};
    json.begin('{').with("box", box, 1);
    const auto& a = one.activations;
    if (a.size() > 1) {
      const auto best =
          static_cast<std::size_t>(std::max_element(a.begin() + 1, a.end()) - a.begin());
      const bool named = model != nullptr && best - 1 < model->classes.size();
      json.with("class", named ? model->classes[best - 1] : fmt::format("class {}", best));
      json.with("nats", a[best] - a[0], 3);
    }
    json.with("primed", one.primed).end('}');
  }
  return json.end(']').end('}').take();
}

std::string modelJson(const ModelInfo& model) {
  JsonWriter json;
  json.begin('{').with("name", model.name).with("hash", toHex(model.hash)).key("classes");
  json.begin('[');
  for (const std::string& name : model.classes) json.text(name);
  json.end(']').with("input_width", model.input_width).with("input_height", model.input_height);
  return json.end('}').take();
}

std::string mapReplyJson(const MapReply& reply, const WorldId& map) {
  JsonWriter json(256 + 512 * reply.objects.size());
  json.begin('{').with("truncated", reply.truncated).key("objects").begin('[');
  for (const MapObject& object : reply.objects) putGlance(json, object, object.world != map);
  json.end(']').key("corrections").begin('[');
  for (const Correction& each : reply.corrections) putCorrection(json, each);
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
  // Ids increase, so the history with the smallest id is the oldest.
  while (samples_.size() > kMostHistories) samples_.erase(samples_.begin());
}

const std::deque<History::Sample>* History::of(ObjectId id) const {
  const auto found = samples_.find(id);
  return found == samples_.end() ? nullptr : &found->second;
}

std::string objectInFull(const ObjectBelief& object, const std::optional<Event>& returns,
                         const std::deque<History::Sample>* history) {
  JsonWriter json(8192);
  json.begin('{').with("found", true).key("object");
  putGlance(json, object);
  putClasses(json, object);
  putLedger(json, object.why);
  if (returns) {
    json.key("returns").begin('{').with("said_s", toSeconds(returns->stamp.time), 3);
    json.with("in_s", returns->returns_in_s, 2).end('}');
  }
  json.key("history").begin('[');
  if (history != nullptr) {
    for (const History::Sample& s : *history) {
      const std::array<double, 4> row{s.time_s, s.existence, s.probability, s.fraction};
      json.list(row, 3);
    }
  }
  return json.end(']').end('}').take();
}

std::string mapJson(const MapLayer::View& view, const std::vector<MapObject>& shown,
                    TimePoint time) {
  JsonWriter json(256 + 512 * shown.size());
  json.begin('{').with("timestamp", time).with("frame_id", kMapFrame).with("all", view.here.size());
  json.with("elsewhere", view.elsewhere).key("objects").begin('[');
  for (const MapObject& object : shown) putGlance(json, object, false);
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway
