// Runs scenes with exact truth through the pipeline. With true poses and simulated detections, the
// results measure the filter alone; rendered images with vio are also possible. The bars are in
// verdict.h.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/scenario/journal.h"
#include "tests/scenario/verdict.h"
#include "tools/evaluate/object_score.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/evaluate/trajectory_score.h"

namespace perdure::test {

struct Setting {
  std::string scene;
  std::uint64_t seed = 1;  ///< seed of the scene
  double seconds = 0.0;    ///< 0: the scene's own length
  double rate_hz = 10.0;   ///< frame rate
  std::int64_t detections_seed = 1;
  bool images = false;                        ///< rendered images with vio instead of true poses
  std::vector<std::string> assignments = {};  ///< service.key=value
};

/// An object of the final map, from objects.json.
struct MapObject {
  std::uint64_t id = 0;
  std::string class_name;
  double existence = 0.0, moving = 0.0;
  bool working = true;  ///< true if the object is in the working set, not in long-term memory
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< covariance of the centre
};

/// The outputs of a run and its scores. Places are in the truth's W. With vio, each place is
/// transformed by the estimated and true pose of its frame, or of the last frame for the final map.
struct Outcome {
  Setting setting;
  tools::SimulatedTruth truth;
  tools::ObjectScore final, inst;
  tools::TrajectoryScore trajectory;
  std::vector<MapObject> objects;
  std::vector<nlohmann::json> events;
  std::vector<tools::EstimateRow> inst_rows, final_rows;
  Journal journal;

  /// Returns the objects of the final map with existence above one half and this class. "" means
  /// any class except `other`.
  std::vector<MapObject> believed(const std::string& class_name = "") const;
  /// Returns how many of these objects are within `within` metres of a place.
  std::size_t countNear(const Eigen::Vector3d& centre, double within,
                        const std::string& class_name = "") const;
  /// Returns the distinct ids of the class in rows within `within` metres of a place.
  static std::set<std::uint64_t> idsNear(const std::vector<tools::EstimateRow>& rows,
                                         const Eigen::Vector3d& centre, double within,
                                         const std::string& class_name);
  std::size_t countEvents(const std::string& event) const;
  std::size_t countEvents(const std::string& event, const std::set<std::uint64_t>& objects) const;
  /// Returns the true objects of a class that always stand.
  std::vector<sim::TruthObject> standing(const std::string& class_name) const;
  /// Returns the view of a true object in a frame; nullptr if its outline is outside the image.
  const sim::TruthView* viewOf(const sim::TruthObject& object, std::uint64_t frame) const;
  /// Returns the transform from the estimate's W of that frame to the truth's.
  RigidTransform toTruth(TimePoint time, const RigidTransform& T_WB) const;
};

/// Returns the folder of a setting's scene. The scene is generated once and stored in the build
/// folder until the simulator's sources change.
std::filesystem::path sceneFolder(const Setting& setting);

/// Generates the scene if it is not stored in the build folder, and runs the pipeline over it.
Outcome runScene(const Setting& setting);

}  // namespace perdure::test
