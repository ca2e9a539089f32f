// The truth of a simulated folder: reads objects_truth.json, visibility_truth.csv and
// inside_truth.csv, and writes them. A missing inside_truth.csv counts as empty.
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

/// The pose of an object from a time on, until the next key. If `moves` is set, the object moves
/// straight between keys, which are then dense: ten per second.
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

/// One object in one frame of cam0. A row exists if the object's full outline touches the image.
struct TruthView {
  std::uint64_t object_id = 0;
  /// Visible pixels divided by the pixels of the complete outline, including its part outside the
  /// image.
  double visible_fraction = 0.0;
  Box box;  ///< box of the complete, unoccluded outline, not clipped to the image
  /// Box of the outline's part inside the image; set if the image border truncates the outline.
  std::optional<Box> inside = {};

  /// The box within an image of this size: `inside`, or else the intersection of box and image.
  Box boxInside(double width, double height) const;
};

struct Truth {
  std::vector<TruthObject> objects;
  std::map<std::uint64_t, std::vector<TruthView>> views;  ///< key: frame index
};

bool hasTruth(const std::filesystem::path& folder);
/// Reads a folder. Throws StartupError(kUnavailable) with file, line and fix if a file is invalid.
Truth readTruth(const std::filesystem::path& folder);
/// The truth of a scene's objects; `epoch` is the sensor time of the scene's t = 0.
std::vector<TruthObject> truthOf(const Scene& scene, TimePoint epoch);
void writeObjectsTruth(const std::filesystem::path& folder,
                       const std::vector<TruthObject>& objects);

}  // namespace perdure::sim
