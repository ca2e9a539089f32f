// The durable map on the wire: tiles, queries and replies.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure {

/// An object as the map shows it.
struct MapObject {
  ObjectId id = 0;
  WorldId world;  ///< M; or the W that the query names
  std::string class_name;
  double existence = 0.0, class_probability = 0.0;
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  TimePoint first_seen, last_seen;
  std::uint32_t hits = 0;
  Visibility visibility = Visibility::kOutOfView;
  Memory memory = Memory::kWorking;
  /// The session is not yet located on the earlier map, so this may be a second row of a known
  /// object.
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

/// The pose of W, the odometry's frame of reference, in M, the frame of the whole map. It
/// compensates the drift near the body. W never jumps; T_MW jumps at loop closures.
struct MapFrame {
  FrameStamp stamp;  ///< stamp of the frame at which it applies
  InstanceId instance = 0;
  WorldId world;  ///< W
  WorldId map;    ///< M; initially the W of the oldest session that is connected with this one
  RigidTransform T_MW;
  /// Covariance of the body's position and yaw in M, [δp, δyaw], m and rad; all 0: see
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
  kRestore,    ///< a filter starts: requests the newest working set of another filter, on
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
  /// Standard deviations of [p, yaw] relative to the first anchor of M, m and rad. All 0 for
  /// another anchor: not known (map_graph.h).
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();
  std::uint32_t objects = 0;  ///< number of objects last detected from here
};

enum class MapLoopKind : std::uint8_t {
  kLoop = 0,  ///< the body passed this place before
  kTie,       ///< from objects that still had their ids
};
enum class MapLoopState : std::uint8_t {
  kTentative = 0,  ///< the graph does not accept it, or not yet
  kConfirmed,
  kWithdrawn,  ///< it was accepted, but later ones contradict it; not a part of the graph any more
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
  std::vector<MapAnchor> anchors;     ///< for kGraph, by id: anchors in the newest session's M
  std::vector<MapLoop> loops;         ///< for kGraph, by id: loop closures between `anchors`
  /// Totals in that M, including those not in this reply; 0: not known.
  std::uint32_t anchor_count = 0, loop_count = 0;
};

/// A track that belongs to an object with another id.
struct Member {
  TrackId track = 0;
  ObjectId object = 0;
  bool operator==(const Member&) const = default;
};

/// The map's knowledge of the body's surroundings, for one filter. Complete: a later message
/// replaces it.
struct MapNear {
  FrameStamp stamp;  ///< stamp of the newest working set in use
  InstanceId instance = 0;
  InstanceId client = 0;       ///< the filter that owns the working set or sent kRestore
  WorldId world;               ///< W
  std::uint64_t revision = 0;  ///< grows by one with each message of an instance
  /// The map has all messages of the client up to this time on disk; 0: none.
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
};

}  // namespace perdure
