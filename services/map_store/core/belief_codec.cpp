#include "services/map_store/core/belief_codec.h"

#include <bit>
#include <concepts>
#include <cstring>
#include <string>

namespace perdure::map_store {
namespace {

constexpr std::size_t kMostClasses = 4096;
constexpr std::size_t kMostKinds = 4096;  // of evidence
constexpr std::size_t kLongestName = 4096;

class Writer {
 public:
  template <std::unsigned_integral T>
  void put(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
  }
  void put(std::int64_t value) { put(static_cast<std::uint64_t>(value)); }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(TimePoint value) { put(toNanoseconds(value)); }
  void put(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) put(static_cast<double>(m(r, c)));
    }
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

/// Reads past the end give zero and leave ok() false.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <std::unsigned_integral T>
  T take() {
    if (!has(sizeof(T))) return T{};
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    }
    at_ += sizeof(T);
    return static_cast<T>(value);
  }
  std::int64_t takeSigned() { return static_cast<std::int64_t>(take<std::uint64_t>()); }
  double takeReal() { return std::bit_cast<double>(take<std::uint64_t>()); }
  bool takeFlag() { return take<std::uint8_t>() != 0; }
  TimePoint takeTime() { return fromNanoseconds(takeSigned()); }
  std::string takeText() {
    const std::size_t size = take<std::uint32_t>();
    if (size > kLongestName || !has(size)) {
      ok_ = false;
      return {};
    }
    std::string value(reinterpret_cast<const char*>(bytes_.data() + at_), size);
    at_ += size;
    return value;
  }
  /// Of a list; nothing, and not ok(), where there are more than `most`.
  std::size_t takeCount(std::size_t most) {
    const std::size_t count = take<std::uint32_t>();
    if (count > most) ok_ = false;
    return ok_ ? count : 0;
  }
  template <class Derived>
  void takeInto(Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) m(r, c) = takeReal();
    }
  }
  template <class Enum>
  Enum takeEnum(Enum last) {
    const auto value = take<std::uint8_t>();
    if (value > static_cast<std::uint8_t>(last)) ok_ = false;
    return ok_ ? static_cast<Enum>(value) : Enum{};
  }
  bool ok() const { return ok_; }
  bool finished() const { return ok_ && at_ == bytes_.size(); }

 private:
  bool has(std::size_t size) {
    if (!ok_ || bytes_.size() - at_ < size) ok_ = false;
    return ok_;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

void putClass(Writer& out, const ClassBelief& belief) {
  out.put(belief.name);
  out.put(belief.probability);
  out.put(belief.mean);
  out.put(belief.covariance);
  out.put(belief.cross_pose);
}

ClassBelief takeClass(Reader& in) {
  ClassBelief belief;
  belief.name = in.takeText();
  belief.probability = in.takeReal();
  in.takeInto(belief.mean);
  in.takeInto(belief.covariance);
  in.takeInto(belief.cross_pose);
  return belief;
}

void putNats(Writer& out, const std::vector<double>& nats) {
  out.put(static_cast<std::uint32_t>(nats.size()));
  for (const double each : nats) out.put(each);
}

std::vector<double> takeNats(Reader& in) {
  std::vector<double> nats(in.takeCount(kMostKinds));
  for (double& each : nats) each = in.takeReal();
  return nats;
}

void putLedger(Writer& out, const Ledger& ledger) {
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

Ledger takeLedger(Reader& in) {
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

tl::unexpected<Reason> malformed(const Reader& in, std::uint16_t version) {
  if (!known(version)) {
    return fail("belief_malformed", "format " + std::to_string(version) + " is not known here");
  }
  return fail("belief_malformed", in.ok() ? "bytes are left over" : "bytes are missing or invalid");
}

}  // namespace

Bytes encodeBelief(const ObjectBelief& belief) {
  Writer out;
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
  Reader in(bytes);
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
  Writer out;
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
  return out.take();
}

Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes) {
  Reader in(bytes);
  const auto version = in.take<std::uint16_t>();
  if (!known(version)) return malformed(in, version);
  Objects objects;
  objects.stamp.source = in.take<std::uint64_t>();
  objects.stamp.sequence = in.take<std::uint64_t>();
  objects.stamp.time = in.takeTime();
  objects.stamp.captured_ns = in.takeSigned();
  objects.instance = in.take<std::uint64_t>();
  objects.world.world = in.take<std::uint64_t>();
  objects.world.epoch = in.take<std::uint32_t>();
  in.takeInto(objects.T_WB.q.coeffs());
  in.takeInto(objects.T_WB.p);
  in.takeInto(objects.up_W);
  objects.next_id = in.take<std::uint64_t>();
  if (!in.finished()) return malformed(in, version);
  return objects;
}

}  // namespace perdure::map_store
