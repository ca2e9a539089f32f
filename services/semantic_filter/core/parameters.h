// The constants of the estimator, with their defaults; config.cpp describes each for people.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct BoxParameters {
  double sigma_px = 1.0;         ///< floor of a side's standard deviation
  double sigma_relative = 0.04;  ///< of the box's width (x sides) or height (y sides)
  double border_px = 6.0;        ///< a side this near to the image border is cut by it
  double gate = 0.9997;          ///< probability mass inside the gate of the innovation
  double min_height_px = 12.0;   ///< detection probability has fallen to one half here
  double min_network_px = 9.0;   ///< the same in the pixels of the network's input, where known
  std::int64_t iterations = 3;   ///< of the iterated EKF
};

struct ClutterParameters {
  double per_frame = 2.0;    ///< expected false boxes in one image
  double min_size_px = 8.0;  ///< of false boxes: sizes are log-uniform from here to the image
  double censored_probability = 0.1;  ///< that a false box is cut at a given side
  double max_log_ratio = 8.0;         ///< activations are clamped to this many nats against clutter
  double other_lookalike = 0.2;  ///< share of things of no known class that look like a known one
  double other_prior = 0.01;     ///< PMF of "other" at birth
};

struct BirthParameters {
  double odds = 0.2;             ///< expected new objects in a box against false alarms
  double min_log_ratio = -2.0;   ///< weaker boxes only support objects that are there
  double claimed = 0.5;          ///< a box claimed with more than this gives no birth
  std::int64_t max_classes = 4;  ///< kept of the network's list, "other" beside them
  double class_ratio = 0.01;     ///< classes below this share of the best are not kept
  double landmark_decay = 0.3;   ///< e-folding distance of a landmark's weight, in half boxes
  std::int64_t min_landmarks = 6;
  double min_distance_m = 1.5;
};

struct MotionParameters {
  double position_walk = 0.02;      ///< m/√s, of static hypotheses
  double yaw_walk = 0.01;           ///< rad/√s
  double acceleration = 1.0;        ///< m/s²/√Hz, of moving hypotheses
  double survival_s = 3600.0;       ///< mean time a thing stays where it is
  double min_speed = 0.7;           ///< m/s: slower ones count as static
  double start_probability = 0.02;  ///< of a moving hypothesis that is added to a static object
  double start_nis = 3.0;           ///< running innovation above which it is added
};

struct PoseParameters {
  double walk_position = 0.02;    ///< m/√m, where odometry has no covariance
  double walk_rotation = 0.0008;  ///< rad/√m
};

struct LooksParameters {
  double correlation = 0.7;   ///< of the errors of two looks from the same place
  double angle = 0.1;         ///< rad, change of aspect after which it has fallen to 1/e
  double log_distance = 0.1;  ///< the same for the logarithm of the distance
  double image_angle = 0.03;  ///< rad, the same for the place in the image
};

struct VisibilityParameters {
  std::int64_t cell_px = 8;
  double minimum = 0.25;  ///< v below this is 0: no evidence
  double full = 0.7;      ///< v from here on is called visible
  double solid = 0.4;  ///< existence (times its late hit rate) from which an object can hide others
};

struct TendParameters {
  double confirm = 0.95;
  std::int64_t confirm_hits = 2;
  double confirm_sigma_m =
      2.2;                ///< of its place beside the body; one that is not known is no claim
  double certain = 0.99;  ///< existence is kept below it, so that misses can still be heard
  double gone = 0.02;     ///< existence below which an object is forgotten
  double gone_tentative = 0.05;
  double class_dominates = 0.995;
  double hypothesis_floor = 0.002;
  double scale_resolved = 0.06;   ///< relative deviation of the distance; before it "other" stays
  double hypothesis_merge = 1.0;  ///< squared Mahalanobis distance
  double merge_overlap = 0.25;
  std::int64_t max_objects = 2000;
};

struct Parameters {
  BoxParameters box;
  ClutterParameters clutter;
  BirthParameters birth;
  MotionParameters motion;
  PoseParameters pose;
  LooksParameters looks;
  VisibilityParameters visibility;
  TendParameters tend;
};

}  // namespace perdure::semantic_filter
