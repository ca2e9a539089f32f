// Scenes with exact truth, run through the pipeline with true poses and simulated detections, so
// that what is measured is the filter (or with vio over rendered images). What it is held to:
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
  std::uint64_t seed = 1;  ///< of the scene
  double seconds = 0.0;    ///< 0: the scene's own length
  double rate_hz = 10.0;   ///< of the frames
  std::int64_t detections_seed = 1;
  bool images = false;  ///< rendered, and vio over them in place of true poses
  std::vector<std::string> assignments = {};  ///< service.key=value
};

/// An object of the map at the end, as objects.json has it.
struct MapObject {
  std::uint64_t id = 0;
  std::string class_name;
  double existence = 0.0, moving = 0.0;
  bool working = true;  ///< in the working set, not in long-term memory
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< of the centre
};

/// What a run left behind, with its scores. Places are in the truth's W: with vio those of the
/// estimate are taken there by the two poses of their frame (of the last one at the end).
struct Outcome {
  Setting setting;
  tools::SimulatedTruth truth;
  tools::ObjectScore final, inst;
  tools::TrajectoryScore trajectory;
  std::vector<MapObject> objects;
  std::vector<nlohmann::json> events;
  std::vector<tools::EstimateRow> inst_rows, final_rows;
  Journal journal;

  /// At the end, believed to be there (existence over one half) and of that class; "": of any that
  /// is named, hence not `other`.
  std::vector<MapObject> believed(const std::string& class_name = "") const;
  /// Those of them that are nearer than so many metres to a place.
  std::size_t countNear(const Eigen::Vector3d& centre, double within,
                        const std::string& class_name = "") const;
  /// Distinct ids of the class in rows nearer than so many metres to a place.
  static std::set<std::uint64_t> idsNear(const std::vector<tools::EstimateRow>& rows,
                                         const Eigen::Vector3d& centre, double within,
                                         const std::string& class_name);
  std::size_t countEvents(const std::string& event) const;
  std::size_t countEvents(const std::string& event, const std::set<std::uint64_t>& objects) const;
  /// True objects of a class that stand all the time.
  std::vector<sim::TruthObject> standing(const std::string& class_name) const;
  /// How a true object is seen in a frame; nullptr where its outline is not in the image.
  const sim::TruthView* viewOf(const sim::TruthObject& object, std::uint64_t frame) const;
  /// From the estimate's W of that frame to the truth's.
  RigidTransform toTruth(TimePoint time, const RigidTransform& T_WB) const;
};

/// The folder of a setting's scene: generated once, and kept in the build folder while the
/// simulator's sources stay as they are.
std::filesystem::path sceneFolder(const Setting& setting);

/// Generates the scene (once: it is kept in the build folder while the simulator's sources stay as
/// they are) and runs the pipeline over it.
Outcome runScene(const Setting& setting);

}  // namespace perdure::test
