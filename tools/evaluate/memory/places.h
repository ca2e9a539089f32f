// Scores the memory of a run by the measured places of objects at rest and the frames of each
// visit.
#pragma once

#include <filesystem>
#include <string>

#include "tools/evaluate/memory/visits.h"

namespace perdure::tools {

/// A row of the file of places: the position of an object, measured on one visit.
struct PlaceVisit {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in the frame of the true poses
  std::vector<std::uint64_t> frames;
};
using Places = std::map<std::uint64_t, std::map<std::uint64_t, PlaceVisit>>;  ///< by place, visit

/// Reads a CSV file with the header place,visit,x,y,z,frames; frames are separated by blanks.
/// Throws StartupError(kData) that names each wrong line.
Places readPlaces(const std::filesystem::path& file);

struct PlaceOptions {
  /// An object belongs to a place if its centre is `along_m` behind the place, along the horizontal
  /// ray from the body, and at most `across_m` from the ray. The defaults are for cars whose place
  /// is on their near side.
  std::vector<double> along_m{-1.5, 3.5};
  double across_m = 1.2;
  std::vector<double> range_m{5.0, 25.0};  ///< recall counts frames with this distance to the place
  std::uint64_t least_frames = 8;          ///< visits with fewer frames are not compared
  std::string class_name;                  ///< class of the objects; empty: all classes
};

/// A frame of the run with a true pose.
struct PlaceFrame {
  RigidTransform T_WB;
  RigidTransform T_WP;  ///< from the frame of the true poses to the run's W
  std::vector<const EstimateRow*> rows;
};

struct RunEvents {
  std::map<std::string, std::uint64_t> counts;    ///< number of events by name
  std::map<std::uint64_t, std::uint64_t> merged;  ///< the id that replaces each merged id

  std::uint64_t finalId(std::uint64_t id) const;
};
RunEvents readRunEvents(const std::filesystem::path& file);

struct PlaceScore {
  std::uint64_t visited_twice = 0;  ///< places with at least two visits that are long enough
  /// Counts of places with several visits. kept: the object at the first and the last visit is the
  /// same after all merges; kept_in_visit: its id was already the same then; without: no object was
  /// found at one of these visits.
  std::uint64_t kept = 0, kept_in_visit = 0, without = 0;
  std::uint64_t first_asked = 0, first_found = 0;  ///< frames of visit 0 within range; with object
  std::uint64_t later_asked = 0, later_found = 0;
  std::vector<double> along_m, across_m;  ///< offset from each place to its object
};
PlaceScore scorePlaces(const Places& places, const std::map<std::uint64_t, PlaceFrame>& frames,
                       const RunEvents& events, const PlaceOptions& options);

}  // namespace perdure::tools
