// The truth of a simulated folder: reads and writes objects_truth.json, visibility_truth.csv and
// inside_truth.csv. A missing inside_truth.csv is treated as an empty file.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/sim/scene.h"
#include "common/types/detections.h"

namespace perdure::sim {

inline constexpr char kObjectsTruthFile[] = "objects_truth.json";
inline constexpr char kVisibilityTruthFile[] = "visibility_truth.csv";
inline constexpr char kVisibilityHeader[] = "frame,object_id,visible_fraction,x1,y1,x2,y2";
inline constexpr char kInsideTruthFile[] = "inside_truth.csv";
inline constexpr char kInsideHeader[] = "frame,object_id,x1,y1,x2,y2";

/// The pose of an object at a time. The object stays there until the next key. If `moves` is set,
/// it moves on a straight line between keys, which are then dense: ten per second.
struct TruthKey {
  TimePoint time;
  Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
  double yaw = 0.0;
};
struct TruthObject {
  std::uint64_t id = 0;
  std::string class_name, looks_like;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< length, width, height
  bool moves = false;
  TimePoint present_from, present_until;
  std::vector<TruthKey> keys;  ///< keys, sorted by time; at least one

  bool presentAt(TimePoint t) const { return t >= present_from && t < present_until; }
  TruthKey at(TimePoint t) const;
};

Box clipped(const Box& box, double width, double height);

/// One object in one frame of cam0. Rows exist for objects whose full outline touches the image.
struct TruthView {
  std::uint64_t object_id = 0;
  /// Number of visible pixels divided by the pixels of the complete outline, including the part
  /// outside the image.
  double visible_fraction = 0.0;
  Box box;  ///< box of the complete, unoccluded outline, not clipped to the image
  /// Box of the part of that outline inside the image; set if the image border cuts it.
  std::optional<Box> inside = {};

  /// The box within an image of this size: `inside`, or the intersection of box and image.
  Box boxInside(double width, double height) const;
};

struct Truth {
  std::vector<TruthObject> objects;
  std::map<std::uint64_t, std::vector<TruthView>> views;  ///< key: frame index
};

bool hasTruth(const std::filesystem::path& folder);
/// Throws StartupError(kUnavailable) with the file, the line and the fix.
Truth readTruth(const std::filesystem::path& folder);
/// `epoch` is the sensor time of the scene's t = 0.
std::vector<TruthObject> truthOf(const Scene& scene, TimePoint epoch);
void writeObjectsTruth(const std::filesystem::path& folder,
                       const std::vector<TruthObject>& objects);

}  // namespace perdure::sim
