// The truth of a simulated folder: objects_truth.json, visibility_truth.csv and inside_truth.csv,
// written and read. A folder without inside_truth.csv is read as one where it is empty.
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

/// An object where it is from `from` on until the next key, or on a straight way between keys
/// where `moves` is set (keys are then dense: ten a second).
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
  std::vector<TruthKey> keys;  ///< at least one, by time

  bool presentAt(TimePoint t) const { return t >= present_from && t < present_until; }
  TruthKey at(TimePoint t) const;
};

/// One object in one frame of cam0. Rows exist for objects whose full outline touches the image.
struct TruthView {
  std::uint64_t object_id = 0;
  /// Pixels in which it is seen over the pixels of its whole outline, the part beyond the image's
  /// border included.
  double visible_fraction = 0.0;
  Box box;  ///< of its whole outline as if nothing hid it, not clipped to the image
  /// Of the part of that outline within the image; set where the border cuts it.
  std::optional<Box> inside = {};

  /// Returns the box within an image of this size: `inside`, or the common part of box and image.
  Box boxInside(double width, double height) const;
};

struct Truth {
  std::vector<TruthObject> objects;
  std::map<std::uint64_t, std::vector<TruthView>> views;  ///< by frame index
};

bool hasTruth(const std::filesystem::path& folder);
/// Throws StartupError(kUnavailable) that names the file, the line and the mend.
Truth readTruth(const std::filesystem::path& folder);
/// `epoch` is the sensor time of the scene's t = 0.
std::vector<TruthObject> truthOf(const Scene& scene, TimePoint epoch);
void writeObjectsTruth(const std::filesystem::path& folder,
                       const std::vector<TruthObject>& objects);

}  // namespace perdure::sim
