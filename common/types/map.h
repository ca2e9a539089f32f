// The durable map on the wire: tiles, queries and replies.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure {

/// One object as the map shows it.
struct MapObject {
  ObjectId id = 0;
  WorldId world;  ///< M, or where a question named a W that W
  std::string class_name;
  double existence = 0.0, class_probability = 0.0;
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  TimePoint first_seen, last_seen;
  std::uint32_t hits = 0;
  Visibility visibility = Visibility::kOutOfView;
  Memory memory = Memory::kWorking;
  /// Of a session that is not found on the map of before yet: it may be an object of it.
  bool provisional = false;
};

inline constexpr std::size_t kMapTileCapacity = 128;

/// Objects of one square of the map; `part` counts tiles of the same square.
struct MapTile {
  InstanceId instance = 0;
  std::int32_t x = 0, y = 0, part = 0;  ///< key; squares of header.tile_size_m
  std::uint64_t revision = 0;
  std::vector<MapObject> objects;  ///< at most kMapTileCapacity
};

struct MapHeader {
  InstanceId instance = 0;
  std::uint64_t revision = 0;
  double tile_size_m = 0.0;
  std::uint32_t tiles = 0, objects = 0;
};

/// How W, the odometry's frame of reference, lies in M, in which the map is one: without the drift
/// beside the body. W never jumps; T_MW does when a loop is closed.
struct MapFrame {
  FrameStamp stamp;  ///< of the frame beside whose pose it holds
  InstanceId instance = 0;
  WorldId world;  ///< W
  WorldId map;    ///< M: it begins as the W of the oldest session that hangs together with this one
  RigidTransform T_MW;
  /// Of the body's place and yaw in M, [δp, δyaw], m and rad; all 0: see hasCovariance().
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  std::uint64_t revision = 0;  ///< counts changes of the graph
  std::uint32_t sessions = 0;  ///< that hang together with this one, itself included
  std::uint32_t loops = 0;     ///< that are believed, of all sessions
  std::uint32_t anchors = 0;   ///< of all sessions
};

enum class MapQueryKind : std::uint8_t {
  kById = 0,
  kByClass,
  kByRadius,
  kByBox,
  kAll,
  kRestore,    ///< a filter begins: the newest working set of another one, on `map/near`
  kGraph = 7,  ///< anchors nearest to `low` first, within `radius` (0: all), and loops between them
};

struct MapQuery {
  InstanceId client = 0;
  std::uint64_t request = 0;  ///< client and request are the correlation id
  MapQueryKind kind = MapQueryKind::kAll;
  ObjectId object_id = 0;
  std::string class_name;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< box corner, or centre of the sphere
  Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< box corner
  double radius = 0.0;
  WorldId world;  ///< the W that is meant; 0: M
  std::uint32_t limit = 1000;
};

using AnchorNumber = std::uint64_t;  ///< 0: none
/// A place on the way to which what was seen there is tied: an anchor of the map's graph.
struct MapAnchor {
  AnchorNumber id = 0;
  AnchorNumber previous = 0;                    ///< of the same session; 0: none
  WorldId session;                              ///< the W of its way
  WorldId map;                                  ///< M
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< in M
  double yaw = 0.0;                             ///< rad
  /// Standard deviations of [p, yaw] relative to the first anchor of M, m and rad; all 0 of another
  /// one: not known (map_graph.h).
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();
  std::uint32_t objects = 0;  ///< that were seen from here last
};

enum class MapLoopKind : std::uint8_t {
  kLoop = 0,  ///< a place was found again
  kTie,       ///< by objects that still had their ids
};
enum class MapLoopState : std::uint8_t {
  kTentative = 0,  ///< the graph does not believe it, or not yet
  kConfirmed,
  kWithdrawn,  ///< it was told, and later ones contradict it: no part of the graph any more
};

/// Two objects that a loop found to be one: of the map, and of what was seen then.
struct MapLoopPair {
  ObjectId known = 0, seen = 0;
};

/// That anchors a and b lie to each other as was measured when a place was seen again.
struct MapLoop {
  std::uint64_t id = 0;
  AnchorNumber a = 0, b = 0;  ///< b: where the body was
  MapLoopKind kind = MapLoopKind::kLoop;
  MapLoopState state = MapLoopState::kTentative;
  /// Measured [p, yaw] of b minus where the graph has it, in axes of a; m and rad.
  Eigen::Vector4d residual = Eigen::Vector4d::Zero();
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();  ///< of the measurement; all 0: not known
  double chi2 = 0.0;                                ///< of the residual
  double weight = 0.0;                              ///< by which it counts in the graph, [0, 1]
  std::vector<MapLoopPair> pairs;                   ///< empty: not known, or none
  std::uint32_t landmarks = 0;                      ///< that look alike; 0: not known, or none
};

struct MapReply {
  InstanceId client = 0;
  std::uint64_t request = 0;
  InstanceId instance = 0;
  bool ok = true;
  std::string error;       ///< a sentence with the mend where !ok
  bool truncated = false;  ///< more objects or anchors matched than `limit`
  std::vector<MapObject> objects;
  std::vector<ObjectBelief> beliefs;  ///< the objects in full, where one was asked for by its id
  std::vector<MapAnchor> anchors;     ///< of kGraph, by id: those of the newest session's M
  std::vector<MapLoop> loops;         ///< of kGraph, by id: those between `anchors`
  /// Of that M, also what is not told; 0: not known.
  std::uint32_t anchor_count = 0, loop_count = 0;
};

/// A track that belongs to an object with another id.
struct Member {
  TrackId track = 0;
  ObjectId object = 0;
  bool operator==(const Member&) const = default;
};

/// All that the map knows of the surroundings of the body, for one filter. Complete: a later one
/// replaces it.
struct MapNear {
  FrameStamp stamp;  ///< of the newest working set that was used
  InstanceId instance = 0;
  InstanceId client = 0;       ///< the filter whose working set it is, or that asked kRestore
  WorldId world;               ///< W
  std::uint64_t revision = 0;  ///< grows by one with each message of an instance
  /// What the client published up to this time is on the disk; 0: nothing.
  TimePoint kept;
  ObjectId next_id = 1;         ///< ids below it are taken
  bool corrects_drift = false;  ///< the map's graph receives this odometry
  bool more = false;            ///< more objects are near
  /// Tracks of the working set and of the lists below whose object has another id. A track that is
  /// not listed has its own id.
  std::vector<Member> members;
  /// Objects that are not in the working set, and objects there that were not detected since and
  /// are placed differently now. Covariances are relative to the body, cross_pose is zero.
  std::vector<ObjectBelief> placed;
  /// Objects that this client detected in this W and that the graph has not moved: as published.
  std::vector<ObjectBelief> as_published;
};

}  // namespace perdure
