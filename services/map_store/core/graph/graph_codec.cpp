#include "services/map_store/core/graph/graph_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace perdure::map_store {
namespace {

using mapping::Anchor;
using mapping::Edge;
using mapping::LevelGaussian;
using mapping::LevelPose;
using mapping::ObjectRecord;
using mapping::PlacedObject;
using mapping::Sighting;

constexpr std::size_t kMostShares = 4096;

void put(ByteWriter& out, const LevelPose& pose) {
  out.put(pose.p);
  out.put(pose.yaw);
}

void take(ByteReader& in, LevelPose& pose) {
  in.takeInto(pose.p);
  pose.yaw = in.takeReal();
}

void put(ByteWriter& out, const LevelGaussian& gaussian) {
  put(out, gaussian.mean);
  out.put(gaussian.covariance);
}

void take(ByteReader& in, LevelGaussian& gaussian) {
  take(in, gaussian.mean);
  in.takeInto(gaussian.covariance);
}

void put(ByteWriter& out, const WorldId& world) {
  out.put(world.world);
  out.put(world.epoch);
}

void take(ByteReader& in, WorldId& world) {
  world.world = in.take<std::uint64_t>();
  world.epoch = in.take<std::uint32_t>();
}

void put(ByteWriter& out, const FrameStamp& stamp) {
  out.put(stamp.source);
  out.put(stamp.sequence);
  out.put(stamp.time);
  out.put(stamp.captured_ns);
}

void take(ByteReader& in, FrameStamp& stamp) {
  stamp.source = in.take<std::uint64_t>();
  stamp.sequence = in.take<std::uint64_t>();
  stamp.time = in.takeTime();
  stamp.captured_ns = in.takeNanoseconds();
}

void put(ByteWriter& out, const Sighting& sighting) {
  const PlacedObject& object = sighting.in_anchor;
  out.put(sighting.anchor);
  out.put(object.id);
  out.put(object.p);
  out.put(object.yaw);
  out.put(object.covariance);
  out.put(static_cast<std::uint32_t>(object.pmf.size()));
  for (const auto& share : object.pmf) {
    out.put(share.name);
    out.put(share.probability);
  }
}

void take(ByteReader& in, Sighting& sighting) {
  PlacedObject& object = sighting.in_anchor;
  sighting.anchor = in.take<std::uint64_t>();
  object.id = in.take<std::uint64_t>();
  in.takeInto(object.p);
  object.yaw = in.takeReal();
  in.takeInto(object.covariance);
  object.pmf.resize(in.takeCount(kMostShares));
  for (auto& share : object.pmf) {
    share.name = in.take<std::uint32_t>();
    share.probability = in.takeReal();
  }
}

void put(ByteWriter& out, const ObjectRecord& record) {
  put(out, record.session);
  out.put(record.way_m);
  out.put(record.last_seen);
  out.put(record.pose_error);
  put(out, record.sighting);
  out.put(record.earlier.has_value());
  if (record.earlier) put(out, *record.earlier);
}

void take(ByteReader& in, ObjectRecord& record) {
  take(in, record.session);
  record.way_m = in.takeReal();
  record.last_seen = in.takeTime();
  in.takeInto(record.pose_error);
  take(in, record.sighting);
  if (in.takeFlag()) take(in, record.earlier.emplace());
}

bool isSoundGaussian(const LevelGaussian& gaussian) {
  return isSound(gaussian.mean) && gaussian.covariance.allFinite();
}

bool isSoundSighting(const Sighting& sighting) {
  const PlacedObject& object = sighting.in_anchor;
  return sighting.anchor != 0 && object.p.allFinite() && std::isfinite(object.yaw) &&
         object.covariance.allFinite() && object.pmf.size() <= kMostShares &&
         std::all_of(object.pmf.begin(), object.pmf.end(),
                     [](const auto& share) { return std::isfinite(share.probability); });
}

tl::unexpected<Reason> malformed(const std::string& what, const ByteReader& in) {
  return fail("graph_malformed", what + (in.finished() ? ": not sound numbers or ids"
                                         : in.ok()     ? ": bytes are left over"
                                                       : ": bytes are missing or invalid"));
}

/// Checks the version first, then that all bytes are read and the value is sound.
template <class T, class TakeAll>
Result<T> decode(const std::string& what, std::span<const std::uint8_t> bytes, TakeAll takeAll) {
  ByteReader in(bytes);
  const auto version = in.take<std::uint16_t>();
  if (version != kGraphFormat) {
    return fail("graph_malformed",
                what + ": format " + std::to_string(version) + " is not known here");
  }
  T value;
  takeAll(in, value);
  if (!in.finished() || !isSound(value)) return malformed(what, in);
  return value;
}

}  // namespace

bool isSound(const LevelPose& pose) { return pose.p.allFinite() && std::isfinite(pose.yaw); }

bool isSound(const Anchor& anchor) {
  constexpr double kRounding = 1e-6;
  return anchor.id != 0 && anchor.previous < anchor.id && anchor.T_WA.finite() &&
         std::abs(anchor.T_WA.q.norm() - 1.0) < kRounding &&
         isSoundGaussian(anchor.from_previous) && std::isfinite(anchor.way_m) &&
         std::isfinite(anchor.scale2) && anchor.scale2 > 0.0;
}

bool isSound(const Edge& edge) {
  return edge.a != 0 && edge.b != 0 && edge.a != edge.b && isSoundGaussian(edge.T_ab);
}

bool isSound(const ObjectRecord& record) {
  return std::isfinite(record.way_m) && record.pose_error.allFinite() &&
         isSoundSighting(record.sighting) && (!record.earlier || isSoundSighting(*record.earlier));
}

bool isSound(const mapping::View& view) {
  return !view.empty() && view.size() <= mapping::kMostPoints &&
         std::all_of(view.begin(), view.end(), [](const mapping::SeenPoint& point) {
           return point.p.allFinite() && std::isfinite(point.sigma) && point.sigma >= 0.0F;
         });
}

Bytes encodeAnchor(const Anchor& anchor) {
  ByteWriter out;
  out.put(kGraphFormat);
  out.put(anchor.id);
  out.put(anchor.previous);
  put(out, anchor.session);
  put(out, anchor.stamp);
  out.put(anchor.T_WA.q.coeffs());
  out.put(anchor.T_WA.p);
  put(out, anchor.from_previous);
  out.put(anchor.way_m);
  out.put(anchor.scale2);
  return out.take();
}

Result<Anchor> decodeAnchor(std::span<const std::uint8_t> bytes) {
  return decode<Anchor>("anchor", bytes, [](ByteReader& in, Anchor& anchor) {
    anchor.id = in.take<std::uint64_t>();
    anchor.previous = in.take<std::uint64_t>();
    take(in, anchor.session);
    take(in, anchor.stamp);
    in.takeInto(anchor.T_WA.q.coeffs());
    in.takeInto(anchor.T_WA.p);
    take(in, anchor.from_previous);
    anchor.way_m = in.takeReal();
    anchor.scale2 = in.takeReal();
  });
}

Bytes encodeEdge(const Edge& edge) {
  ByteWriter out;
  out.put(kGraphFormat);
  out.put(edge.a);
  out.put(edge.b);
  out.put(static_cast<std::uint8_t>(edge.kind));
  put(out, edge.T_ab);
  return out.take();
}

Result<Edge> decodeEdge(std::span<const std::uint8_t> bytes) {
  return decode<Edge>("edge", bytes, [](ByteReader& in, Edge& edge) {
    edge.a = in.take<std::uint64_t>();
    edge.b = in.take<std::uint64_t>();
    edge.kind = in.takeEnum(mapping::EdgeKind::kTracking);
    take(in, edge.T_ab);
  });
}

Bytes encodeRecord(const ObjectRecord& record) {
  ByteWriter out;
  out.put(kGraphFormat);
  put(out, record);
  return out.take();
}

Result<ObjectRecord> decodeRecord(std::span<const std::uint8_t> bytes) {
  return decode<ObjectRecord>("sighting", bytes, [](ByteReader& in, ObjectRecord& record) {
    take(in, record);
    record.confirmed = true;
  });
}

Bytes encodeView(const mapping::View& view) {
  ByteWriter out;
  out.put(kGraphFormat);
  out.put(static_cast<std::uint32_t>(view.size()));
  for (const mapping::SeenPoint& point : view) {
    for (int i = 0; i < 3; ++i) out.put(std::bit_cast<std::uint32_t>(point.p[i]));
    out.put(std::bit_cast<std::uint32_t>(point.sigma));
    for (const std::uint8_t byte : point.descriptor) out.put(byte);
  }
  return out.take();
}

Result<mapping::View> decodeView(std::span<const std::uint8_t> bytes) {
  return decode<mapping::View>("view", bytes, [](ByteReader& in, mapping::View& view) {
    view.resize(in.takeCount(mapping::kMostPoints));
    for (mapping::SeenPoint& point : view) {
      for (int i = 0; i < 3; ++i) point.p[i] = std::bit_cast<float>(in.take<std::uint32_t>());
      point.sigma = std::bit_cast<float>(in.take<std::uint32_t>());
      for (std::uint8_t& byte : point.descriptor) byte = in.take<std::uint8_t>();
    }
  });
}

}  // namespace perdure::map_store
