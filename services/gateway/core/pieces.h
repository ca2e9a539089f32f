// Parts that several of Foxglove's JSON messages share.
#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/math/rigid_transform.h"
#include "common/types/class_colour.h"
#include "services/gateway/core/json_writer.h"

namespace perdure::gateway {

/// Frames of REP-105 and REP-103; a camera's frame is <name>_optical. The odometry's W is `odom`.
inline constexpr char kMapFrame[] = "map", kOdomFrame[] = "odom", kBodyFrame[] = "base_link",
                      kEarthFrame[] = "enu";
std::string opticalFrame(const std::string& camera);

/// Writes a time as {"sec", "nsec"}. Times before 1970 become 0.
void put(JsonWriter& json, TimePoint time);
void put(JsonWriter& json, const Eigen::Vector3d& v);
void put(JsonWriter& json, const Eigen::Quaterniond& q);
void put(JsonWriter& json, const RigidTransform& T);
void put(JsonWriter& json, const Colour& colour);

/// Constants of foxglove.SceneUpdate.
enum class DeletionType { kMatching = 0, kAll = 1 };
enum class LineType { kStrip = 0, kLoop = 1, kSegments = 2 };
void putDeletion(JsonWriter& json, TimePoint time, DeletionType type, const std::string& id);
void beginEntity(JsonWriter& json, TimePoint time, const char* frame, const std::string& id);
/// Ends a scene entity. `without`: the primitive types that the entity does not contain.
void endEntity(JsonWriter& json, std::initializer_list<const char*> without);
/// Writes the list `name` of a primitive type ("cubes", "spheres") with one solid.
void putSolid(JsonWriter& json, const char* name, const RigidTransform& pose,
              const Eigen::Vector3d& size, const Colour& colour);
void putLine(JsonWriter& json, LineType type, double thickness_px,
             const std::vector<Eigen::Vector3d>& points, const Colour& colour);
void putPair(JsonWriter& json, const char* name, const std::string& value);

/// Returns the rotation by `yaw` about the vertical axis.
Eigen::Quaterniond rotationOfYaw(double yaw);

}  // namespace perdure::gateway
