#include "services/map_store/core/belief_codec.h"

#include <string>

namespace perdure::map_store {
namespace {

constexpr std::size_t kMostClasses = 4096;
constexpr std::size_t kMostKinds = 4096;  // largest number of kinds of evidence

void putClass(ByteWriter& out, const ClassBelief& belief) {
  out.put(belief.name);
  out.put(belief.probability);
  out.put(belief.mean);
  out.put(belief.covariance);
  out.put(belief.cross_pose);
}

ClassBelief takeClass(ByteReader& in) {
  ClassBelief belief;
  belief.name = in.takeText();
  belief.probability = in.takeReal();
  in.takeInto(belief.mean);
  in.takeInto(belief.covariance);
  in.takeInto(belief.cross_pose);
  return belief;
}

void putNats(ByteWriter& out, const std::vector<double>& nats) {
  out.put(static_cast<std::uint32_t>(nats.size()));
  for (const double each : nats) out.put(each);
}

std::vector<double> takeNats(ByteReader& in) {
  std::vector<double> nats(in.takeCount(kMostKinds));
  for (double& each : nats) each = in.takeReal();
  return nats;
}

void putLedger(ByteWriter& out, const Ledger& ledger) {
  out.put(static_cast<std::uint32_t>(ledger.existence.size()));
  for (const LedgerEntry& entry : ledger.existence) {
    out.put(entry.log_odds);
    out.put(entry.count);
    out.put(entry.first);
    out.put(entry.last);
  }
  out.put(static_cast<std::uint32_t>(ledger.classes.size()));
  for (const ClassLedger& each : ledger.classes) {
    out.put(each.name);
    putNats(out, each.log_odds);
  }
  out.put(static_cast<std::uint32_t>(ledger.ousted.size()));
  for (const OustedClass& each : ledger.ousted) {
    out.put(each.name);
    out.put(each.by);
    out.put(each.at);
    putNats(out, each.log_odds);
  }
}

Ledger takeLedger(ByteReader& in) {
  Ledger ledger;
  ledger.existence.resize(in.takeCount(kMostKinds));
  for (LedgerEntry& entry : ledger.existence) {
    entry.log_odds = in.takeReal();
    entry.count = in.take<std::uint32_t>();
    entry.first = in.takeTime();
    entry.last = in.takeTime();
  }
  ledger.classes.resize(in.takeCount(kMostClasses));
  for (ClassLedger& each : ledger.classes) {
    each.name = in.takeText();
    each.log_odds = takeNats(in);
  }
  ledger.ousted.resize(in.takeCount(kMostClasses));
  for (OustedClass& each : ledger.ousted) {
    each.name = in.takeText();
    each.by = in.takeText();
    each.at = in.takeTime();
    each.log_odds = takeNats(in);
  }
  return ledger;
}

bool known(std::uint16_t version) { return version >= 1 && version <= kBeliefFormat; }

tl::unexpected<Reason> malformed(const ByteReader& in, std::uint16_t version) {
  if (!known(version)) {
    return fail("belief_malformed", "format " + std::to_string(version) + " is not known here");
  }
  return fail("belief_malformed", in.ok() ? "bytes are left over" : "bytes are missing or invalid");
}

}  // namespace

Bytes encodeBelief(const ObjectBelief& belief) {
  ByteWriter out;
  out.put(kBeliefFormat);
  out.put(belief.id);
  out.put(belief.existence);
  out.put(belief.confirmed);
  out.put(static_cast<std::uint8_t>(belief.visibility));
  out.put(belief.visible_fraction);
  out.put(belief.blocked_by);
  for (const TimePoint t : {belief.first_seen, belief.last_seen, belief.as_of}) out.put(t);
  out.put(belief.hits);
  out.put(belief.visible_misses);
  out.put(belief.moving);
  out.put(belief.velocity);
  out.put(static_cast<std::uint8_t>(belief.memory));
  out.put(belief.recalled);
  out.put(static_cast<std::uint32_t>(belief.classes.size()));
  for (const auto& each : belief.classes) putClass(out, each);
  putLedger(out, belief.why);
  return out.take();
}

Result<ObjectBelief> decodeBelief(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  const auto version = in.take<std::uint16_t>();
  if (!known(version)) return malformed(in, version);
  ObjectBelief belief;
  belief.id = in.take<std::uint64_t>();
  belief.existence = in.takeReal();
  belief.confirmed = in.takeFlag();
  belief.visibility = in.takeEnum(Visibility::kBehind);
  belief.visible_fraction = in.takeReal();
  belief.blocked_by = in.take<std::uint64_t>();
  for (TimePoint* t : {&belief.first_seen, &belief.last_seen, &belief.as_of}) *t = in.takeTime();
  belief.hits = in.take<std::uint32_t>();
  belief.visible_misses = in.take<std::uint32_t>();
  belief.moving = in.takeReal();
  in.takeInto(belief.velocity);
  belief.memory = in.takeEnum(Memory::kLongTerm);
  belief.recalled = in.takeFlag();
  const std::size_t classes = in.takeCount(kMostClasses);
  for (std::size_t i = 0; i < classes && in.ok(); ++i) belief.classes.push_back(takeClass(in));
  if (version >= 2) belief.why = takeLedger(in);
  if (!in.finished()) return malformed(in, version);
  if (belief.classes.empty()) return fail("belief_malformed", "an object without a class");
  return belief;
}

Bytes encodeHeader(const Objects& objects) {
  ByteWriter out;
  out.put(kBeliefFormat);
  out.put(objects.stamp.source);
  out.put(objects.stamp.sequence);
  out.put(objects.stamp.time);
  out.put(objects.stamp.captured_ns);
  out.put(objects.instance);
  out.put(objects.world.world);
  out.put(objects.world.epoch);
  out.put(objects.T_WB.q.coeffs());
  out.put(objects.T_WB.p);
  out.put(objects.up_W);
  out.put(objects.next_id);
  out.put(objects.pose_error);
  return out.take();
}

Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  const auto version = in.take<std::uint16_t>();
  if (!known(version)) return malformed(in, version);
  Objects objects;
  objects.stamp.source = in.take<std::uint64_t>();
  objects.stamp.sequence = in.take<std::uint64_t>();
  objects.stamp.time = in.takeTime();
  objects.stamp.captured_ns = in.takeNanoseconds();
  objects.instance = in.take<std::uint64_t>();
  objects.world.world = in.take<std::uint64_t>();
  objects.world.epoch = in.take<std::uint32_t>();
  in.takeInto(objects.T_WB.q.coeffs());
  in.takeInto(objects.T_WB.p);
  in.takeInto(objects.up_W);
  objects.next_id = in.take<std::uint64_t>();
  if (version >= 3) in.takeInto(objects.pose_error);
  if (!in.finished()) return malformed(in, version);
  return objects;
}

}  // namespace perdure::map_store
