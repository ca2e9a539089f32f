// The durable map on the wire: tiles, queries and replies.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/types/corrections.h"
#include "common/types/description.h"
#include "common/types/objects.h"

namespace perdure {

/// An object as the map shows it.
struct MapObject {
  ObjectId id = 0;
  WorldId world;  ///< M, or the W that the query names
  std::string class_name;
  double existence = 0.0, class_probability = 0.0;
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  TimePoint first_seen, last_seen;
  std::uint32_t hits = 0;
  Visibility visibility = Visibility::kOutOfView;
  Memory memory = Memory::kWorking;
  /// True if the session is not yet located on the earlier map. This may then be a second row of a
  /// known object.
  bool provisional = false;
};

inline constexpr std::size_t kMapTileCapacity = 128;

/// Objects of one square of the map; `part` counts tiles of the same square.
struct MapTile {
  InstanceId instance = 0;
  std::int32_t x = 0, y = 0, part = 0;  ///< key; indices of squares of header.tile_size_m
  std::uint64_t revision = 0;
  std::vector<MapObject> objects;  ///< at most kMapTileCapacity
};

struct MapHeader {
  InstanceId instance = 0;
  std::uint64_t revision = 0;
  double tile_size_m = 0.0;
  std::uint32_t tiles = 0, objects = 0;
};

/// T_MW, the pose of W (the odometry's frame of reference) in M (the frame of the whole map). It
/// compensates the drift near the body. W never jumps; T_MW jumps at loop closures.
struct MapFrame {
  FrameStamp stamp;  ///< stamp of the frame to which T_MW applies
  InstanceId instance = 0;
  WorldId world;  ///< W
  WorldId map;    ///< M; initially the W of the oldest session that is connected with this one
  RigidTransform T_MW;
  /// Covariance of the body's position and yaw in M, [δp, δyaw], m and rad. If all are 0, see
  /// hasCovariance().
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  std::uint64_t revision = 0;  ///< counts changes of the graph
  std::uint32_t sessions = 0;  ///< number of sessions connected with this one, itself included
  std::uint32_t loops = 0;     ///< number of accepted loop closures of all sessions
  std::uint32_t anchors = 0;   ///< number of anchors of all sessions
};

enum class MapQueryKind : std::uint8_t {
  kById = 0,
  kByClass,
  kByRadius,
  kByBox,
  kAll,
  kRestore,    ///< sent when a filter starts; requests the newest working set of another filter, on
               ///< `map/near`
  kGraph = 7,  ///< anchors within `radius` (0: all), nearest to `low` first, and the loop closures
               ///< between them
};

struct MapQuery {
  InstanceId client = 0;
  std::uint64_t request = 0;  ///< client and request form the correlation id
  MapQueryKind kind = MapQueryKind::kAll;
  ObjectId object_id = 0;
  std::string class_name;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< box corner, or centre of the sphere
  Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< box corner
  double radius = 0.0;
  WorldId world;  ///< the W of the query; 0: M
  std::uint32_t limit = 1000;
};

using AnchorNumber = std::uint64_t;  ///< 0: none
/// An anchor of the map's graph: a place on the trajectory to which objects belong.
struct MapAnchor {
  AnchorNumber id = 0;
  AnchorNumber previous = 0;                    ///< the previous anchor of the same session; 0:
                                                ///< none
  WorldId session;                              ///< the W of its session
  WorldId map;                                  ///< M
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< position in M
  double yaw = 0.0;                             ///< rad
  /// Standard deviations of [p, yaw] relative to the first anchor of M, m and rad. If all are 0,
  /// they are not known, unless this is the first anchor (map_graph.h).
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();
  std::uint32_t objects = 0;  ///< number of objects last detected from here
};

enum class MapLoopKind : std::uint8_t {
  kLoop = 0,  ///< the body passed this place before
  kTie,       ///< relative pose from tracks that were detected on both visits
};
enum class MapLoopState : std::uint8_t {
  kTentative = 0,  ///< not accepted by the graph, or not yet
  kConfirmed,
  kWithdrawn,  ///< once accepted, but contradicted by later ones; not a part of the graph any more
};

/// Two objects that a loop closure identified: one of the map, and one detected at that time.
struct MapLoopPair {
  ObjectId known = 0, seen = 0;
};

/// A measured relative pose of anchors a and b, from a place that was visited again.
struct MapLoop {
  std::uint64_t id = 0;
  AnchorNumber a = 0, b = 0;  ///< b: the anchor of the body
  MapLoopKind kind = MapLoopKind::kLoop;
  MapLoopState state = MapLoopState::kTentative;
  /// Measured [p, yaw] of b minus its value in the graph, in axes of a; m and rad.
  Eigen::Vector4d residual = Eigen::Vector4d::Zero();
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();  ///< standard deviations of the measurement; all
                                                    ///< 0: not known
  double chi2 = 0.0;                                ///< χ² of the residual
  double weight = 0.0;                              ///< weight in the graph, [0, 1]
  std::vector<MapLoopPair> pairs;                   ///< empty: not known, or none
  std::uint32_t landmarks = 0;                      ///< number of matched landmarks; 0: not known,
                                                    ///< or none
};

struct MapReply {
  InstanceId client = 0;
  std::uint64_t request = 0;
  InstanceId instance = 0;
  bool ok = true;
  std::string error;       ///< a sentence with the fix if !ok
  bool truncated = false;  ///< more objects or anchors matched than `limit`
  std::vector<MapObject> objects;
  std::vector<ObjectBelief> beliefs;  ///< the objects in full, for a query by id
  std::vector<MapAnchor> anchors;  ///< for kGraph: anchors in the newest session's M, sorted by id
  std::vector<MapLoop> loops;      ///< for kGraph: loop closures between `anchors`, sorted by id
  /// Total numbers in this M, including those not in this reply; 0: not known.
  std::uint32_t anchor_count = 0, loop_count = 0;
  /// Standing corrections: of the object for kById, all for kAll.
  std::vector<Correction> corrections;
};

/// A track that belongs to an object with another id.
struct Member {
  TrackId track = 0;
  ObjectId object = 0;
  bool operator==(const Member&) const = default;
};

/// The objects of the map near the body, for one filter. The message is complete: a later one
/// replaces it.
struct MapNear {
  FrameStamp stamp;  ///< stamp of the newest working set in use
  InstanceId instance = 0;
  InstanceId client = 0;       ///< the filter that owns the working set or sent kRestore
  WorldId world;               ///< W
  std::uint64_t revision = 0;  ///< grows by one with each message of an instance
  /// The map has stored all messages of the client up to this time on disk; 0: none.
  TimePoint kept;
  ObjectId next_id = 1;         ///< smaller ids are in use
  bool corrects_drift = false;  ///< the map's graph receives this odometry
  bool more = false;            ///< there are more objects near the body than listed
  /// Tracks of the working set and of the lists below whose object has another id. A track that is
  /// not listed has its own id.
  std::vector<Member> members;
  /// Objects that are not in the working set, and objects in it whose position has changed since
  /// their last detection. Covariances are relative to the body, cross_pose is zero.
  std::vector<ObjectBelief> placed;
  /// Objects that this client detected in this W and that the graph has not moved, as the client
  /// published them.
  std::vector<ObjectBelief> as_published;
  /// Standing corrections of objects near the body, except kDifferent. The beliefs above do not
  /// contain them, and `members` does not contain objects that people joined (kSame).
  std::vector<Correction> corrections;
};

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<MapObject> auto& d, auto& w) {
  a.value("id", d.id, w.object_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.object("world", d.world, w.reference);
  a.name("class_name", d.class_name, w.class_name);
  a.probability("existence", d.existence, w.existence);
  a.probability("class_probability", d.class_probability, w.class_probability);
  a.matrix("mean", d.mean, w.mean, kCoordinate);
  a.covariance("covariance", d.covariance, w.covariance);
  a.time("first_seen_ns", d.first_seen, w.first_seen_ns);
  a.time("last_seen_ns", d.last_seen, w.last_seen_ns);
  a.value("hits", d.hits, w.hits);
  a.choice("visibility", d.visibility, w.visibility, Visibility::kBehind);
  a.choice("memory", d.memory, w.memory, Memory::kLongTerm);
  a.value("provisional", d.provisional, w.provisional);
}

void describe(auto& a, Is<MapTile> auto& d, auto& w) {
  a.value("x", d.x, w.x);
  a.value("y", d.y, w.y);
  a.value("part", d.part, w.part);
  a.ensure("part", "out_of_range", [&] { return d.part >= 0; });
  a.value("instance", d.instance, w.source);
  a.value("revision", d.revision, w.revision);
  a.list("objects", d.objects, w.items, kMapTileCapacity);
}

void describe(auto& a, Is<MapHeader> auto& d, auto& w) {
  a.value("instance", d.instance, w.source);
  a.value("revision", d.revision, w.revision);
  a.number("tile_size_m", d.tile_size_m, w.tile_size_m, kPositive);
  a.value("tiles", d.tiles, w.tile_count);
  a.value("objects", d.objects, w.object_count);
}

void describe(auto& a, Is<MapFrame> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.object("map", d.map, w.map_reference);
  a.pose("T_MW", d.T_MW, w.T_MW);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.value("revision", d.revision, w.revision);
  a.value("sessions", d.sessions, w.session_count);
  a.value("loops", d.loops, w.loop_count);
  a.value("anchors", d.anchors, w.anchor_count);
}

void describe(auto& a, Is<Member> auto& d, auto& w) {
  a.value("track", d.track, w.track);
  a.value("object", d.object, w.object);
  a.ensure("object", "out_of_range", [&] { return d.track != 0 && d.object != 0; });
}

void describe(auto& a, Is<MapNear> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.value("client", d.client, w.client);
  a.object("world", d.world, w.reference);
  a.value("revision", d.revision, w.revision);
  a.time("kept_ns", d.kept, w.kept_ns);
  a.value("next_id", d.next_id, w.next_object_id);
  a.value("corrects_drift", d.corrects_drift, w.corrects_drift);
  a.value("more", d.more, w.more);
  a.list("members", d.members, w.members, kObjects);
  a.list("placed", d.placed, w.placed, kObjects);
  a.list("as_published", d.as_published, w.as_published, kObjects);
  a.list("corrections", d.corrections, w.corrections, kMostCorrections);
}

void describe(auto& a, Is<MapQuery> auto& d, auto& w) {
  a.value("client", d.client, w.client);
  a.value("request", d.request, w.request);
  a.choice("kind", d.kind, w.kind, MapQueryKind::kGraph);
  a.value("object_id", d.object_id, w.object_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  a.matrix("low", d.low, w.low, kCoordinate);
  a.matrix("high", d.high, w.high, kCoordinate);
  a.number("radius", d.radius, w.radius, kNotNegative);
  a.object("world", d.world, w.reference);
  a.value("limit", d.limit, w.limit);
}

void describe(auto& a, Is<MapAnchor> auto& d, auto& w) {
  a.value("id", d.id, w.anchor_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.value("previous", d.previous, w.previous);
  a.object("session", d.session, w.session);
  a.object("map", d.map, w.reference);
  a.matrix("p", d.p, w.position, kCoordinate);
  a.number("yaw", d.yaw, w.yaw, kAngle);
  a.matrix("sigma", d.sigma, w.sigma, kNotNegative);
  a.value("objects", d.objects, w.object_count);
}

void describe(auto& a, Is<MapLoopPair> auto& d, auto& w) {
  a.value("known", d.known, w.known);
  a.value("seen", d.seen, w.seen);
}

void describe(auto& a, Is<MapLoop> auto& d, auto& w) {
  a.value("id", d.id, w.loop_id);
  a.value("a", d.a, w.a);
  a.value("b", d.b, w.b);
  a.ensure("id", "out_of_range", [&] { return d.id != 0 && d.a != 0 && d.b != 0; });
  a.choice("kind", d.kind, w.kind, MapLoopKind::kTie);
  a.choice("state", d.state, w.state, MapLoopState::kWithdrawn);
  a.matrix("residual", d.residual, w.residual, kCoordinate);
  a.matrix("sigma", d.sigma, w.sigma, kNotNegative);
  a.number("chi2", d.chi2, w.chi2, kNotNegative);
  a.probability("weight", d.weight, w.weight);
  a.list("pairs", d.pairs, w.pairs, kObjects);
  a.value("landmarks", d.landmarks, w.landmark_count);
}

void describe(auto& a, Is<MapReply> auto& d, auto& w) {
  a.value("client", d.client, w.client);
  a.value("request", d.request, w.request);
  a.value("instance", d.instance, w.source);
  a.value("ok", d.ok, w.ok);
  a.text("error", d.error, w.error, kTextLength);
  a.value("truncated", d.truncated, w.truncated);
  a.list("objects", d.objects, w.items, kReplyObjects);
  a.list("beliefs", d.beliefs, w.beliefs, kObjects);
  a.list("anchors", d.anchors, w.anchors, kReplyAnchors);
  a.list("loops", d.loops, w.loops, kReplyAnchors);
  a.value("anchor_count", d.anchor_count, w.anchor_count);
  a.value("loop_count", d.loop_count, w.loop_count);
  a.list("corrections", d.corrections, w.corrections, kMostCorrections);
}

}  // namespace perdure::wire
