// The parameters of the filter. config.cpp says which of them can be set.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct BoxParameters {
  double sigma_px = 0.4;          ///< least standard deviation of a side
  double sigma_network_px = 0.8;  ///< the same in pixels of the network's input, where known
  double sigma_relative = 0.045;  ///< added, in widths (x sides) or heights (y sides) of the box
  double sigma_weak = 0.05;       ///< added to it times the probability that the box is clutter
  double border_px = 6.0;         ///< the border censors a side that is nearer
  double gate = 0.9997;           ///< probability inside the gate of the innovation
  double tail = 5.0;              ///< degrees of freedom of the innovation's t distribution
  double min_size_px = 14.0;      ///< root of the area at which P_D is halved
  double min_network_px = 10.0;   ///< the same in pixels of the network's input, where known
  double noise_view = 0.001;      ///< view change that renews the noise; rad or log distance
  double amodal = 0.5;            ///< share of boxes that span what an occluder hides of the object
  double partial_view = 0.05;     ///< share of boxes that show a part of the object only
  std::int64_t iterations = 3;    ///< of the iterated EKF
  double prior_sides = 200.0;     ///< weight of the assumed noise, in sides of boxes
  double prior_azimuths = 10.0;   ///< weight of the assumed noise, in azimuths
  double bias_share = 0.3;        ///< share of a side's variance that is detector bias
  /// View change after which the bias has fallen to 1/e.
  double bias_angle = 0.3;         ///< direction to the object, rad
  double bias_log_distance = 0.3;  ///< logarithm of the distance
  double bias_image_angle = 0.3;   ///< place in the image, rad
};

struct ClutterParameters {
  double per_frame = 2.0;             ///< expected false boxes in one image
  double min_size_px = 8.0;           ///< their sizes are log-uniform from here to the image
  double censored_probability = 0.1;  ///< that a given side of a false box is censored
  double max_log_ratio = 8.0;         ///< activations are clamped to it against clutter, nats
  double other_lookalike = 0.2;  ///< share of objects of no known class that resemble a known one
  double other_prior = 0.01;     ///< probability of "other" at initiation
};

struct PoseParameters {
  /// Random walk added to the pose error, whatever covariance the odometry reports. Exact poses
  /// have none.
  double walk_position = 0.005;   ///< m/√m
  double walk_rotation = 0.0002;  ///< rad/√m
};

struct TemperingParameters {
  double correlation = 0.5;  ///< of the errors of two observations from the same viewpoint
  /// View change after which it has fallen to 1/e.
  double angle = 0.1;                 ///< direction to the object, rad
  double log_distance = 0.1;          ///< logarithm of the distance
  double image_angle = 0.03;          ///< place in the image, rad
  double detection_rate_prior = 3.0;  ///< weight of the class's P_D, in observations
};

struct VisibilityParameters {
  std::int64_t cell_px = 8;           ///< of the depth buffer
  double minimum = 0.25;              ///< a smaller visible fraction counts as 0: no evidence
  double full = 0.7;                  ///< from here on an object is reported as visible
  double solid = 0.4;                 ///< existence from which an object occludes others
  double unmapped_occluder = 0.7;     ///< its probability far from the directions of detections
  double hard_to_detect = 0.05;       ///< the same of a view from which detections are rare
  double hard_detection_share = 0.3;  ///< P_D there, relative
  /// View change after which the learned values have fallen to 1/e. A hedge hides an object from a
  /// whole side, at any distance; a detector fails from single views.
  double occluder_angle = 1.2;              ///< of the occluder: direction to the object, rad
  double detectability_angle = 0.15;        ///< of the rest: direction to the object, rad
  double detectability_log_distance = 0.3;  ///< of the rest: logarithm of the distance
};

struct MotionParameters {
  double position_walk = 0.02;    ///< of a static object, m/√s
  double yaw_walk = 0.01;         ///< of a static object, rad/√s
  double acceleration = 1.0;      ///< white, of a moving object, m/s²/√Hz
  double survival_s = 3600.0;     ///< mean time for which an object stays where it is
  double mover_survival_s = 1.0;  ///< mean survival time of a moving object without detections
  double min_speed = 0.7;         ///< slower objects count as static, m/s
  double slow_share = 0.25;       ///< of a class's speed deviation: slower motion has a low prior
  double creeping = 0.03;         ///< factor on the Gaussian speed prior for such slow motion
  double lost_sigma_m = 10.0;  ///< moving hypotheses with a larger position deviation are removed
  double start_probability = 0.02;  ///< of the moving hypothesis that is added to a static one
  double misplaced_odds = 5.0;      ///< of a wrong depth against having driven off
  double misplaced_sigma = 0.1;     ///< of that wrong depth and size, relative
  double start_nis = 3.0;           ///< normalised innovation above which both are added
};

struct GroundParameters {
  bool use = true;
  double slope = 0.03;         ///< standard deviation
  double roughness = 0.04;     ///< random walk of the height, m/√m
  double prior_objects = 5.0;  ///< weight of these two, in objects
  double sigma_m = 0.05;       ///< of an underside beside the ground: kerbs, wheels
  double reach_m = 60.0;       ///< range within which objects contribute
  double resolved = 0.06;      ///< largest relative deviation of the place of an object that says
  double span_m = 3.0;         ///< range of the undersides of what does not stand on the ground
  double body_height_m = 0.0;  ///< of the body's origin above the ground; 0: not known
  double body_height_sigma_m = 0.05;
};

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
  double confirm_sigma_m = 2.0;   ///< of the place relative to the body; given up at 1.5 times that
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

inline constexpr int kMostKeyframes = 32;  ///< keyframes of a track, whatever is configured

struct SmoothingParameters {
  std::int64_t keyframes = 24;  ///< kept for one track at most; 0: no batch estimate
  std::int64_t least = 5;       ///< with fewer the EKF's state stays
  double fresh = 0.3;           ///< share of new keyframes that calls for another fit
  std::int64_t per_frame = 2;   ///< tracks that are fitted in one frame
  std::int64_t patience = 3;   ///< fits become at most so many times rarer where they change little
  double new_view = 0.12;      ///< least view change between keyframes, in bias lengths
  double place = 0.2;          ///< a fit that is placed worse, relative to the distance, is refused
  double contradicted = 0.2;   ///< share of keyframes that may contradict a fit
  double least_weight = 0.02;  ///< of a hypothesis that is fitted
};

struct MemoryParameters {
  bool archive = true;
  double recall_m = 60.0;  ///< objects of the map that are nearer to the body are recalled
  double margin_m = 20.0;  ///< tracks that are farther than both together are archived
  double after_s = 5.0;    ///< and that were not detected for this time
};

struct Parameters {
  BoxParameters box;
  ClutterParameters clutter;
  InitiationParameters initiation;
  MotionParameters motion;
  PoseParameters pose;
  TemperingParameters tempering;
  VisibilityParameters visibility;
  TrackParameters tracks;
  SmoothingParameters smoothing;
  GroundParameters ground;
  MemoryParameters memory;
};

/// Gates: squared Mahalanobis distances beyond which two things are not the same. In brackets:
/// dimensions, and the probability that a Gaussian residual is beyond. The gate of a box is
/// box.gate, that of two hypotheses tracks.hypothesis_merge.
namespace gates {

// A box and a hypothesis.
inline constexpr double kWholeView = 9.0;       ///< [4, .06] beyond, a partial view is tried
inline constexpr double kForeignBox = 14.0;     ///< [4, .007] the keyframe showed something else
inline constexpr double kContradiction = 25.0;  ///< [4, 5e-5] the keyframe contradicts a MAP fit

// Two boxes of one image.
inline constexpr double kSameEdge = 4.0;  ///< [1, .05] their sides are not the same edge
inline constexpr double kLower = 4.0;     ///< [1, .05] one reaches lower than the other

// Two Gaussians.
inline constexpr double kNoFusion = 24.3;  ///< [7, .001] the mean of both would be wrong
inline constexpr double kSameMode = 1.0;   ///< [7, .995] two modes of one track are one
inline constexpr double kSameFit = 0.25;   ///< [7] a fit comes to a mode that is known
inline constexpr double kUnchanged = 1.0;  ///< [7, .995] a refit changed little

// One height.
inline constexpr double kGroundOutlier = 12.0;  ///< [1, .0005] it does not stand on this ground

}  // namespace gates

}  // namespace perdure::semantic_filter
