// Judges the memory of a run by places of objects at rest, with the frames of each visit.
#pragma once

#include <filesystem>
#include <string>

#include "tools/evaluate/memory/visits.h"

namespace perdure::tools {

/// A row of the places' file: where an object is by the sensors of one visit.
struct PlaceVisit {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in the frame of the true poses
  std::vector<std::uint64_t> frames;
};
using Places = std::map<std::uint64_t, std::map<std::uint64_t, PlaceVisit>>;  ///< by place, visit

/// Throws StartupError(kData) that names each wrong line; the header is place,visit,x,y,z,frames,
/// with blanks between frames.
Places readPlaces(const std::filesystem::path& file);

struct PlaceOptions {
  /// An object belongs to a place if its centre is so far behind it along the horizontal ray from
  /// the body, and not farther from the ray. The defaults are for cars placed by their near side.
  std::vector<double> along_m{-1.5, 3.5};
  double across_m = 1.2;
  std::vector<double> range_m{5.0, 25.0};  ///< distances of the place from the body for the recall
  std::uint64_t least_frames = 8;          ///< least number of frames of a visit that is compared
  std::string class_name;                  ///< class of the objects; empty: all classes
};

/// A frame of the run with a true pose.
struct PlaceFrame {
  RigidTransform T_WB;
  RigidTransform T_WP;  ///< from the frame of the true poses into the run's W, by both poses
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
  /// Places with several visits: with the same object at the first and the last visit, after all
  /// merges or already during the visit, and without an object at one of these visits.
  std::uint64_t kept = 0, kept_in_visit = 0, without = 0;
  std::uint64_t first_asked = 0, first_found = 0;  ///< frames of visit 0 within range
  std::uint64_t later_asked = 0, later_found = 0;
  std::vector<double> along_m, across_m;  ///< offset from each place to its object
};
PlaceScore scorePlaces(const Places& places, const std::map<std::uint64_t, PlaceFrame>& frames,
                       const RunEvents& events, const PlaceOptions& options);

}  // namespace perdure::tools
