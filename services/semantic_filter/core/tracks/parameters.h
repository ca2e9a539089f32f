// Parameters of track management.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct InitiationParameters {
  double odds = 0.2;             ///< expected new objects against false boxes, in one box
  double min_log_ratio = 0.5;    ///< weaker boxes only support tracks, nats
  double explained = 0.5;        ///< a box that tracks explain by more starts none
  std::int64_t max_classes = 4;  ///< kept of the network's list; "other" is kept beside them
  double class_ratio = 0.01;     ///< classes below this share of the best are dropped
  double landmark_decay = 0.3;   ///< e-folding distance of a landmark's weight, in half boxes
  std::int64_t min_landmarks = 6;
  double min_distance_m = 1.5;
};

struct TrackParameters {
  double confirm = 0.95;          ///< existence that confirms a track
  std::int64_t confirm_hits = 3;  ///< detections that it takes
  double confirm_sigma_m = 1.5;   ///< of the place relative to the body; given up at twice that
  double certain = 0.99;          ///< existence stays below it, so that misses count
  double certain_again = 0.999;   ///< the same after a detection on another visit
  double delete_below = 0.02;     ///< existence
  double delete_tentative_below = 0.05;  ///< of a track with one detection
  double tentative_s = 10.0;             ///< out of view, after which a tentative track is deleted
  double class_dominates = 0.995;        ///< a class above this ends the others
  double size_gate = 4.5;                ///< deviations of the class's size
  double hypothesis_floor = 0.002;       ///< lighter hypotheses are pruned
  double scale_resolved = 0.06;   ///< relative deviation of the distance; above it "other" stays
  double hypothesis_merge = 1.0;  ///< squared Mahalanobis distance
  double reidentify_s = 60.0;     ///< a deleted track may be re-identified for this time
  double merge_overlap = 0.25;    ///< shared over joint volume of two tracks that are one object
  double merge_turns = 0.1;       ///< the same of two that are detected in turns
  double merge_inside = 0.3;      ///< share of an "other" that lies in a known object
  std::int64_t max_objects = 2000;
};

}  // namespace perdure::semantic_filter
