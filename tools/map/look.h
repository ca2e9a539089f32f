// Where to look next: ranks poses by the expected information about the objects of a map's file.
// Derivation: tools/docs/maths/expected_information.md.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"
#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/planning/expectation.h"

namespace perdure::tools {

using semantic_filter::TimedView;

/// The objects of a map's file in M, and the poses from which it was made.
struct MapToLook {
  std::vector<ObjectBelief> beliefs;
  std::vector<TimedView> past;  ///< anchors, ordered by time; empty: the map has no graph
  TimePoint newest;             ///< time of the newest anchor or detection
};
/// Reads the objects at rest that are joined to the newest session's M. Throws StartupError.
MapToLook readMapToLook(const std::string& path);

/// A pose, or a route as a whole, with what it is expected to show.
struct Prospect {
  std::vector<TimedView> views;
  semantic_filter::Fall fall;
  struct Object {
    ObjectId id = 0;
    std::string class_name;
    double existence = 0.0;  ///< probability that it is still there
    double detected = 0.0;   ///< probability that it is detected, if it is there
    semantic_filter::Fall fall;
  };
  std::vector<Object> objects;  ///< by decreasing information

  double length_m() const;
};

/// The camera, the class priors and the filter's parameters.
struct LookSettings {
  CameraModel camera;
  semantic_filter::ClassPriors priors;
  semantic_filter::Parameters parameters;
};
/// Reads the camera of a rig file or of a drive, and the filter's configuration; "":
/// semantic_filter.yaml of the configuration folder. Throws StartupError.
LookSettings readLookSettings(const std::string& rig, const std::string& config);

/// Returns the objects of the map, and the places that `planned` views may show.
std::vector<semantic_filter::Candidate> candidatesOf(const MapToLook& map,
                                                     const std::vector<TimedView>& planned,
                                                     const semantic_filter::Observer& observer);

/// Returns the prospect of each list of views: of one pose, or of a route in its order.
std::vector<Prospect> prospectsOf(const MapToLook& map,
                                  const std::vector<std::vector<TimedView>>& plans,
                                  const LookSettings& settings);

/// Reads the body's poses in M from a file of TUM lines. The first pose is taken at `start`.
std::vector<TimedView> readPlan(const std::string& file, TimePoint start);
/// Returns the poses at time `at` within `radius` of a place, at anchors, in eight directions.
std::vector<TimedView> posesAround(const MapToLook& map, const Eigen::Vector2d& place,
                                   double radius, TimePoint at);

nlohmann::ordered_json toJson(const Prospect& prospect);

}  // namespace perdure::tools
