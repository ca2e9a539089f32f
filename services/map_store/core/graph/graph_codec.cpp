#include "services/map_store/core/graph/graph_codec.h"

#include <algorithm>
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

constexpr auto gaussianFields = [](auto& io, auto& gaussian) {
  io(gaussian.mean.p, gaussian.mean.yaw, gaussian.covariance);
};

constexpr std::uint16_t kOneScale = 1;      // version of anchors with one scale for place and
                                            // height
constexpr std::uint16_t kAnchorFormat = 2;  // version of anchors with two scales

constexpr auto anchorOfOneScale = [](auto& io, auto& anchor) {
  auto& stamp = anchor.stamp;
  io(anchor.id, anchor.previous, anchor.session.world, anchor.session.epoch, stamp.source,
     stamp.sequence, stamp.time, stamp.captured_ns, anchor.T_WA.q.coeffs(), anchor.T_WA.p);
  gaussianFields(io, anchor.from_previous);
  io(anchor.way_m, anchor.scale.plane);
};

constexpr auto anchorFields = [](auto& io, auto& anchor) {
  anchorOfOneScale(io, anchor);
  io(anchor.scale.height);
};

constexpr auto edgeFields = [](auto& io, auto& edge) {
  io(edge.a, edge.b);
  io.enumeration(edge.kind, mapping::EdgeKind::kTracking);
  gaussianFields(io, edge.T_ab);
};

constexpr auto sightingFields = [](auto& io, auto& sighting) {
  auto& object = sighting.in_anchor;
  io(sighting.anchor, object.id, object.p, object.yaw, object.covariance);
  io.list(object.pmf, kMostShares,
          [](auto& to, auto& share) { to(share.name, share.probability); });
};

constexpr auto recordFields = [](auto& io, auto& record) {
  io(record.session.world, record.session.epoch, record.way_m, record.last_seen, record.pose_error);
  sightingFields(io, record.sighting);
  io.optional(record.earlier, sightingFields);
};

constexpr auto viewFields = [](auto& io, auto& view) {
  io.list(view, mapping::kMostPoints, [](auto& to, auto& point) {
    to(point.p, point.sigma);
    for (auto& byte : point.descriptor) to(byte);
  });
};

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

/// Decodes a value. Checks the version, that all bytes are read, and that the value is sound.
template <class T>
Result<T> decode(const std::string& what, std::span<const std::uint8_t> bytes, auto fields,
                 std::uint16_t format = kGraphFormat) {
  ByteReader in(bytes);
  std::uint16_t version = 0;
  in(version);
  if (version != format) {
    return fail("graph_malformed",
                what + ": format " + std::to_string(version) + " is not known here");
  }
  T value;
  fields(in, value);
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
         std::isfinite(anchor.scale.plane) && anchor.scale.plane > 0.0 &&
         std::isfinite(anchor.scale.height) && anchor.scale.height > 0.0;
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

Bytes encodeAnchor(const Anchor& anchor) { return encode(kAnchorFormat, anchor, anchorFields); }

Result<Anchor> decodeAnchor(std::span<const std::uint8_t> bytes) {
  const bool one_scale = bytes.size() > 1 && bytes[0] == kOneScale && bytes[1] == 0;
  if (!one_scale) return decode<Anchor>("anchor", bytes, anchorFields, kAnchorFormat);
  auto anchor = decode<Anchor>("anchor", bytes, anchorOfOneScale, kOneScale);
  if (anchor) anchor->scale.height = anchor->scale.plane;
  return anchor;
}

Bytes encodeEdge(const Edge& edge) { return encode(kGraphFormat, edge, edgeFields); }

Result<Edge> decodeEdge(std::span<const std::uint8_t> bytes) {
  return decode<Edge>("edge", bytes, edgeFields);
}

Bytes encodeRecord(const ObjectRecord& record) {
  return encode(kGraphFormat, record, recordFields);
}

Result<ObjectRecord> decodeRecord(std::span<const std::uint8_t> bytes) {
  auto record = decode<ObjectRecord>("sighting", bytes, recordFields);
  if (record) record->confirmed = true;
  return record;
}

Bytes encodeView(const mapping::View& view) { return encode(kGraphFormat, view, viewFields); }

Result<mapping::View> decodeView(std::span<const std::uint8_t> bytes) {
  return decode<mapping::View>("view", bytes, viewFields);
}

}  // namespace perdure::map_store
