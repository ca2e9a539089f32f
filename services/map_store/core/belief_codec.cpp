#include "services/map_store/core/belief_codec.h"

#include <string>

namespace perdure::map_store {
namespace {

constexpr std::size_t kMostClasses = 4096;
constexpr std::size_t kMostKinds = 4096;  // largest number of kinds of evidence in a ledger

constexpr auto classFields = [](auto& io, auto& belief) {
  io(belief.name, belief.probability, belief.mean, belief.covariance, belief.cross_pose);
};

constexpr auto number = [](auto& io, auto& value) { io(value); };

constexpr auto ledgerFields = [](auto& io, auto& ledger) {
  io.list(ledger.existence, kMostKinds,
          [](auto& to, auto& entry) { to(entry.log_odds, entry.count, entry.first, entry.last); });
  io.list(ledger.classes, kMostClasses, [](auto& to, auto& each) {
    to(each.name);
    to.list(each.log_odds, kMostKinds, number);
  });
  io.list(ledger.ousted, kMostClasses, [](auto& to, auto& each) {
    to(each.name, each.by, each.at);
    to.list(each.log_odds, kMostKinds, number);
  });
};

constexpr auto beliefFields = [](auto& io, auto& belief, std::uint16_t version = kBeliefFormat) {
  io(belief.id, belief.existence, belief.confirmed);
  io.enumeration(belief.visibility, Visibility::kBehind);
  io(belief.visible_fraction, belief.blocked_by, belief.first_seen, belief.last_seen, belief.as_of,
     belief.hits, belief.visible_misses, belief.moving, belief.velocity);
  io.enumeration(belief.memory, Memory::kLongTerm);
  io(belief.recalled);
  io.list(belief.classes, kMostClasses, classFields);
  if (version >= 2) ledgerFields(io, belief.why);
  if (version >= 4) io(belief.seen_from);
};

constexpr auto headerFields = [](auto& io, auto& objects, std::uint16_t version = kBeliefFormat) {
  auto& stamp = objects.stamp;
  io(stamp.source, stamp.sequence, stamp.time, stamp.captured_ns, objects.instance,
     objects.world.world, objects.world.epoch, objects.T_WB.q.coeffs(), objects.T_WB.p,
     objects.up_W, objects.next_id);
  if (version >= 3) io(objects.pose_error);
};

bool known(std::uint16_t version) { return version >= 1 && version <= kBeliefFormat; }

tl::unexpected<Reason> malformed(const ByteReader& in, std::uint16_t version) {
  if (!known(version)) {
    return fail("belief_malformed", "format " + std::to_string(version) + " is not known here");
  }
  return fail("belief_malformed", in.ok() ? "bytes are left over" : "bytes are missing or invalid");
}

template <class T>
Result<T> decode(std::span<const std::uint8_t> bytes, auto fields) {
  ByteReader in(bytes);
  std::uint16_t version = 0;
  in(version);
  if (!known(version)) return malformed(in, version);
  T value;
  fields(in, value, version);
  if (!in.finished()) return malformed(in, version);
  return value;
}

}  // namespace

Bytes encodeBelief(const ObjectBelief& belief) {
  return encode(kBeliefFormat, belief, beliefFields);
}

Result<ObjectBelief> decodeBelief(std::span<const std::uint8_t> bytes) {
  auto belief = decode<ObjectBelief>(bytes, beliefFields);
  if (belief && belief->classes.empty())
    return fail("belief_malformed", "an object without a class");
  return belief;
}

Bytes encodeHeader(const Objects& objects) { return encode(kBeliefFormat, objects, headerFields); }

Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes) {
  return decode<Objects>(bytes, headerFields);
}

}  // namespace perdure::map_store
